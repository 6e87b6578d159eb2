"""Orbits from many places of boundaries, computed in shared calls of the kernel.

Boundaries that are followed side by side request the orbits that they need; places with the same
method and steps are lanes of one call. Derivatives are differences between lanes; only the
derivative of the map by the state is that of the tangent flow.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from gearchaos_kernels import (
    Outcome,
    integrate,
)

from gearchaos.arrays import Complex, Floats, Integers, Mask
from gearchaos.dynamics.boundary_tests import (
    CRITICAL,
    Reference,
    multipliers_of,
    null_vectors,
    solved,
    tests_of,
)
from gearchaos.dynamics.curve_defects import DIFFERENCE
from gearchaos.dynamics.gap_extremes import nearest_extremes
from gearchaos.dynamics.side_by_side import Found, Search
from gearchaos.records.branch import GRAZING

if TYPE_CHECKING:
    from gearchaos.dynamics.boundary_equations import Equations

PARAMETERS = 2

STATE_DIFFERENCE = 1e-7
"""Difference of a state, in its scale, with which the test function is differentiated."""


class Passing(NamedTuple):
    """A request for the orbit of a place of a boundary.

    Attributes
    ----------
    equations : Equations
        The equations of the boundary.
    place : array, shape (states + 2,)
        The state in its scales, then the shares of both ranges.
    reference : Reference or None
        What the test function is continued from; None if it is not needed.
    direction : array, shape (states + 2,)
        Normal of the plane in which a point of the boundary is searched.
    slopes : array, shape (states + 1, states + 2), or None
        Derivatives of the equations by the place, if those of a place nearby are used.
    """

    equations: "Equations"
    place: Floats
    reference: Reference | None = None
    direction: Floats = np.zeros(0)
    slopes: Floats | None = None

    @property
    def differentiated(self) -> bool:
        """Whether the derivatives have to be computed."""
        return self.reference is not None and self.slopes is None


class Passed(NamedTuple):
    """The orbit from a place. Without a reference, test function and steps are NaN.

    Attributes
    ----------
    defect : array, shape (states + 1,)
        P(x) - x in the scales, where P is the map over the period, and the test function.
    slopes : array, shape (states + 1, states + 2)
        Its derivatives by the place, or those of the request.
    step : array, shape (states + 2,)
        The step of Newton's method, which is added to the place; NaN if there is none.
    monodromy : array, shape (states, states)
        Derivative of P, in the scales.
    multipliers : array of complex, shape (states,)
        Floquet multipliers, largest modulus first.
    left, right : array, shape (states,)
        Null vectors at a fold or a period doubling; NaN otherwise.
    section : array, shape (periods, states)
        States at the ends of the excitation periods, dimensionless.
    beyond, phase : float
        For a grazing, how far the extreme of the gap lies beyond the flank, and where.
    """

    defect: Floats
    slopes: Floats
    step: Floats
    monodromy: Floats
    multipliers: Complex
    left: Floats
    right: Floats
    section: Floats
    beyond: float
    phase: float


Following: TypeAlias = Search[Passing, Passed, Found]
"""Yields requests of orbits, is sent the orbits, and returns the result."""


class _Places(NamedTuple):
    """The places of some requests: their own, then those beside for derivatives.

    Attributes
    ----------
    of, column : array of int, shape (places,)
        Number of the request; 0 for its own place, else 1 + the component that differs.
    first : array of int, shape (requests,)
        Number of the own place of each request.
    sought : array of int
        Numbers of the requests with derivatives.
    steps : array, shape (requests, states + 2)
        Differences of the components.
    places : array, shape (places, states + 2)
        The places.
    """

    of: Integers
    column: Integers
    first: Integers
    sought: Integers
    steps: Floats
    places: Floats

    @classmethod
    def around(cls, requests: Sequence[Passing]) -> "_Places":
        """Return the places of some requests."""
        own = np.array([one.place for one in requests])
        differentiated = np.array([one.differentiated for one in requests])
        counts = np.where(differentiated, 1 + own.shape[1], 1)
        first = np.cumsum(counts) - counts
        of = np.repeat(np.arange(len(own)), counts)
        column = np.arange(of.size) - first[of]
        shares = np.clip(own[:, -PARAMETERS:], 0.0, 1.0)
        steps = np.full(own.shape, STATE_DIFFERENCE)
        steps[:, -PARAMETERS:] = np.where(shares < 0.5, DIFFERENCE, -DIFFERENCE)
        places = own[of]
        (beside,) = np.nonzero(column)
        which, by = of[beside], column[beside] - 1
        places[beside, -PARAMETERS:] = shares[which]
        places[beside, by] += steps[which, by]
        return cls(of, column, first, np.flatnonzero(differentiated), steps, places)

    @property
    def beside(self) -> Integers:
        """Numbers of the places beside, (requests with derivatives, states + 2)."""
        return np.asarray(self.first[self.sought, np.newaxis] + 1 + np.arange(self.steps.shape[1]))


class _Orbits(NamedTuple):
    """Orbits from places.

    ``defect`` (places, states); ``monodromy`` (places, states, states), NaN where it is not needed;
    ``section`` (places, mesh periods, states); ``beyond`` and ``phase`` (places,).
    """

    defect: Floats
    monodromy: Floats
    section: Floats
    beyond: Floats
    phase: Floats
    repeats: int


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
    around = _Places.around(requests)
    orbits = _integrated(requests, around)
    first = around.first
    values = _tests(requests, around, orbits)
    slopes = _slopes(requests, around, orbits, values)
    defect = np.concatenate([orbits.defect[first], values[first, np.newaxis]], axis=1)
    steps = _steps(requests, slopes, defect)
    monodromy = orbits.monodromy[first]
    multipliers, (left, right) = multipliers_of(monodromy), _vectors(requests, monodromy)
    repeats = orbits.repeats
    whole = [one.equations.plan.recorded_periods // repeats for one in requests]
    every = orbits.section[first][:, repeats - 1 :: repeats]
    return [
        Passed(*one)
        for one in zip(
            defect,
            slopes,
            steps,
            monodromy,
            multipliers,
            left,
            right,
            [section[-periods:] for section, periods in zip(every, whole, strict=True)],
            orbits.beyond[first].tolist(),
            orbits.phase[first].tolist(),
            strict=True,
        )
    ]


def _integrated(requests: Sequence[Passing], around: _Places) -> _Orbits:
    """Integrate the lanes of all places over their periods."""
    equations, places, of = requests[0].equations, around.places, around.of
    scale = np.array([one.equations.scale for one in requests])[of]
    periods = np.array([one.equations.plan.recorded_periods for one in requests])
    states = scale.shape[1]
    # A grazing is differentiated without the tangent flow of the displaced orbits.
    grazing = np.array([one.equations.kind == GRAZING for one in requests])
    lanes = _Lanes.of((around.column == 0) | ~grazing[of], states)
    of_places = equations.system_at(np.clip(places[:, states:], 0.0, 1.0))
    longest = int(periods.max())
    plan = equations.plan._replace(recorded_periods=longest, section_points=longest)
    outcome = integrate(
        of_places.of(lanes.places),
        (places[:, :states] * scale)[lanes.places],
        plan,
        tangent_start=lanes.tangents,
        periods=periods[of[lanes.places]] if np.ptp(periods) else None,
    )
    section = outcome.section[lanes.first]
    defect = section[:, -1] / scale - places[:, :states]
    monodromy = _monodromies(outcome, lanes, scale)
    beyond = phase = np.full(len(places), np.nan)
    if plan.history_periods:
        flanks = np.array([one.equations.flank for one in requests])[of]
        references = [one.reference for one in requests]
        wanted = np.array([np.nan if one is None else one.phase for one in references])[of]
        history = outcome.history[lanes.first]
        beyond, phase = nearest_extremes(of_places, plan, history, flanks, wanted)
    return _Orbits(defect, monodromy, section, beyond, phase, of_places.repeats_after)


def _numbers_by_kind(requests: Sequence[Passing]) -> dict[str, list[int]]:
    """Return the numbers of the requests of each kind of boundary."""
    found: dict[str, list[int]] = {}
    for number, one in enumerate(requests):
        found.setdefault(one.equations.kind, []).append(number)
    return found


def _tests(requests: Sequence[Passing], around: _Places, orbits: _Orbits) -> Floats:
    """Return the test functions of all places, (places,); NaN without a reference."""
    values = np.full(around.of.size, np.nan)
    for kind, numbers in _numbers_by_kind(requests).items():
        of_kind = np.zeros(len(requests), dtype=bool)
        of_kind[[one for one in numbers if requests[one].reference is not None]] = True
        (places,) = np.nonzero(of_kind[around.of])
        if kind == GRAZING:
            values[places] = orbits.beyond[places]
        elif places.size:
            references = [
                requests[one].reference or Reference() for one in around.of[places].tolist()
            ]
            values[places] = tests_of(kind, orbits.monodromy[places], references)
    return values


def _slopes(
    requests: Sequence[Passing], around: _Places, orbits: _Orbits, values: Floats
) -> Floats:
    """Return the derivatives of the equations, (requests, states + 1, states + 2)."""
    count, size = around.steps.shape
    states = size - PARAMETERS
    slopes = np.full((count, size - 1, size), np.nan)
    for number, one in enumerate(requests):
        if one.slopes is not None:
            slopes[number] = one.slopes
    sought, beside = around.sought, around.beside
    own, steps = around.first[sought], around.steps[sought]
    slopes[sought, :states, :states] = orbits.monodromy[own] - np.eye(states)
    shifted = orbits.defect[beside[:, states:]] - orbits.defect[own, np.newaxis]
    by_shares = shifted / steps[:, states:, np.newaxis]
    slopes[sought, :states, states:] = by_shares.transpose(0, 2, 1)
    slopes[sought, -1] = (values[beside] - values[own, np.newaxis]) / steps
    return slopes


def _steps(requests: Sequence[Passing], slopes: Floats, defect: Floats) -> Floats:
    """Return steps of Newton's method in planes, (requests, states + 2); NaN if there is none."""
    count, equations, size = slopes.shape
    steps = np.full((count, size), np.nan)
    usable = np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(defect).all(axis=1)
    (numbers,) = np.nonzero(usable)
    if numbers.size:
        bordered = np.zeros((numbers.size, size, size))
        bordered[:, :equations] = slopes[numbers]
        bordered[:, -1] = [requests[number].direction for number in numbers.tolist()]
        sides = np.zeros((numbers.size, size, 1))
        sides[:, :equations, 0] = defect[numbers]
        steps[numbers] = -solved(bordered, sides)[..., 0]
    return steps


def _vectors(requests: Sequence[Passing], monodromy: Floats) -> tuple[Floats, Floats]:
    """Return left and right null vectors of all requests, (requests, states); NaN without them."""
    left, right = np.full((2, *monodromy.shape[:2]), np.nan)
    for kind, numbers in _numbers_by_kind(requests).items():
        if kind in CRITICAL:
            left[numbers], right[numbers] = null_vectors(kind, monodromy[numbers])
    return left, right


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
