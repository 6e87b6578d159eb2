"""Dots of lanes: drawn one by one, or counted by pixel where a page cannot tell them apart."""

from collections.abc import Iterator
from math import ceil, floor
from typing import Any

import numpy as np
from matplotlib.artist import allow_rasterization
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from gearchaos.figures.lanes import Floats, Lanes

MOST_DOTS = 1 << 18
"""More points are counted: a panel of one column has about as many pixels at 300 dpi."""


def dots(axes: Axes, lanes: Lanes, rows: Floats, **look: Any) -> Line2D:
    """Draw the points of lanes as dots, those that diverged left out.

    Up to `MOST_DOTS` they are a line without a stroke; more of them look the same, as `DenseDots`.
    ``rows`` (all lanes of the result, points); ``look``: properties of the dots, as of a line.
    """
    look = {"linestyle": "none", "marker": ".", **look, "markeredgewidth": 0.0}
    if lanes.numbers.size * rows.shape[1] > MOST_DOTS:
        return axes.add_line(DenseDots(lanes, rows, **look))
    values = next(portions(lanes, rows))[1]
    finite = np.isfinite(values)
    x = np.broadcast_to(lanes.parameter[:, np.newaxis], values.shape)
    return axes.plot(x[finite], values[finite], **look)[0]


def portions(lanes: Lanes, rows: Floats) -> Iterator[tuple[slice, Floats]]:
    """Give the rows of lanes, at most `MOST_DOTS` points at once.

    Of diverged lanes, and where they are not finite, they are not a number.
    """
    step = max(1, MOST_DOTS // max(1, rows.shape[1]))
    for first in range(0, lanes.numbers.size, step):
        part = slice(first, first + step)
        values = rows[lanes.numbers[part]]
        values[lanes.diverged[part]] = np.nan
        values[np.isinf(values)] = np.nan
        yield part, values


class DenseDots(Line2D):
    """Dots of which only the number in each pixel is kept.

    A dot one by one is the same small picture of some opacity, laid over whole pixels, so that n
    of them leave its n-th power of what shines through. The pixels of the axes so have the colour
    that the dots would give them, in memory and time that hardly depend on their number.
    """

    def __init__(self, lanes: Lanes, rows: Floats, **look: Any) -> None:
        super().__init__([], [], **look | {"rasterized": True})
        self._points = lanes, rows

    @allow_rasterization  # type: ignore[untyped-decorator]
    def draw(self, renderer: Any) -> None:
        """Draw the image of the dots."""
        if not self.get_visible():
            return
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
        """Draw one dot by itself, and give the opacity of the pixels around it, from the bottom."""
        reach = ceil(renderer.points_to_pixels(self.get_markersize()) / 2.0) + 1
        size = 2 * reach + 1
        paper: Any = RendererAgg(size, size, 72.0 * renderer.points_to_pixels(1.0))  # type: ignore[no-untyped-call]
        dot = Line2D([reach], [reach])
        dot.update_from(self)
        dot.set(transform=IdentityTransform(), clip_on=False, alpha=1.0)
        dot.draw(paper)
        alpha = self.get_alpha() or 1.0
        return np.asarray(paper.buffer_rgba())[::-1, :, 3] * min(alpha, 1.0 - 1e-6) / 255.0


def counts(axes: Axes, lanes: Lanes, rows: Floats, margin: int = 0) -> NDArray[np.uint32]:
    """Count the points in each pixel of the axes and of a margin around them, from the bottom.

    Returns an array of shape (rows, columns) of pixels; a point lies in that pixel which a marker
    is placed on.
    """
    box = axes.bbox
    left, bottom = floor(box.x0) - margin, floor(box.y0) - margin
    width, height = ceil(box.x1) + margin - left, ceil(box.y1) + margin - bottom
    counted = np.zeros(height * width, np.intp)
    # Each axis for itself, as those of a diagram are: a point is half the work of a transform.
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
