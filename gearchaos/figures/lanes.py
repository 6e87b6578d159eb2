"""Which lanes of a result a figure shows."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import FigureError
from gearchaos.results.result import Result
from gearchaos.results.variables import STATUS, UNSWEPT

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Between = tuple[float | None, float | None]

PAD = 0.05
"""What is added to either end of an axis of one value, in parts of the value."""

COLUMNS = 4000
"""Columns of an axis that a page can tell apart: two of a journal at 600 dpi."""


class Lanes(NamedTuple):
    """Lanes in ascending order of the swept parameter, and the ends of its axis.

    ``numbers`` (lanes,) among all lanes of the result, its axes flattened; ``parameter`` (lanes,);
    ``diverged`` (lanes,): whether the status is any but 0.
    """

    numbers: NDArray[np.intp]
    parameter: Floats
    diverged: Mask
    limits: tuple[float, float]

    def dot_size(self, least: float) -> float:
        """Choose the size in points of a dot, larger where the parameter has few values."""
        return float(np.clip(150.0 / np.unique(self.parameter).size, least, 3.0))


def swept_axes(result: Result) -> list[str]:
    """Return the axes of a result that are swept parameters."""
    return [axis for axis in result.axes if axis not in UNSWEPT]


def diagram_lanes(result: Result, between: Between = (None, None)) -> Lanes:
    """Select the lanes of a diagram, as `select_lanes`, and refuse two swept parameters."""
    swept = swept_axes(result)
    if len(swept) > 1:
        raise FigureError(
            f"the result runs over {' and '.join(swept)}, of which a diagram shows one; choose a "
            f"value of the other with --at NAME=VALUE, such as --at {swept[0]}="
            f"{result[swept[0]][0]:g} (in Python: result.sel)"
        )
    return select_lanes(result, between)


def map_axes(result: Result) -> tuple[str, str]:
    """Name the axes along x and y of a map; FigureError if the result has others, or too few."""
    swept = swept_axes(result)
    if len(swept) != 2:
        raise FigureError(f"a map shows two swept parameters; the result has {', '.join(swept)}")
    if more := [axis for axis in result.axes if axis not in swept]:
        where = " ".join(f"--at {axis}={result[axis][0]:g}" for axis in more)
        raise FigureError(
            f"the result has several lanes for each pair of values, along {' and '.join(more)}, of "
            f"which a map shows one; choose it, such as with {where} (in Python: result.sel)"
        )
    return swept[1], swept[0]


def select_lanes(result: Result, between: Between = (None, None)) -> Lanes:
    """Select lanes by the swept parameter: its lowest and highest value, both included.

    None: as far as the sweep goes. Raises FigureError if no lane lies in between.
    """
    parameter = np.asarray(result.along(result.axis), dtype=np.float64)
    low, high = between
    least, most = -np.inf if low is None else low, np.inf if high is None else high
    chosen = (parameter >= least) & (parameter <= most)
    if not chosen.any():
        wanted = " to ".join("..." if end is None else f"{end}" for end in between)
        there = f"{parameter.min():g} to {parameter.max():g}"
        raise FigureError(f"no lane with {result.axis} from {wanted}; the result has {there}")
    numbers = np.flatnonzero(chosen)
    numbers = numbers[np.argsort(parameter[numbers], kind="stable")]
    parameter = parameter[numbers]
    diverged = result.lanes(STATUS)[numbers] != 0
    # Half a lane beyond the outermost ones, which would lie under the frame.
    half = float(parameter[-1] - parameter[0]) / (2 * max(1, np.unique(parameter).size - 1))
    left = float(parameter[0]) - half if low is None else low
    right = float(parameter[-1]) + half if high is None else high
    if left >= right:
        pad = abs(left) * PAD or 0.5
        left, right = left - pad, right + pad
    return Lanes(numbers, parameter, diverged, (left, right))


def cell_edges(values: Floats) -> Floats:
    """Return where the cells of ascending values end: halfway between them, shape (values + 1,)."""
    if values.size == 1:
        pad = abs(float(values[0])) * PAD or 0.5
        return np.array([values[0] - pad, values[0] + pad])
    halfway = (values[1:] + values[:-1]) / 2.0
    outermost = 2.0 * values[[0, -1]] - halfway[[0, -1]]
    return np.concatenate([outermost[:1], halfway, outermost[1:]])


def columns(parameter: Floats, limits: tuple[float, float]) -> NDArray[np.intp]:
    """Return where in an ascending parameter each column of an axis begins.

    If there are not several values for each of the `COLUMNS`, every one begins a column.
    """
    if parameter.size <= 2 * COLUMNS:
        return np.arange(parameter.size)
    number = np.floor((parameter - limits[0]) / (limits[1] - limits[0]) * COLUMNS)
    return np.flatnonzero(np.diff(number, prepend=-1.0))


def outermost(lanes: Lanes, values: Floats) -> NDArray[np.intp]:
    """Return which lanes have the lowest or the highest value of their column, or none in a gap."""
    first = columns(lanes.parameter, lanes.limits)
    sizes = np.diff(first, append=values.size)
    low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
    shown = (values == np.repeat(low, sizes)) | (values == np.repeat(high, sizes))
    shown[first[np.isnan(low)]] = True
    return np.flatnonzero(shown)
