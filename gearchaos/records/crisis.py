"""Crises: a chaotic set that at once fills more of the state space than beside it.

In an interior crisis a chaotic set collides with an unstable orbit and bursts out into what lies
beyond it (Grebogi, Ott, Yorke 1982). Close to it the bursts are rare, so that a section of some
hundred points may miss them: the lane beside the crisis is told from what several lanes visit.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BESIDE = 8
"""Lanes on either side that are compared."""

FEWEST = 3
"""Lanes that there must be on either side, two of them chaotic."""

SMALLEST = 0.15
"""Growth of the extent that counts, relative to the largest one before."""


def grows_at(extent: Floats, chaotic: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the lanes at which the extent of chaotic sections grows at once, in ascending order.

    ``extent`` (lanes,) of the section in one coordinate, in the order of the swept value;
    ``chaotic`` (lanes,). Such a lane is chaotic, and extends by 15 % more than any of the eight
    before it, half of the eight from it on do by something; these are level among themselves, their
    largest extent nearer to the median than to that of the lane. Lanes before it may belong to
    periodic windows.
    """
    found: list[int] = []
    for lane in np.flatnonzero(chaotic):
        before, after = slice(max(0, lane - BESIDE), lane), slice(lane, lane + BESIDE)
        if any(np.sum(chaotic[side]) < 2 or extent[side].size < FEWEST for side in (before, after)):
            continue
        largest, usual = np.nanmax(extent[before]), np.nanmedian(extent[before])
        grown = extent[lane] > (1.0 + SMALLEST) * largest
        lasting = np.nanmedian(extent[after]) > largest
        level = extent[lane] - largest > largest - usual
        # The next lanes may show still more of what the same crisis has opened.
        if grown and lasting and level and not (found and lane - found[-1] < BESIDE):
            found.append(int(lane))
    return np.array(found, dtype=np.intp)
