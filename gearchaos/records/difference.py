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

    What another grid does not show, (lanes,) or one number for all: ``transient``, how far the
    section is from the periodic orbit that it approaches; ``hidden``, the error of the exponent
    from modes that both grids damp away; ``section_rounding`` and ``exponent_rounding``, what
    rounding makes of both.
    """

    section: Floats
    exponent: Floats
    diverged: Mask
    motion: Codes
    period: Counts
    transient: Floats | float = 0.0
    hidden: Floats | float = 0.0
    section_rounding: Floats | float = 0.0
    exponent_rounding: Floats | float = 0.0


class Difference(NamedTuple):
    """How far two grids lie apart, by lane.

    ``period`` (lanes,): common period in mesh periods, 0 where the two have none in common;
    ``section_error`` (lanes,): largest difference of the sections, not below rounding, and the
    transient of the first one added, NaN where the period is 0 or the transient unknown;
    ``exponent_error`` (lanes,): difference of the largest Lyapunov exponents, not below what is
    hidden nor below rounding, NaN where a lane diverged or no exponent was computed; ``changed``
    (lanes,): whether the lane moves in another way.
    """

    period: Counts
    section_error: Floats
    exponent_error: Floats
    changed: Mask


def difference(one: Solution, other: Solution) -> Difference:
    """Compare two solutions lane by lane; the errors are those of the first one.

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
    labelled = (one.motion != UNRESOLVED) & (other.motion != UNRESOLVED)
    exponent = np.abs(one.exponent - other.exponent)
    return Difference(
        period,
        np.where(period > 0, np.maximum(distance, one.section_rounding) + one.transient, np.nan),
        np.maximum(np.maximum(exponent, one.hidden), one.exponent_rounding),
        (first != second)
        | apart
        | (labelled & (one.motion != other.motion))
        | (one.diverged != other.diverged),
    )


def bound(errors: Floats) -> float:
    """Return the error that 95 % of the lanes do not exceed; NaN where there are no lanes."""
    known = errors[np.isfinite(errors)]
    return float(np.quantile(known, MOST, method="higher")) if known.size else float("nan")
