"""Lines through variables with one number per lane, broken where the motion changes or jumps."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.arrays import Floats, Mask
from gearchaos.figures.lanes import ShownLanes
from gearchaos.outputs.names import LABELS
from gearchaos.results.reading.jumps import jump_sizes
from gearchaos.results.reading.result import Result


def joined(result: Result, lanes: ShownLanes, values: Floats) -> Mask:
    """Return whether a line joins each lane to the next one, shape (lanes - 1,).

    It does if both have one swept value each, the same label of a periodic motion where there are
    labels, and no jump between them.
    """
    known = np.isfinite(values) & ~lanes.diverged
    alike = known[1:] & known[:-1] & (np.diff(lanes.parameter) > 0.0)
    period = known.astype(np.int32)
    if LABELS[0] in result:
        motion, of_label = (result.lanes(name)[lanes.numbers] for name in LABELS)
        period = np.where(of_label > 0, period, 0)
        alike &= (motion[1:] == motion[:-1]) & (of_label[1:] == of_label[:-1]) & (of_label[1:] > 0)
    size = np.max(np.abs(values), where=known, initial=0.0) or 1.0
    jumps = jump_sizes(period, values[:, np.newaxis, np.newaxis] / size)
    return np.asarray(alike & ~(jumps > 0.0))


def draw_line(axes: Axes, lanes: ShownLanes, values: Floats, join: Mask, **look: Any) -> Line2D:
    """Draw and return a line through values (lanes,) with gaps where ``join`` is false."""
    gaps = np.flatnonzero(~join) + 1
    x, y = np.insert(lanes.parameter, gaps, np.nan), np.insert(values, gaps, np.nan)
    return axes.plot(x, y, **look)[0]
