"""How far the motions that two grids give for the same lanes lie apart."""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Codes, Counts, Floats, Mask
from gearchaos.records.label import UNRESOLVED
from gearchaos.records.period import section_distance

MOST = 0.95  # Share of the lanes that `bound` speaks for: the rest lies next to a bifurcation.

_ANOTHER_ORBIT = 0.1


class Solution(NamedTuple):
    """What one grid gives for some lanes.

    ``section`` (lanes, points, states), ``exponent`` (lanes,), not a number where there is none,
    ``diverged`` (lanes,), ``motion`` (lanes,) as `records.label` has it, ``period`` (lanes,) in
    mesh periods, 0 where the motion is not periodic.
    """

    section: Floats
    exponent: Floats
    diverged: Mask
    motion: Codes
    period: Counts


class Difference(NamedTuple):
    """How far two grids lie apart, by lane.

    ``period`` (lanes,): common period in mesh periods, 0 where the two have none in common;
    ``section_error`` (lanes,): largest difference of the sections, NaN where the period is 0;
    ``exponent_error`` (lanes,): difference of the largest Lyapunov exponents, NaN where a lane
    diverged or no exponent was computed; ``changed`` (lanes,): whether the lane moves in another
    way.
    """

    period: Counts
    section_error: Floats
    exponent_error: Floats
    changed: Mask


def difference(one: Solution, other: Solution) -> Difference:
    """Compare two solutions lane by lane.

    A lane moves in another way if its period is another one, if its motion is of another kind where
    both are known, if it diverged in one of the two only, or if the orbits of equal period lie
    further apart than a tenth of their size: then they are two attractors, and not one attractor
    and its error.
    """
    first, second = one.period, other.period
    period = np.where(first == second, first, np.int32(0))
    distance = section_distance(one.section, other.section, period)
    size = np.max(np.abs(other.section), axis=(1, 2), initial=0.0)
    apart = distance > _ANOTHER_ORBIT * size
    period[apart] = 0
    told = (one.motion != UNRESOLVED) & (other.motion != UNRESOLVED)
    return Difference(
        period,
        np.where(period > 0, distance, np.nan),
        np.abs(one.exponent - other.exponent),
        (first != second)
        | apart
        | (told & (one.motion != other.motion))
        | (one.diverged != other.diverged),
    )


def bound(errors: Floats) -> float:
    """Return the error that 95 % of the lanes do not exceed; NaN where there are no lanes."""
    known = errors[np.isfinite(errors)]
    return float(np.quantile(known, MOST, method="higher")) if known.size else float("nan")
