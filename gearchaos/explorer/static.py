"""The diagram or the map of a result as one interactive page, without a server."""

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
from bokeh.embed import file_html
from bokeh.layouts import column
from bokeh.models import Checkbox, ColorBar, CustomJS, Div, LinearColorMapper, Select, Span
from bokeh.plotting import figure
from bokeh.resources import INLINE
from matplotlib.colors import ListedColormap, to_hex
from matplotlib.figure import Figure

from gearchaos.arrays import Array, Floats
from gearchaos.errors import FigureError
from gearchaos.explorer.overlay import Overlaid, glyphs, hover, legend
from gearchaos.explorer.shades import COLOURS, stage_boxes
from gearchaos.explorer.starts import ATTRACTOR
from gearchaos.explorer.text import plain_text
from gearchaos.figures.branches import limits_with
from gearchaos.figures.diagrams import diagram_variables
from gearchaos.figures.ensembles import basin_patches, basins
from gearchaos.figures.labels import axis_label
from gearchaos.figures.lanes import cell_edges, diagram_lanes, map_axes, swept_axes
from gearchaos.figures.maps import parameter_map
from gearchaos.figures.panel import robust_limits
from gearchaos.figures.style import BLACK, GREY, OVERLAID
from gearchaos.outputs.names import LABELS, LARGEST_EXPONENT, UNSWEPT, WAYS
from gearchaos.results.reading.ensembles import Basins
from gearchaos.results.reading.jumps import directions_of
from gearchaos.results.reading.result import Result

LARGEST_PAGE = 5_000_000
"""Most bytes of a page."""

MOST_NUMBERS = 400_000
"""Most numbers that the charts of a page hold at first; each takes 5.3 bytes."""

FINEST = 600  # Most cells along an axis of a map whose values are not evenly spaced.

WIDE: Any = {"sizing_mode": "stretch_width"}
LOOK: Any = {
    **WIDE,
    "min_border_left": 110,
    "tools": "pan,wheel_zoom,box_zoom,hover,reset,save",
    "active_drag": "box_zoom",
    "active_scroll": "wheel_zoom",
}


def static_page(
    result: Result, found: Basins | None = None, overlaid: Overlaid | None = None
) -> str:
    """Return an HTML page with the charts of a sweep or a map and a menu of its variables.

    ``found``: basins of a result over the two states of a grid of starts; they are drawn first.
    ``overlaid``: branches or boundaries over the charts, with a switch that shows or hides them.
    Charts with more numbers than fit are thinned out: of each lane the last section points are
    kept, then every n-th lane or cell.

    Raises
    ------
    FigureError
        If the result cannot be drawn, or the page is too large with very few points.
    """
    numbers = MOST_NUMBERS
    while numbers > 1000:
        page = _page(result, numbers, found, overlaid)
        if len(page.encode()) <= LARGEST_PAGE:
            return page
        numbers //= 2
    raise FigureError(f"the page is larger than {LARGEST_PAGE} bytes; choose a slice with --at")


