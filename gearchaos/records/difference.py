"""The difference between the motions of the same lanes on two grids."""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Codes, Counts, Floats, Mask
from gearchaos.records.label import UNRESOLVED
from gearchaos.records.period import section_distance

MOST = 0.95
"""Share of the lanes covered by `bound`: the others lie next to a bifurcation."""

_ANOTHER_ORBIT = 0.1
"""Distance, relative to the size of the orbit, above which two orbits are different."""


class Solution(NamedTuple):
    """The motions of some lanes on one grid.

    Attributes
    ----------
    section : array, shape (lanes, points, states)
        Section.
    exponent : array, shape (lanes,)
        Largest exponent, NaN where there is none.
    diverged : array of bool, shape (lanes,)
        Lanes that diverged.
    motion : array of int, shape (lanes,)
        Label, see `records.label`.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where the motion is not periodic.
    transient : array, shape (lanes,), or float
        Distance between section and periodic orbit; a second grid does not show it.
    hidden : array, shape (lanes,), or float
        Error of the exponent from modes that both grids damp.
    section_rounding, exponent_rounding : array, shape (lanes,), or float
        Rounding errors of both.
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
    """The differences between two grids.

    Attributes
    ----------
    period : array of int, shape (lanes,)
        Common period, 0 where there is none.
    section_error : array, shape (lanes,)
        Largest difference of the sections, at least the rounding error, plus the transient of the
        first grid; NaN where the period is 0 or the transient unknown.
    exponent_error : array, shape (lanes,)
        Difference of the largest Lyapunov exponents, at least the hidden and the rounding error;
        NaN where a lane diverged or no exponent was computed.
    changed : array of bool, shape (lanes,)
        Whether the lane settles on a different motion.
    """

    period: Counts
    section_error: Floats
    exponent_error: Floats
    changed: Mask


def difference(one: Solution, other: Solution) -> Difference:
    """Compare two solutions lane by lane; the errors are those of the first solution.

    A lane has changed if its period differs, if both motions are known and differ, or if it
    diverged in one solution only. It has also changed if the orbits of equal period lie further
    apart than a tenth of their size: they are then two attractors, and their distance is not an
    error.
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
