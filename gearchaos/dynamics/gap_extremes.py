"""The extremes of gaps along orbits, and how far they lie beyond a flank.

Where an extreme reaches a flank, the orbit grazes it.
"""

import numpy as np
from gearchaos_kernels import Gaps, LaneSystem, Plan, gap_polynomials, gaps_along

from gearchaos.arrays import Floats, Integers


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
    flank, rate = _place_of(gaps, flanks), gaps.rate[:, :, element]
    beyond = about_extremes(gaps, flanks)
    turns = np.isfinite(beyond)
    aside = np.abs(np.arange(turns.shape[1]) + 0.5 - phases[:, np.newaxis])
    aside = np.minimum(aside, turns.shape[1] - aside)
    away = np.where(np.isnan(aside), np.abs(beyond), aside)
    samples = np.argmin(np.where(turns, away, np.inf), axis=1)
    terms = gap_polynomials(system, plan, history, gaps, (samples, element))
    begin, end = (rate[np.arange(samples.size), samples + n] for n in (0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.clip(np.nan_to_num(-(end + begin) / (end - begin)), -1.0, 1.0)
    at = _turning(terms, at)
    beyond = np.polynomial.polynomial.polyval(at, terms.T, tensor=False) - flank
    there = turns.any(axis=1)
    return np.where(there, beyond, np.nan), samples + 0.5 * (at + 1.0)


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
