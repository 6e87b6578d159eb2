"""Basins of attraction: what a sweep from several starts has come to at each value."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.results.result import Result

Floats = NDArray[np.float64]

BOX = 5
"""Starts along each side of a box of which `basin_entropy` asks how mixed it is."""


class Basin(NamedTuple):
    """The starts that lead to one attractor at one value of the parameter, or to none.

    ``number`` of the attractor, the same at all values, minus the code of the motion where there is
    none; ``motion``: such as "period 2", "chaotic" or "diverged"; ``multiplier``: largest modulus
    of the Floquet multipliers, not a number where the motion is not periodic; ``exponent``: largest
    Lyapunov exponent, that of the orbit or a mean over the starts; ``starts``: how many, with their
    share and its confidence interval; ``means`` of other variables of the result over these starts;
    ``section`` (points, states): its points, once an excitation period.
    """

    value: float
    number: int
    motion: str
    period: int
    multiplier: float
    exponent: float
    starts: int
    share: float
    share_95_percent: tuple[float, float]
    means: dict[str, float]
    section: Floats


class Basins(NamedTuple):
    """All basins of a result.

    ``parameter``: name of the axis of the ``values`` (values,); ``numbers`` (values, starts) of the
    basin that each start is in; ``grid``: start values by state where the starts are a grid, in C
    order; ``entropy`` of every value, see `basin_entropy`, none without a grid.
    """

    result: Result
    parameter: str
    values: Floats
    numbers: NDArray[np.intp]
    basins: list[Basin]
    grid: dict[str, Floats]
    entropy: list[tuple[float, float]]


def basin_entropy(attractors: NDArray[np.integer], box: int = BOX) -> tuple[float, float]:
    r"""Return the basin entropy of starts on a grid, and that of the boundary of basins alone.

    The grid is cut into boxes with ``box`` starts along each side; in each, with p_ij the share of
    starts that lead to attractor j::

        S_i = -sum_j p_ij ln p_ij,   S_b = sum_i S_i / N,   S_bb = sum_i S_i / N_b

    over all N boxes, and over those N_b that hold several attractors (0 where none does). What is
    left of the grid beyond whole boxes does not count. ``attractors``: a number for each start, of
    one dimension or several; not a number where the grid holds no box. (Daza, Wagemakers, Georgeot,
    Guery-Odelin, Sanjuan 2016.)
    """
    whole = attractors[tuple(slice(size // box * box) for size in attractors.shape)]
    if not whole.size:
        return np.nan, np.nan
    cut = whole.reshape([part for size in whole.shape for part in (size // box, box)])
    within = tuple(range(1, cut.ndim, 2))
    share = np.stack([np.mean(cut == one, axis=within) for one in np.unique(whole)])
    entropy = -np.sum(share * np.log(np.where(share > 0.0, share, 1.0)), axis=0)
    return float(entropy.mean()), float(entropy.sum() / max(1, np.count_nonzero(entropy)))
