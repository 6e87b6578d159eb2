"""The lanes that a figure shows, and the drawing of more points than a page can resolve."""

from collections.abc import Iterator
from math import ceil, floor
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import allow_rasterization
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.errors import FigureError
from gearchaos.outputs.names import STATUS, UNSWEPT
from gearchaos.results.reading.result import Result

Between = tuple[float | None, float | None]

PAD = 0.05  # Margin of an axis with a single value, relative to the value.
COLUMNS = 4000  # Columns that a page can resolve: two journal columns at 600 dpi.

MOST_DOTS = 1 << 18
"""Most points drawn one by one: about the pixels of a one-column panel at 300 dpi."""


class ShownLanes(NamedTuple):
    """Lanes in ascending order of the swept parameter, and the ends of its axis.

    Attributes
    ----------
    numbers : (lanes,)
        Numbers among all lanes of the result, its axes flattened.
    parameter : (lanes,)
        Swept value.
    diverged : (lanes,)
        Whether the status differs from 0.
    limits : (float, float)
        Ends of the axis.
    """

    numbers: Integers
    parameter: Floats
    diverged: Mask
    limits: tuple[float, float]

    def dot_size(self, least: float) -> float:
        """Choose the diameter of dots in points; few swept values have larger dots."""
        return float(np.clip(150.0 / np.unique(self.parameter).size, least, 3.0))


def swept_axes(result: Result) -> list[str]:
    """Return the axes of a result that are swept parameters."""
    return [axis for axis in result.axes if axis not in UNSWEPT]


def diagram_lanes(result: Result, between: Between = (None, None)) -> ShownLanes:
    """Select the lanes of a diagram, in ascending order of its swept parameter.

    Parameters
    ----------
    result : Result
        A result over one swept parameter.
    between : (float or None, float or None)
        Lowest and highest swept value, both included; None is the end of the sweep.

    Raises
    ------
    FigureError
        If no lane is in the range, or there are two swept parameters.
    """
    swept = swept_axes(result)
    if len(swept) > 1:
        raise FigureError(
            f"the result runs over {' and '.join(swept)}; a diagram shows one of them; choose a "
            f"value of the other with --at NAME=VALUE, such as --at {swept[0]}="
            f"{result[swept[0]][0]:g} (in Python: result.sel)"
        )
    return select_lanes(result, between)


def map_axes(result: Result) -> tuple[str, str]:
    """Return the names of the axes along x and y of a map.

    Raises
    ------
    FigureError
        If the axes of the result are not exactly two swept parameters.
    """
    swept = swept_axes(result)
    if len(swept) != 2:
        raise FigureError(
            f"a map shows two swept parameters; the result has {', '.join(swept) or 'none'}"
        )
    if more := [axis for axis in result.axes if axis not in swept]:
        where = " ".join(f"--at {axis}={result[axis][0]:g}" for axis in more)
        raise FigureError(
            f"the result has several lanes for each pair of values, along {' and '.join(more)}; a "
            f"map shows one of them; choose it, such as with {where} (in Python: result.sel)"
        )
    return swept[1], swept[0]


def select_lanes(result: Result, between: Between = (None, None)) -> ShownLanes:
    """Select lanes by `Result.axis`, the parameter along x, in ascending order.

    Parameters
    ----------
    result : Result
        A result with at least one swept parameter.
    between : (float or None, float or None)
        Lowest and highest swept value, both included; None is the end of the sweep.

    Raises
    ------
    FigureError
        If no lane is in the range.
    """
    parameter = np.asarray(result.along(result.axis), dtype=np.float64)
    low, high = between
    least, most = -np.inf if low is None else low, np.inf if high is None else high
    chosen = (parameter >= least) & (parameter <= most)
    if not chosen.any():
        ends = zip(("from", "to"), between, strict=True)
        wanted = " ".join(f"{word} {end:g}" for word, end in ends if end is not None)
        there = f"{parameter.min():g} to {parameter.max():g}"
        raise FigureError(f"no lane with {result.axis} {wanted}; the result has {there}")
    numbers = np.flatnonzero(chosen)
    numbers = numbers[np.argsort(parameter[numbers], kind="stable")]
    parameter = parameter[numbers]
    diverged = result.lanes(STATUS)[numbers] != 0
    # Half a lane of margin: the outermost lanes would lie under the frame.
    half = float(parameter[-1] - parameter[0]) / (2 * max(1, np.unique(parameter).size - 1))
    left = float(parameter[0]) - half if low is None else low
    right = float(parameter[-1]) + half if high is None else high
    if left >= right:
        pad = abs(left) * PAD or 0.5
        left, right = left - pad, right + pad
    return ShownLanes(numbers, parameter, diverged, (left, right))


def cell_edges(values: Floats) -> Floats:
    """Return the edges of cells around ascending values, halfway between them, (values + 1,)."""
    if values.size == 1:
        pad = abs(float(values[0])) * PAD or 0.5
        return np.array([values[0] - pad, values[0] + pad])
    halfway = (values[1:] + values[:-1]) / 2.0
    outermost = 2.0 * values[[0, -1]] - halfway[[0, -1]]
    return np.concatenate([outermost[:1], halfway, outermost[1:]])


def columns(parameter: Floats, limits: tuple[float, float]) -> Integers:
    """Return the index of the first value in each of the `COLUMNS` of an axis.

    ``parameter`` (values,) ascends. Up to two values per column, each begins its own column.
    """
    if parameter.size <= 2 * COLUMNS:
        return np.arange(parameter.size)
    number = np.floor((parameter - limits[0]) / (limits[1] - limits[0]) * COLUMNS)
    return np.flatnonzero(np.diff(number, prepend=-1.0))


