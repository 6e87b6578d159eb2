"""Basin entropy: how uncertain the attractor is to which a start leads (Daza et al. 2016)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

BOX = 5
"""Starts along each side of a box."""


class BasinEntropy(NamedTuple):
    """Entropy of the boxes that cover a region, and of those on the boundary of basins alone."""

    basin: float
    boundary: float


def basin_entropy(attractors: NDArray[np.integer], box: int = BOX) -> BasinEntropy:
    r"""Return the basin entropy and the boundary basin entropy of starts on a grid.

    The grid is cut into boxes with ``box`` starts along each side; in each, with p_ij the share of
    starts that lead to attractor j::

        S_i = -sum_j p_ij ln p_ij,   S_b = sum_i S_i / N,   S_bb = sum_i S_i / N_b

    over all N boxes, and over those N_b that hold several attractors (0 where none does). S_b is 0
    where one attractor is all there is, at most ln of their number; S_bb > ln 2 shows a fractal
    boundary. What is left of the grid beyond whole boxes does not count. ``attractors``: a number
    for each start, of one dimension or several; not a number where the grid holds no box. (Daza,
    Wagemakers, Georgeot, Guery-Odelin, Sanjuan 2016.)
    """
    whole = attractors[tuple(slice(size // box * box) for size in attractors.shape)]
    cut = whole.reshape([part for size in whole.shape for part in (size // box, box)])
    boxes = cut.transpose([*range(0, cut.ndim, 2), *range(1, cut.ndim, 2)])
    boxes = boxes.reshape(-1, box**attractors.ndim)
    if not len(boxes):
        return BasinEntropy(np.nan, np.nan)
    share = np.stack([np.mean(boxes == one, axis=1) for one in np.unique(boxes)])
    entropy = -np.sum(share * np.log(np.where(share > 0.0, share, 1.0)), axis=0)
    several = np.count_nonzero(entropy)
    return BasinEntropy(float(entropy.mean()), float(entropy.sum() / max(several, 1)))
