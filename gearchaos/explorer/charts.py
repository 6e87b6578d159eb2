"""Diagram, exponent chart and map of a sweep, redrawn at every zoom."""

from typing import Any

import holoviews as hv
import numpy as np
from bokeh.models import ColumnDataSource, GlyphRenderer, Scatter
from datashader.reductions import max as highest
from holoviews.operation.datashader import rasterize
from holoviews.operation.downsample import downsample1d
from matplotlib.colors import ListedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gearchaos.arrays import Array
from gearchaos.explorer.shades import COLOURS
from gearchaos.explorer.text import plain_text
from gearchaos.figures.branches import limits_with
from gearchaos.figures.diagrams import waterfall
from gearchaos.figures.ensembles import basin_patches, basins
from gearchaos.figures.labels import axis_label
from gearchaos.figures.lanes import cell_edges, diagram_lanes, map_axes
from gearchaos.figures.maps import parameter_map
from gearchaos.figures.overlay import Overlay
from gearchaos.figures.panel import robust_limits
from gearchaos.figures.style import BLACK
from gearchaos.outputs.names import LARGEST_EXPONENT, ORDER
from gearchaos.results.reading.ensembles import Basins
from gearchaos.results.reading.result import Result

Charts = tuple[list[Any], dict[str, str]]
"""Panels, with the zoomable one first, and the colours of kinds by name."""

GREYS = [f"#{3 * f'{shade:02x}'}" for shade in range(176, -1, -1)]
"""Greys of pixels, from few points to many."""

FILLED = 0.05
"""Share of filled pixels of a diagram below which dots are enlarged by one pixel."""

NO_VALUES = "no lane has a value of this variable"
"""Title of a diagram without points."""

WIDEST_GAP = 6
"""Widest gap between lanes, in pixels, that is filled by widening their dots."""

VALUE = "z"
"""Name that HoloViews gives to a variable over two axes."""

DRAWN = 4000
"""Most points of a line; a longer line is reduced to its outline."""


def diagram(result: Result, variable: str, over: Overlay | None = None) -> Charts:
    """Draw a variable over one swept parameter, and the largest exponent if the result has it.

    ``over``: what will be drawn over the first chart, whose limits hold it.
    """
    lanes, drawn = diagram_lanes(result), [variable]
    if LARGEST_EXPONENT in result:
        drawn.append(LARGEST_EXPONENT)
    charts: list[Any] = []
    for name in drawn:
        rows = result.lanes(name)[lanes.numbers].reshape(lanes.numbers.size, -1)
        rows = np.where(lanes.diverged[:, np.newaxis], np.nan, rows)
        there = rows[np.isfinite(rows).any(axis=1)]
        points = np.repeat(lanes.parameter, rows.shape[1]), rows.ravel()
        ends = np.nanmin(there, axis=1), np.nanmax(there, axis=1)
        # Without a value: any limits, and a title with the reason.
        height = robust_limits(*ends, hold_zero=bool(charts)) if there.size else (0.0, 1.0)
        if over and not charts:
            height = limits_with(over, height, lanes.limits)
        frame = {"xlim": lanes.limits, "ylim": height, "title": "" if there.size else NO_VALUES}
        # Datashader cannot count points whose range is a single value: the limits widen it.
        sides = zip(_dimensions(result, result.axis, name), (lanes.limits, height), strict=True)
        dimensions = [one.clone(soft_range=limits) for one, limits in sides]
        if result.dims(name)[-1:] == (ORDER,):
            charts.append(_waterfall(result, name))
            continue
        if charts:
            chart = downsample1d(hv.Curve(points, *dimensions), width=DRAWN)
            look = {"color": BLACK, "line_width": 1.0, "height": 240, "show_grid": True}
        else:
            chart = rasterize(hv.Points(points, dimensions), aggregator="count").apply(_thickened)
            look = {"cmap": GREYS, "cnorm": "eq_hist", "height": 340}
        charts.append(chart.opts(responsive=True, **frame, **look))
    return charts, {}


def _waterfall(result: Result, variable: str) -> Any:
    """Draw amplitudes over one swept parameter, one row per mesh order, as `figures.waterfall`."""
    axes = Figure().subplots()
    image: Any = waterfall(axes, result, variable)
    ticks = [
        *zip(axes.get_yticks(), (one.get_text() for one in axes.get_yticklabels()), strict=True)
    ]
    numbers = np.ma.filled(image.get_array().astype(float), np.nan)
    edges = cell_edges(np.unique(diagram_lanes(result).parameter)), np.arange(len(ticks) + 1) - 0.5
    across, _ = _dimensions(result, result.axis, variable)
    along = hv.Dimension("order", label=axes.get_ylabel())
    value = hv.Dimension(VALUE, label=plain_text(axis_label(result, variable)))
    mesh = hv.QuadMesh((*edges, numbers.reshape(len(ticks), -1)), [across, along], value)
    shades = image.cmap(np.linspace(0.0, 1.0, COLOURS))
    look: Any = {"cmap": [to_hex(one) for one in shades], "clim": image.get_clim(), "logz": True}
    look |= {"colorbar": True, "height": 340, "yticks": ticks}
    return rasterize(mesh, aggregator=highest()).opts(responsive=True, **look)


