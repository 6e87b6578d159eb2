"""The extremes of gaps along orbits, and how far they lie beyond a flank.

Where an extreme reaches a flank, the orbit grazes it.
"""

from typing import NamedTuple, Self

import numpy as np
from gearchaos_kernels import (
    METHODS,
    Gaps,
    LaneSystem,
    Plan,
    gap_polynomials,
    gaps_along,
    integrate,
)

from gearchaos.arrays import Floats, Integers, Mask

FINE = 48
"""Fewest steps per period with which all extremes of a gap are searched."""

FINER, FINEST = 8, 3
"""Factor by which steps are shortened where a contact changes before an extreme, and how often."""

MOST_NUMBERS = 4_000_000
"""Largest number of values in the histories of some orbits."""

ALONG_STEP = np.linspace(0.0, 1.0, 9)
"""Shares of the way to an extreme at which gaps of other elements are looked at."""


def fine_steps(steps: int) -> int:
    """Return the least multiple of a number of steps per period that is `FINE` or more."""
    return steps * -(-FINE // steps)


class _Orbits(NamedTuple):
    """Orbits as their states at every step, and their gaps there."""

    system: LaneSystem
    plan: Plan
    history: Floats
    gaps: Gaps

    @classmethod
    def of(cls, system: LaneSystem, plan: Plan, history: Floats) -> Self:
        """Return orbits with their gaps; see `nearest_extremes`."""
        gaps = gaps_along(system, history, plan.steps_per_period)
        return cls(system, plan, history, gaps)

    def terms(self, samples: Integers, element: int) -> Floats:
        """Return polynomials of a gap in steps (lanes,), see `gap_polynomials`."""
        return gap_polynomials(self.system, self.plan, self.history, self.gaps, (samples, element))

    def finer(self, lanes: Integers) -> Self:
        """Return some orbits with shorter steps."""
        plan = self.plan._replace(steps_per_period=FINER * self.plan.steps_per_period)
        system = self.system.of(lanes)
        return self.of(system, plan, integrate(system, self.history[lanes, 0], plan).history)

    def others_change(self, samples: Integers, element: int, at: Floats) -> Mask:
        """Whether another element changes its contact within steps (lanes,) before places in them.

        ``at``: the places, from -1 to 1, (lanes,).
        """
        places = -1.0 + ALONG_STEP[:, np.newaxis] * (at + 1.0)
        changes = np.zeros(samples.size, dtype=bool)
        for other in set(range(self.gaps.value.shape[2])) - {element}:
            terms = self.terms(samples, other)
            values = np.polynomial.polynomial.polyval(places, terms.T, tensor=False)
            clearance = self.gaps.half_clearance[:, other]
            sides = (values > clearance).astype(np.intp) - (values < -clearance)
            changes |= np.any(sides != sides[0], axis=0)
        return changes


def nearest_extremes(
    system: LaneSystem, plan: Plan, history: Floats, flanks: Integers, phases: Floats
) -> tuple[Floats, Floats]:
    """Return how far the extreme of a gap lies beyond a flank, and its phase, (lanes,) each.

    ``flanks`` (lanes,) are those of one element. Of several extremes that is the one nearest to a
    phase in steps; where the phase is NaN, the one nearest to the flank. NaN where the gap has no
    extreme, or where series reach less far than the shortest steps.
    """
    return _nearest(_Orbits.of(system, plan, history), flanks, phases, FINEST)


def _nearest(
    orbits: _Orbits, flanks: Integers, phases: Floats, levels: int
) -> tuple[Floats, Floats]:
    """Return the extremes of `nearest_extremes`.

    The exact polynomial of a step holds until another element changes its contact. Where it does so
    before the extreme, the orbit is integrated with shorter steps, ``levels`` times at most.
    """
    gaps, element = orbits.gaps, int(flanks[0]) // 2
    beyond = about_extremes(gaps, flanks)
    turns = np.isfinite(beyond)
    aside = np.abs(np.arange(turns.shape[1]) + 0.5 - phases[:, np.newaxis])
    aside = np.minimum(aside, turns.shape[1] - aside)
    away = np.where(np.isnan(aside), np.abs(beyond), aside)
    samples = np.argmin(np.where(turns, away, np.inf), axis=1)
    terms = orbits.terms(samples, element)
    begin, end = (gaps.rate[np.arange(samples.size), samples + n, element] for n in (0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.clip(np.nan_to_num(-(end + begin) / (end - begin)), -1.0, 1.0)
    at = _turning(terms, at)
    beyond = np.polynomial.polynomial.polyval(at, terms.T, tensor=False) - _place_of(gaps, flanks)
    there, found = turns.any(axis=1), samples + 0.5 * (at + 1.0)
    # Series are NaN where a step is longer than they reach. RK4 itself looks at the cubic only.
    ends = np.isnan(beyond)
    if METHODS[orbits.plan.method].gap_terms is not None:
        ends |= orbits.others_change(samples, element, at)
    if levels:
        (late,) = np.nonzero(there & ends)
        many = max(MOST_NUMBERS // (FINER * orbits.history[0].size), 1)
        for first in range(0, late.size, many):
            some = late[first : first + many]
            again = _nearest(orbits.finer(some), flanks[some], FINER * phases[some], levels - 1)
            beyond[some], found[some] = again[0], again[1] / FINER
    return np.where(there, beyond, np.nan), found


def about_extremes(gaps: Gaps, flanks: Integers) -> Floats:
    """Return about how far each extreme of a gap lies beyond a flank, (lanes, samples - 1).

    ``flanks`` (lanes,) are those of one element. NaN in steps without an extreme.
    """
    element = int(flanks[0]) // 2
    rate, value = gaps.rate[:, :, element], gaps.value[:, :, element]
    beyond = _extremes(value, rate) - _place_of(gaps, flanks)[:, np.newaxis]
    return np.where(rate[:, :-1] * rate[:, 1:] <= 0.0, beyond, np.nan)


def _place_of(gaps: Gaps, flanks: Integers) -> Floats:
    """Return where flanks (lanes,) of one element are, (lanes,)."""
    clearance: Floats = gaps.half_clearance[:, int(flanks[0]) // 2]
    return np.where(flanks % 2, -1.0, 1.0) * clearance


def _extremes(value: Floats, rate: Floats) -> Floats:
    """Return about where gaps have their extreme within each step, (lanes, samples - 1).

    ``value`` and ``rate`` per step (lanes, samples): those at the ends of steps. It is the cubic
    through them, at the zero of the straight line through both rates.
    """
    begin, end = rate[:, :-1], rate[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.clip(np.nan_to_num(begin / (begin - end)), 0.0, 1.0)
    rise = value[:, 1:] - value[:, :-1]
    cubed = begin + end - 2.0 * rise
    squared = 3.0 * rise - 2.0 * begin - end
    return np.asarray(value[:, :-1] + at * (begin + at * (squared + at * cubed)))


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
