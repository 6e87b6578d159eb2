"""Orbits from many places of boundaries, computed in shared calls of the kernel.

Boundaries that are followed side by side request the orbits that they need; places with the same
method and steps are lanes of one call.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from gearchaos_kernels import (
    LaneSystem,
    Outcome,
    Plan,
    gap_polynomials,
    gaps_along,
    integrate,
)

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.dynamics.side_by_side import Found, Search

if TYPE_CHECKING:
    from gearchaos.dynamics.boundary_equations import Equations

PARAMETERS = 2


class Passing(NamedTuple):
    """A request for the orbits of some places of a boundary.

    Attributes
    ----------
    equations : Equations
        The equations of the boundary.
    places : array, shape (places, states + 2)
        States in their scales, then the shares of both ranges.
    whole : array of bool, shape (places,)
        Whether the monodromy matrix is needed.
    phase : float
        For a grazing, where the extreme of the gap is expected, in steps; NaN if it is unknown.
    """

    equations: "Equations"
    places: Floats
    whole: Mask
    phase: float = np.nan


class Passed(NamedTuple):
    """Orbits from some places.

    Attributes
    ----------
    defect : array, shape (places, states)
        P(x) - x in the scales; P is the map over the period.
    monodromy : array, shape (places, states, states)
        Derivative of P, in the scales; NaN where it was not requested.
    section : array, shape (places, periods, states)
        States at the ends of the excitation periods, dimensionless.
    beyond, phase : array, shape (places,)
        For a grazing, how far the extreme of the gap lies beyond the flank, and where.
    """

    defect: Floats
    monodromy: Floats
    section: Floats
    beyond: Floats
    phase: Floats


Following: TypeAlias = Search[Passing, Passed, Found]
"""Yields requests of orbits, is sent the orbits, and returns the result."""


class _Lanes(NamedTuple):
    """The lanes of some places: the place of each lane, and the first lane of each place."""

    places: Integers
    first: Integers
    tangents: Floats

    @classmethod
    def of(cls, whole: Mask, states: int) -> "_Lanes":
        """Return one lane of each place, or one for each column of its monodromy matrix."""
        counts = np.where(whole, states, 1)
        first = np.cumsum(counts) - counts
        places = np.repeat(np.arange(whole.size), counts)
        return cls(places, first, np.eye(states)[np.arange(places.size) - first[places]])


def passed_of(requests: Sequence[Passing]) -> list[Passed]:
    """Return the orbits of some requests, from one integration for each plan among them."""
    groups: dict[object, list[int]] = {}
    for number, request in enumerate(requests):
        groups.setdefault(_shared(request.equations), []).append(number)
    found: dict[int, Passed] = {}
    for numbers in groups.values():
        some = _passed_together([requests[number] for number in numbers])
        found.update(zip(numbers, some, strict=True))
    return [found[number] for number in range(len(requests))]


def _shared(equations: "Equations") -> object:
    """Return what the orbits of one integration have in common."""
    plan = equations.plan
    if plan.history_periods:
        # The gaps of one element are followed over the whole orbit.
        return plan, equations.flank // 2
    return plan._replace(recorded_periods=0, section_points=0)


def _passed_together(requests: Sequence[Passing]) -> list[Passed]:
    """Return the orbits of requests that one integration can answer."""
    equations = requests[0].equations
    places = np.concatenate([one.places for one in requests])
    counts = np.array([len(one.places) for one in requests])
    scale = np.repeat([one.equations.scale for one in requests], counts, axis=0)
    periods = np.array([one.equations.plan.recorded_periods for one in requests])
    states = scale.shape[1]
    lanes = _Lanes.of(np.concatenate([one.whole for one in requests]), states)
    of_places = equations.system_at(np.clip(places[:, states:], 0.0, 1.0))
    longest = int(periods.max())
    plan = equations.plan._replace(recorded_periods=longest, section_points=longest)
    outcome = integrate(
        of_places.of(lanes.places),
        (places[:, :states] * scale)[lanes.places],
        plan,
        tangent_start=lanes.tangents,
        periods=np.repeat(periods, counts)[lanes.places] if np.ptp(periods) else None,
    )
    defect = outcome.section[lanes.first, -1] / scale - places[:, :states]
    monodromy = _monodromies(outcome, lanes, scale)
    beyond = phase = np.full(len(places), np.nan)
    if plan.history_periods:
        flanks = np.repeat([one.equations.flank for one in requests], counts)
        wanted = np.repeat([one.phase for one in requests], counts)
        history = outcome.history[lanes.first]
        beyond, phase = nearest_extremes(of_places, plan, history, flanks, wanted)
    section, found, at = outcome.section[lanes.first], [], 0
    for whole, count in zip(periods // of_places.repeats_after, counts, strict=True):
        own = slice(at, at + count)
        every = section[own, of_places.repeats_after - 1 :: of_places.repeats_after][:, -whole:]
        found.append(Passed(defect[own], monodromy[own], every, beyond[own], phase[own]))
        at += count
    return found


def _monodromies(outcome: Outcome, lanes: _Lanes, scale: Floats) -> Floats:
    """Return the monodromy matrix of each place in its scales, NaN where only one lane has it."""
    states = scale.shape[1]
    columns = outcome.end_tangent * np.exp(np.sum(outcome.growth, axis=1))[:, np.newaxis]
    counts = np.bincount(lanes.places, minlength=len(scale))
    monodromy = np.full((len(scale), states, states), np.nan)
    (whole,) = np.nonzero(counts == states)
    of = lanes.first[whole, np.newaxis] + np.arange(states)
    one = scale[whole]
    monodromy[whole] = columns[of].transpose(0, 2, 1) * one[:, np.newaxis] / one[:, :, np.newaxis]
    return monodromy


def nearest_extremes(
    system: LaneSystem, plan: Plan, history: Floats, flanks: Integers, phases: Floats
) -> tuple[Floats, Floats]:
    """Return how far the extreme of a gap lies beyond a flank, and its phase, (lanes,) each.

    ``flanks`` (lanes,) are those of one element. Of several extremes that is the one nearest to a
    phase in steps; where the phase is NaN, the one nearest to the flank. NaN where the gap has no
    extreme.
    """
    gaps = gaps_along(system, history, plan.steps_per_period)
    element = int(flanks[0]) // 2
    flank = np.where(flanks % 2, -1.0, 1.0) * gaps.half_clearance[:, element]
    rate, value = gaps.rate[:, :, element], gaps.value[:, :, element]
    turns = rate[:, :-1] * rate[:, 1:] <= 0.0
    aside = np.abs(np.arange(turns.shape[1]) + 0.5 - phases[:, np.newaxis])
    aside = np.minimum(aside, turns.shape[1] - aside)
    away = np.where(np.isnan(aside), np.abs(value[:, :-1] - flank[:, np.newaxis]), aside)
    samples = np.argmin(np.where(turns, away, np.inf), axis=1)
    terms = gap_polynomials(system, plan, history, gaps, (samples, element))
    begin, end = (rate[np.arange(samples.size), samples + n] for n in (0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.clip(np.nan_to_num(-(end + begin) / (end - begin)), -1.0, 1.0)
    at = _turning(terms, at)
    beyond = np.polynomial.polynomial.polyval(at, terms.T, tensor=False) - flank
    there = turns.any(axis=1)
    return np.where(there, beyond, np.nan), samples + 0.5 * (at + 1.0)


def _turning(terms: Floats, at: Floats) -> Floats:
    """Return where polynomials (lanes, terms) have an extreme next to places (lanes,)."""
    slopes = terms[:, 1:] * np.arange(1, terms.shape[1])
    bends = slopes[:, 1:] * np.arange(1, slopes.shape[1])
    for _ in range(6):
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = np.polynomial.polynomial.polyval(at, bends.T, tensor=False)
            slope = np.polynomial.polynomial.polyval(at, slopes.T, tensor=False)
            at = np.clip(at - np.nan_to_num(slope / bend), -1.5, 1.5)
    return at