def two_parameter_map(result: Result, variable: str) -> Charts:
    """Draw a variable over two swept parameters, as `figures.parameter_map` does."""
    axes, names = Figure().subplots(), map_axes(result)
    image: Any = parameter_map(axes, result, variable)
    legend, colours = axes.get_legend(), image.cmap
    patches: list[Any] = legend.legend_handles if legend else []
    numbers = np.ma.filled(image.get_array().astype(float), np.nan)
    mesh = hv.QuadMesh((*map(result.__getitem__, names), numbers), _dimensions(result, *names))
    shades = colours(np.linspace(0.0, 1.0, min(colours.N, COLOURS)))
    look: Any = {"cmap": [to_hex(shade) for shade in shades], "clim": image.get_clim()}
    look |= {"colorbar": not isinstance(colours, ListedColormap), "height": 580}
    chart = rasterize(mesh, aggregator=highest()).opts(responsive=True, **look)
    return [chart], {str(one.get_label()): to_hex(one.get_facecolor()) for one in patches}


def basin_map(result: Result, found: Basins) -> tuple[Charts, list[GlyphRenderer]]:
    """Draw basins over two states of the starts as `figures.basins` does.

    ``result``: over the two states alone. Also return the sections of the attractors as circles.
    """
    axes, names = Figure().subplots(), map_axes(result)
    image: Any = basins(axes, found)
    mesh = hv.QuadMesh(
        (*map(result.__getitem__, names), np.asarray(image.get_array(), dtype=float)),
        _dimensions(result, *names),
    )
    shades = [to_hex(shade) for shade in image.cmap(np.arange(image.cmap.N))]
    look: Any = {"cmap": shades, "clim": image.get_clim(), "colorbar": False, "height": 580}
    chart = rasterize(mesh, aggregator=highest()).opts(responsive=True, **look)
    kinds = {str(one.get_label()): to_hex(one.get_facecolor()) for one in basin_patches(found)}
    return ([chart], kinds), [_circles(line) for line in axes.lines]


def _circles(line: Line2D) -> GlyphRenderer:
    """Return the markers of a line of matplotlib for a chart of bokeh."""
    x, y = np.asarray(line.get_data(), dtype=float)
    pixels = 1.4 * line.get_markersize()
    look = {"fill_color": to_hex(line.get_markerfacecolor()), "size": pixels}
    look |= {"line_width": line.get_markeredgewidth()}
    source = ColumnDataSource({"x": x, "y": y})
    return GlyphRenderer(data_source=source, glyph=Scatter(x="x", y="y", line_color=BLACK, **look))


def _thickened(image: hv.Image) -> hv.Image:
    """Enlarge dots by one pixel if there are too few to be visible.

    Datashader's own function for this is compiled for seconds whenever a page is opened.
    """
    (count,) = image.vdims
    counts = image.data[count.name]
    thick = counts.to_numpy()
    if np.count_nonzero(thick) < FILLED * thick.size:
        wide = np.pad(thick, 1)
        tall = np.maximum.reduce([wide[:-2], wide[1:-1], wide[2:]])
        thick = np.maximum.reduce([tall[:, :-2], tall[:, 1:-1], tall[:, 2:]])
    thick = _closed(thick)
    # float32 halves the size of the picture that is sent to the browser.
    shown = np.where(thick, thick, np.nan).astype(np.float32)
    data = image.data.assign({count.name: (counts.dims, shown)})
    return image.clone(data, vdims=[count.clone(nodata=None)])


def _closed(counts: Array) -> Array:
    """Widen points along x so that a continuous branch has no gaps between its lanes."""
    filled = np.flatnonzero(counts.any(axis=0))
    gap = int(np.diff(filled).max(initial=1)) if filled.size * WIDEST_GAP > counts.shape[1] else 1
    reach = min(gap, WIDEST_GAP) - 1
    wide = np.pad(counts, ((0, 0), (reach - reach // 2, reach // 2)))
    shifted = [wide[:, at : at + counts.shape[1]] for at in range(reach + 1)]
    return np.asarray(np.maximum.reduce(shifted))


def _dimensions(result: Result, *names: str) -> list[Any]:
    # The vertical axis has less room.
    labels = [
        axis_label(result, name, length) for name, length in zip(names, (40, 26), strict=True)
    ]
    texts = [plain_text(label) for label in labels]
    # HoloViews merges two axes if the label of one is the label or the name of the other.
    if len({*texts, *names, VALUE}) < len([*texts, *names, VALUE]):
        texts = [f"{text} [{name}]" for text, name in zip(texts, names, strict=True)]
    return [hv.Dimension(n, label=one) for n, one in zip(names, texts, strict=True)]