def _page(result: Result, numbers: int, found: Basins | None, overlaid: Overlaid | None) -> str:
    """Return the page with at most this number of numbers in its charts."""
    of_map = len(swept_axes(result)) > 1
    names = _map_variables(result) if of_map else diagram_variables(result)
    entries = [(name, plain_text(axis_label(result, name, 200))) for name in names]
    entries[:0] = [(ATTRACTOR, ATTRACTOR.capitalize())] if found else []
    names = [name for name, _ in entries]
    charts, ranges, switched = {}, list[Any](), list[Any]()
    for name in names:
        # Half of all numbers are those of the basins.
        most = max(1, numbers // (2 * len(names) if found else len(names)))
        most = numbers // 2 if name == ATTRACTOR else most
        if of_map:
            panel, kinds = _map(result, name, most, found if name == ATTRACTOR else None)
        else:
            panel, kinds = _diagram(result, name, most)
        # All charts move together, whichever is shown.
        panel.x_range = ranges[0] if ranges else panel.x_range
        ranges.append(panel.x_range)
        parts = [panel, _text(_legend(kinds))]
        if overlaid:
            parts.append(_overlay(panel, overlaid, result, name, most, switched))
        charts[name] = column(parts, visible=name == names[0], **WIDE)
    menu = Select(options=entries, value=names[0], title="Variable", width=500)
    show = "for (const [name, one] of Object.entries(charts)) one.visible = name == menu.value"
    menu.js_on_change("value", CustomJS(args={"charts": charts, "menu": menu}, code=show))
    title = _text(f"<b>{escape(str(result.metadata.get('title', '')))}</b>")
    switches = [_switch(overlaid.option, switched)] if overlaid else []
    parts = [title, menu, *switches, *charts.values()]
    if LARGEST_EXPONENT in result and not of_map:
        parts.append(_exponents(result, numbers, ranges[0]))
    return str(file_html(column(parts, **WIDE), INLINE, "gearchaos"))


def _overlay(
    panel: Any, overlaid: Overlaid, result: Result, variable: str, most: int, switched: list[Any]
) -> Div:
    """Draw branches or boundaries into a chart; return their legend, or why there are none.

    All models that the switch shows or hides are appended to ``switched``.
    """
    try:
        over = overlaid.over(result, variable)
    except FigureError as error:
        return _text(escape(str(error)))
    drawn, text = glyphs(over, most), _text(legend(over))
    panel.renderers.extend(drawn)
    panel.add_tools(hover(drawn))
    if len(swept_axes(result)) == 1:
        x, y = panel.x_range, panel.y_range
        y.start, y.end = limits_with(over, (y.start, y.end), (x.start, x.end))
    switched += [*drawn, text]
    return text


def _switch(option: str, switched: list[Any]) -> Checkbox:
    """Return the switch that shows or hides what is drawn over the charts."""
    switch = Checkbox(label=option.capitalize(), active=True)
    show = "for (const one of switched) one.visible = box.active"
    switch.js_on_change("active", CustomJS(args={"switched": switched, "box": switch}, code=show))
    return switch


def _text(markup: str) -> Div:
    return Div(text=markup, disable_math=True, **WIDE)


def _legend(kinds: dict[str, str]) -> str:
    swatch = "<span style='background:{}; border:1px solid; padding:0 .6em'></span> {} &emsp;"
    return "".join(swatch.format(colour, escape(name)) for name, colour in kinds.items())


def _map_variables(result: Result) -> list[str]:
    """Return the variables of a map, the motion first."""
    map_axes(result)  # Raises FigureError if other axes are left.
    names = [name for name in result if result.dims(name) == result.axes]
    return sorted(names, key=lambda name: name != LABELS[0])


def _panel(result: Result, x: str, y: str, height: int, ends: Sequence[Any]) -> Any:
    """Make a chart with labels and limits; ``ends``: limits along x, and along y if known."""
    ranges = dict(zip(("x_range", "y_range"), ends, strict=False))
    panel = figure(height=height, tooltips="$x, $y", **ranges, **LOOK)
    panel.xaxis.axis_label, panel.yaxis.axis_label = (
        plain_text(axis_label(result, name, length)) for name, length in ((x, 80), (y, 26))
    )
    panel.axis.axis_label_text_font_style, panel.toolbar.logo = "normal", None
    return panel


def _diagram(result: Result, variable: str, most: int) -> tuple[Any, dict[str, str]]:
    """Draw a variable over the swept parameter; each direction has a colour."""
    limits = diagram_lanes(result).limits
    boxes, kinds = stage_boxes(result, limits)
    ways = directions_of(result)
    drawn = [_thinned(one, variable, most // 2 // len(ways)) for one in ways]
    values = np.concatenate([y for _, y in drawn]).astype(float)
    ends = robust_limits(values, values) if values.size else (0.0, 1.0)
    panel = _panel(result, result.axis, variable, 360, (limits, ends))
    for box in boxes:
        panel.add_layout(box)
    for (x, y), (colour, _), way in zip(drawn, OVERLAID, WAYS, strict=False):
        named = {"legend_label": way} if len(ways) > 1 else {}
        panel.scatter(x, y, size=2, color=colour, line_color=None, alpha=0.6, **named)
    return panel, kinds


def _thinned(result: Result, variable: str, most: int) -> tuple[Array, Array]:
    """Return at most this number of points of a variable: swept values and values, as float32."""
    lanes = diagram_lanes(result)
    rows = result.lanes(variable)[lanes.numbers].reshape(lanes.numbers.size, -1)
    rows = np.where(lanes.diverged[:, np.newaxis], np.nan, rows)
    # The last points: of a periodic motion none is lost as long as a period is left.
    rows = rows[:, -max(1, most // len(rows)) :]
    every = -(-rows.size // most)
    x, y = np.repeat(lanes.parameter, rows.shape[1])[::every], rows.ravel()[::every]
    # Motions that grow exceed the largest number of the page.
    there = np.abs(y) < np.finfo(np.float32).max
    return x[there].astype(np.float32), y[there].astype(np.float32)


def _exponents(result: Result, most: int, x_range: Any) -> Any:
    """Draw the largest exponents of the lanes as dots and, for one lane per value, a line."""
    panel = _panel(result, result.axis, LARGEST_EXPONENT, 220, (x_range,))
    alone = not any(axis in UNSWEPT for axis in result.axes)
    for one, (colour, _) in zip(directions_of(result), OVERLAID, strict=False):
        x, y = _thinned(one, LARGEST_EXPONENT, most // 20)
        panel.scatter(x, y, size=2, color=colour)
        if alone or len(one.axes) == 1:
            panel.line(x, y, color=colour)
    panel.add_layout(Span(location=0.0, dimension="width", line_color=GREY, line_dash="dashed"))
    return panel


def _map(
    result: Result, variable: str, most: int, found: Basins | None
) -> tuple[Any, dict[str, str]]:
    """Draw basins, or a variable over two parameters, as the figures do."""
    axes, (across, up) = Figure().subplots(), map_axes(result)
    image: Any = basins(axes, found) if found else parameter_map(axes, result, variable)
    legend, colours = axes.get_legend(), image.cmap
    numbers = np.ma.filled(image.get_array().astype(float), np.nan)
    edges = [cell_edges(np.asarray(result[name], dtype=float)) for name in (across, up)]
    every = max(1, int(np.ceil((numbers.size / most) ** 0.5)))
    places = [_even(one, every) for one in edges]
    cells = numbers[np.ix_(places[1], places[0])].astype(np.float32)
    ends = [(float(one[0]), float(one[-1])) for one in edges]
    panel = _panel(result, across, up, 560, ends)
    if not found:
        panel.hover.tooltips = [("", "$x, $y"), (variable, "@image")]
    shades = [to_hex(one) for one in colours(np.linspace(0.0, 1.0, min(colours.N, COLOURS)))]
    low, high = image.get_clim()
    mapper = LinearColorMapper(shades, low=low, high=high, nan_color=GREY)
    (left, right), (bottom, top) = ends
    frame = {"x": left, "y": bottom, "dw": right - left, "dh": top - bottom}
    panel.image(image=[cells], color_mapper=mapper, **frame)
    if not isinstance(colours, ListedColormap):
        panel.add_layout(ColorBar(color_mapper=mapper), "right")
    for line in axes.lines if found else ():
        look = {"color": to_hex(line.get_markerfacecolor()), "size": 1.4 * line.get_markersize()}
        panel.scatter(*line.get_data(), line_color=BLACK, **look)
    patches: list[Any] = legend.legend_handles if legend else []
    if found:
        patches = basin_patches(found)
    return panel, {str(one.get_label()): to_hex(one.get_facecolor()) for one in patches}


def _even(edges: Floats, every: int) -> Array:
    """Return the numbers of cells at evenly spaced places, fewer by the factor ``every``."""
    widths = np.diff(edges)
    size = widths.size if np.allclose(widths, widths[0]) else max(widths.size, FINEST)
    count = -(-size // every)
    middles = edges[0] + (np.arange(count) + 0.5) * (edges[-1] - edges[0]) / count
    return np.asarray(np.clip(np.searchsorted(edges, middles) - 1, 0, widths.size - 1))