def outermost(lanes: ShownLanes, values: Floats) -> Integers:
    """Return the lanes with the lowest or highest value of their column; of a gap, the first."""
    first = columns(lanes.parameter, lanes.limits)
    sizes = np.diff(first, append=values.size)
    low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
    shown = (values == np.repeat(low, sizes)) | (values == np.repeat(high, sizes))
    shown[first[np.isnan(low)]] = True
    return np.flatnonzero(shown)


def dots(axes: Axes, lanes: ShownLanes, rows: Floats, **look: Any) -> Line2D:
    """Draw the points of lanes as dots; diverged lanes are left out.

    Up to `MOST_DOTS` points are markers of a line; more are `DenseDots`, which look the same.
    ``rows``: (all lanes of the result, points); ``look``: properties of the line.
    """
    look = {"linestyle": "none", "marker": ".", **look, "markeredgewidth": 0.0}
    if lanes.numbers.size * rows.shape[1] > MOST_DOTS:
        return axes.add_line(DenseDots(lanes, rows, **look))
    values = next(portions(lanes, rows))[1]
    finite = np.isfinite(values)
    x = np.broadcast_to(lanes.parameter[:, np.newaxis], values.shape)
    return axes.plot(x[finite], values[finite], **look)[0]


def portions(lanes: ShownLanes, rows: Floats) -> Iterator[tuple[slice, Floats]]:
    """Yield slices of the lanes and their rows, at most `MOST_DOTS` points at once.

    Infinite values and the rows of diverged lanes become NaN.
    """
    step = max(1, MOST_DOTS // max(1, rows.shape[1]))
    for first in range(0, lanes.numbers.size, step):
        part = slice(first, first + step)
        values = rows[lanes.numbers[part]]
        values[lanes.diverged[part]] = np.nan
        values[np.isinf(values)] = np.nan
        yield part, values


class DenseDots(Line2D):
    """Dots that are counted per pixel and drawn as one image.

    Agg draws each dot as the same small picture on whole pixels. With opacity a per dot, n dots let
    (1 - a)^n of the background through. The image has the colours that the single dots would
    give, while memory and drawing time hardly depend on their number.
    """

    def __init__(self, lanes: ShownLanes, rows: Floats, **look: Any) -> None:
        super().__init__([], [], **look | {"rasterized": True})
        self._points = lanes, rows

    @allow_rasterization  # type: ignore[untyped-decorator]
    def draw(self, renderer: Any) -> None:
        """Draw the image of the dots."""
        assert isinstance(self.axes, Axes)
        dot = self._dot(renderer)
        ends = dot.shape[0] - 1
        left, bottom = (floor(edge) for edge in self.axes.bbox.min)
        counted = counts(self.axes, *self._points, ends // 2)
        height, width = (size - ends for size in counted.shape)
        clear = np.zeros((height, width), np.float32)
        for row, column in np.argwhere(dot > 0.0):
            beside = counted[ends - row :, ends - column :][:height, :width]
            clear += np.float32(np.log1p(-dot[row, column])) * beside.astype(np.float32)
        image = np.empty((height, width, 4), np.uint8)
        image[..., :3] = [round(255.0 * part) for part in to_rgb(self.get_color())]
        image[..., 3] = np.round(-255.0 * np.expm1(clear))
        gc = renderer.new_gc()
        gc.set_clip_rectangle(self.axes.bbox)
        renderer.draw_image(gc, left, bottom, image)
        gc.restore()

    def _dot(self, renderer: Any) -> Floats:
        """Draw a single dot; return the opacity of the pixels around it, bottom row first."""
        reach = ceil(renderer.points_to_pixels(self.get_markersize()) / 2.0) + 1
        size = 2 * reach + 1
        paper: Any = RendererAgg(size, size, 72.0 * renderer.points_to_pixels(1.0))  # type: ignore[no-untyped-call]
        dot = Line2D([reach], [reach])
        dot.update_from(self)
        dot.set(transform=IdentityTransform(), clip_on=False, alpha=1.0)
        dot.draw(paper)
        alpha = self.get_alpha() or 1.0
        return np.asarray(paper.buffer_rgba())[::-1, :, 3] * min(alpha, 1.0 - 1e-6) / 255.0


def counts(axes: Axes, lanes: ShownLanes, rows: Floats, margin: int = 0) -> NDArray[np.uint32]:
    """Count the points in each pixel of the axes and of a margin around them.

    Returns shape (rows, columns) of pixels, bottom row first. Points count for the pixel on which
    Agg would place their marker.
    """
    box = axes.bbox
    left, bottom = floor(box.x0) - margin, floor(box.y0) - margin
    width, height = ceil(box.x1) + margin - left, ceil(box.y1) + margin - bottom
    counted = np.zeros(height * width, np.intp)
    # Axis by axis, since the axes are independent: half the work of transforming each point.
    (along, _, begin), (_, up, bottom_edge), _ = (axes.transLimits + axes.transAxes).get_matrix()
    x = along * axes.xaxis.get_transform().transform(lanes.parameter) + begin
    columns = np.floor(x + 0.5) - left
    for part, values in portions(lanes, rows):
        y = up * axes.yaxis.get_transform().transform(values) + bottom_edge
        row = np.ceil(y - 0.5) - bottom
        column = np.broadcast_to(columns[part, np.newaxis], row.shape)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        pixel = row[inside].astype(np.intp) * width + column[inside].astype(np.intp)
        counted += np.bincount(pixel, minlength=counted.size)
    return counted.astype(np.uint32).reshape(height, width)
