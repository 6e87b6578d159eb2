"""Branches or boundaries over an interactive chart: lines, markers with texts, and a legend."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, GlyphRenderer, HoverTool, Line, Scatter
from matplotlib.colors import to_hex

from gearchaos.arrays import Array, Floats
from gearchaos.errors import FigureError
from gearchaos.explorer.starts import start_grid
from gearchaos.figures.boundaries import boundary_overlay
from gearchaos.figures.branches import branch_overlay, checked_variable
from gearchaos.figures.lanes import map_axes, swept_axes
from gearchaos.figures.overlaid_files import (
    boundaries_over,
    branches_over,
    draws_alone,
    of_map,
    refuse_boundaries_of_diagram,
)
from gearchaos.figures.overlay import OverlaidLine, Overlay
from gearchaos.results.files.boundary_file import BoundarySet
from gearchaos.results.files.branch_file import BranchSet
from gearchaos.results.reading.result import Result

PIXELS = 2.0
"""Pixels of a line for each point of its width in print; a screen is farther away than paper."""

MARKER_PIXELS = 6.0

BOKEH_MARKERS = {
    "o": "circle",
    "s": "square",
    "D": "diamond",
    "d": "diamond",
    "x": "x",
    "*": "star",
    "^": "triangle",
    "v": "inverted_triangle",
    "<": "hex",
    "X": "square_x",
    "P": "plus",
}
"""Names in Bokeh of the markers of matplotlib; one that Bokeh lacks has another shape."""

SIGNS = {
    "circle": "\N{WHITE CIRCLE}",
    "square": "\N{WHITE SQUARE}",
    "diamond": "\N{WHITE DIAMOND}",
    "x": "\N{MULTIPLICATION X}",
    "star": "\N{WHITE STAR}",
    "triangle": "\N{WHITE UP-POINTING TRIANGLE}",
    "inverted_triangle": "\N{WHITE DOWN-POINTING TRIANGLE}",
    "hex": "\N{WHITE HEXAGON}",
    "square_x": "\N{SQUARED TIMES}",
    "plus": "+",
}
"""Characters of the legend that look like the markers."""

TEXT = "<div style='max-width: 320px; white-space: normal'>@text</div>"
"""Text at a special point; Bokeh escapes what it inserts."""


class Overlaid(NamedTuple):
    """A file of branches or boundaries to draw over the chart of a result.

    Attributes
    ----------
    option : str
        The option that names the file: ``"branches"`` or ``"boundaries"``.
    path : str
        The file.
    content : BranchSet or BoundarySet
        What it holds.
    """

    option: str
    path: str
    content: BranchSet | BoundarySet

    def over(self, result: Result, variable: str) -> Overlay:
        """Return the lines and the points for a chart of a variable.

        Raises FigureError, with a remedy, if they cannot be drawn into this chart.
        """
        if isinstance(self.content, BoundarySet):
            return boundary_overlay(self.content, map_axes(result))
        return branch_overlay(self.content, checked_variable(self.content, variable))


def read_overlaid(
    result: Result, source: str, given: Sequence[str | None], units: str | None
) -> Overlaid | None:
    """Read the file of ``--branches`` or ``--boundaries``, the two that may be given.

    ``source``: file of the result. Raises FigureError if they do not belong together.
    """
    branches, boundaries = given
    if not (branches or boundaries):
        return None
    grid = start_grid(result, source) is not None
    swept = swept_axes(result)
    if branches and (grid or len(swept) > 1):
        page = "a grid of starts" if grid else of_map(swept[0])
        raise FigureError(f"--branches: {draws_alone('have it', page)}")
    if boundaries and (grid or len(swept) == 1):
        refuse_boundaries_of_diagram(boundaries)
    if branches:
        found = branches_over(branches, [result], source, units=units)
        return Overlaid("branches", branches, found)
    assert boundaries
    return Overlaid("boundaries", boundaries, boundaries_over(boundaries, result, units))


def glyphs(over: Overlay, most: int | None = None) -> list[GlyphRenderer]:
    """Return the lines and the markers for a chart of Bokeh, lines first.

    ``most``: number of values of all lines above which they are thinned out and shortened to
    float32.
    """
    drawn = []
    size = sum(one.y.size for one in over.lines)
    every = 1 if most is None else max(1, -(-2 * size // most))
    for kind in over.kinds:
        lines = [one for one in over.lines if one.kind == kind]
        if lines:
            x, y = _joined(lines, every)
            if most is not None:
                x, y = x.astype(np.float32), y.astype(np.float32)
            source = ColumnDataSource({"x": x, "y": y})
            look = _line_look(lines[0].look)
            drawn.append(GlyphRenderer(data_source=source, glyph=Line(x="x", y="y", **look)))
    return drawn + _markers(over)


def _joined(lines: Iterable[OverlaidLine], every: int) -> tuple[Floats, Floats]:
    """Join lines to one with gaps of NaN; of each, every n-th point and both ends are kept."""
    parts: list[Array] = []
    for one in lines:
        kept = np.unique([*range(0, one.x.size, every), one.x.size - 1])
        for row in one.y.T:
            parts += [np.stack([one.x[kept], row[kept]]), np.full((2, 1), np.nan)]
    x, y = np.concatenate(parts, axis=1)
    return x, y


def _line_look(look: dict[str, Any]) -> dict[str, Any]:
    """Return colour, width and dashes of a line for Bokeh."""
    width, style = PIXELS * look["linewidth"], look["linestyle"]
    dashes = [] if style == "-" else [max(1, round(PIXELS * one)) for one in style[1]]
    return {"line_color": to_hex(look["color"]), "line_width": width, "line_dash": dashes}


def _markers(over: Overlay) -> list[GlyphRenderer]:
    """Return the markers of each kind of special point."""
    drawn = []
    for kind in over.kinds:
        points = [one for one in over.points if one.kind == kind]
        if not points:
            continue
        data: dict[str, Any] = {
            "x": np.concatenate([np.full(one.y.size, one.x) for one in points]),
            "y": np.concatenate([one.y for one in points]),
            "text": [one.text for one in points for _ in range(one.y.size)],
        }
        look = points[0].look
        shape = {"marker": BOKEH_MARKERS[look["marker"]], "size": MARKER_PIXELS}
        shape |= {"line_color": to_hex(look["color"]), "line_width": 1.2, "fill_color": "white"}
        glyph = Scatter(x="x", y="y", **shape)
        drawn.append(GlyphRenderer(data_source=ColumnDataSource(data), glyph=glyph))
    return drawn


def hover(drawn: Iterable[GlyphRenderer]) -> HoverTool:
    """Return the tool that shows the texts of markers."""
    marked = [one for one in drawn if isinstance(one.glyph, Scatter)]
    return HoverTool(renderers=marked, tooltips=TEXT, description="Special points")


def legend(over: Overlay) -> str:
    """Return the legend as HTML."""
    looks = {one.kind: one.look for one in over.points}
    looks |= {one.kind: one.look for one in over.lines}
    return " &emsp;".join(f"{_sign(looks[kind])} {escape(kind)}" for kind in over.kinds)


def _sign(look: dict[str, Any]) -> str:
    """Return a picture of a line or a marker as HTML."""
    colour = to_hex(look["color"])
    if "marker" in look:
        sign = SIGNS[BOKEH_MARKERS[look["marker"]]]
        return f"<span style='color:{colour}'>{sign}</span>"
    line = _line_look(look)
    dashes = ",".join(map(str, line["line_dash"]))
    return (
        "<svg width='30' height='8'><line x1='0' y1='4' x2='30' y2='4' "
        f"stroke='{colour}' stroke-width='2' stroke-dasharray='{dashes}'/></svg>"
    )
