"""Boundaries of periodic orbits over two parameters: over a map, and on a page of their own."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import Stroke, withStroke

from gearchaos.arrays import Floats
from gearchaos.errors import FigureError
from gearchaos.figures.labels import label_of
from gearchaos.figures.lanes import Between
from gearchaos.figures.overlay import OverlaidLine, OverlaidPoint, Overlay
from gearchaos.figures.page import Page, continued, footnote, legend_below, page
from gearchaos.figures.style import BLACK, BLUE, GREEN, PURPLE, SINGLE_COLUMN_MM, VERMILION
from gearchaos.records.boundary import (
    CUSP,
    FLIP_NEIMARK_SACKER,
    FOLD_FLIP,
    FOLD_NEIMARK_SACKER,
    GRAZING_FLIP,
    GRAZING_FOLD,
    GRAZING_NEIMARK_SACKER,
    POINT_KINDS,
    POINT_MEANINGS,
    STRONG_RESONANCE_11,
    STRONG_RESONANCE_12,
    WEAKER_RESONANCES,
)
from gearchaos.records.branch import FOLD, GRAZING, NEIMARK_SACKER, PERIOD_DOUBLING
from gearchaos.results.files.boundary_file import BoundarySet

LINES: dict[str, dict[str, Any]] = {
    FOLD: {"color": BLACK, "linestyle": "-"},
    PERIOD_DOUBLING: {"color": PURPLE, "linestyle": (0, (5, 1.5))},
    NEIMARK_SACKER: {"color": GREEN, "linestyle": (0, (5, 1.5, 1, 1.5))},
    GRAZING: {"color": VERMILION, "linestyle": (0, (1, 1.2))},
}
"""Line of each kind of boundary."""

WIDTHS = {1: 1.0, 2: 0.7}
"""Width of the line of each period in points; longer ones are thinner."""

MARKERS: dict[str, dict[str, Any]] = {
    CUSP: {"marker": "^", "color": BLACK},
    STRONG_RESONANCE_11: {"marker": "o", "color": BLACK},
    STRONG_RESONANCE_12: {"marker": "s", "color": PURPLE},
    **{kind: {"marker": "d", "color": GREEN} for kind in WEAKER_RESONANCES},
    FOLD_FLIP: {"marker": "D", "color": BLUE},
    FOLD_NEIMARK_SACKER: {"marker": "v", "color": GREEN},
    FLIP_NEIMARK_SACKER: {"marker": "<", "color": GREEN},
    GRAZING_FOLD: {"marker": "X", "color": VERMILION},
    GRAZING_FLIP: {"marker": "P", "color": VERMILION},
    GRAZING_NEIMARK_SACKER: {"marker": "*", "color": VERMILION},
}
"""Marker and colour of each kind of point of codimension 2."""

MARGIN, NARROWEST = 0.03, 0.02
"""Margin beside curves, as a share of the axis, and the least length of an axis relative to its
largest value."""

_HALO: Any = {"linewidth": 2.0, "foreground": "white", "alpha": 0.8}


def draw_boundaries(
    axes: Axes, found: BoundarySet, parameters: Sequence[str] | None = None
) -> list[Line2D]:
    """Draw boundaries into axes over two parameters, with their points of codimension 2.

    Parameters
    ----------
    axes : Axes
        Axes with one parameter along x and the other along y, such as those of `parameter_map`.
        Their limits stay.
    found : BoundarySet
        The boundaries.
    parameters : sequence of str, optional
        Names of the parameters along x and y, by default in the order of the file.

    Returns
    -------
    list of Line2D
        One entry for the legend for each kind of line and marker.

    Raises
    ------
    FigureError
        If the boundaries are not over these parameters.
    """
    over = boundary_overlay(found, parameters)
    names: dict[str, Line2D] = {}
    limits = axes.get_xlim(), axes.get_ylim()
    for one in over.lines:
        # A boundary of one point could not be followed; a dot shows where it is.
        dot = {"marker": ".", "ms": 3.0, "linestyle": "none"} if one.x.size == 1 else {}
        (line,) = axes.plot(one.x, one.y[:, 0], zorder=3.0, **{**one.look, **dot})
        line.set_path_effects([withStroke(**_HALO)])
        names.setdefault(one.kind, line).set_label(one.kind)
    for point in over.points:
        look: dict[str, Any] = {"ms": 3.2, "mew": 0.7, "mfc": "white", "ls": "none", "zorder": 4.0}
        (mark,) = axes.plot([point.x], point.y, **look, **point.look)
        mark.set_path_effects([Stroke(**_HALO), withStroke(linewidth=0.0)])
        names.setdefault(point.kind, mark).set_label(point.kind)
    axes.set(xlim=limits[0], ylim=limits[1])
    return [names[kind] for kind in over.kinds]


def boundary_overlay(found: BoundarySet, parameters: Sequence[str] | None = None) -> Overlay:
    """Return the curves and the points of codimension 2 over parameters along x and y."""
    order = _order(found, parameters)
    several = len({one.period for one in found.boundaries}) > 1
    lines, points = list[OverlaidLine](), list[OverlaidPoint]()
    for one in found.boundaries:
        kind = f"{one.kind}, period {one.period}" if several else one.kind
        kind += ", one point" if one.arclength.size == 1 else ""
        look = {"linewidth": WIDTHS.get(one.period, 0.4), **LINES[one.kind]}
        x, y = one.values[:, order].T
        lines.append(OverlaidLine(kind, x, y[:, np.newaxis], look))
        for point in one.points:
            place: Floats = point.values[order]
            at = ", ".join(
                f"{name.name} = {value:.8g}"
                for name, value in zip(found.parameters, point.values, strict=True)
            )
            text = f"{point.kind} of period {one.period} at {at}: {POINT_MEANINGS[point.kind]}"
            look = MARKERS[point.kind]
            points.append(OverlaidPoint(point.kind, float(place[0]), place[1:], look, text))
    drawn, marked = {one.kind for one in lines}, {one.kind for one in points}
    kinds = [
        *(name for kind in LINES for name in sorted(drawn) if name.split(",")[0] == kind),
        *(kind for kind in POINT_KINDS if kind in marked),
    ]
    return Overlay(lines, points, kinds)


def _with_margin(values: Floats) -> tuple[float, float]:
    """Return limits of an axis; values that differ by rounding only fill a small part of it."""
    low, high = float(values.min()), float(values.max())
    width = max(high - low, NARROWEST * max(abs(low), abs(high)), 1e-12)
    aside = (1.0 + 2.0 * MARGIN) * width / 2.0
    middle = (low + high) / 2.0
    return middle - aside, middle + aside


def _order(found: BoundarySet, parameters: Sequence[str] | None) -> list[int]:
    """Return the columns of values along x and y."""
    there = [one.name for one in found.parameters]
    if parameters is None:
        return [0, 1]
    if {*parameters} != {*there}:
        raise FigureError(
            f"the boundaries are over {' and '.join(there)}, and the map is over "
            f"{' and '.join(parameters)}; give the boundaries of this map"
        )
    return [there.index(name) for name in parameters]


def add_boundaries(figure: Page, found: BoundarySet, parameters: Sequence[str]) -> None:
    """Draw boundaries into all maps of a page of `map_page`, with a legend below.

    Parameters
    ----------
    figure : Page
        The page.
    found, parameters
        As for `draw_boundaries`.

    Raises
    ------
    FigureError
        If the boundaries are not over these parameters.
    """
    with continued(figure):
        handles = [draw_boundaries(axes, found, parameters) for axes in figure.axes]
        if handles[0]:
            # The legend takes the place of the footnote, which becomes its title.
            legend_below(figure, handles[0], figure.get_supxlabel() or None, 5)
            footnote(figure, " ")


def boundaries_page(
    found: BoundarySet,
    *,
    between: Between = (None, None),
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw boundaries over both parameters.

    Parameters
    ----------
    found : BoundarySet
        The boundaries.
    between : (float or None, float or None)
        Part of the first parameter's range to show; None is the end of the boundaries.
    width_mm, height_mm : float
        Size of the page.

    Returns
    -------
    Page
        A figure unknown to pyplot.

    Raises
    ------
    FigureError
        If there are no boundaries.
    """
    if not found.boundaries:
        raise FigureError("nothing to draw: the file holds no boundary")
    with page(width_mm, height_mm or 30.0 + 0.8 * width_mm) as figure:
        axes = figure.subplots()
        values = np.concatenate([one.values for one in found.boundaries])
        (x, y), (low, high) = values.T, between
        first, last = _with_margin(x)
        axes.set_xlim(first if low is None else low, last if high is None else high)
        axes.set_ylim(*_with_margin(y))
        handles = draw_boundaries(axes, found)
        axes.set(xlabel=label_of(found.parameters[0]), ylabel=label_of(found.parameters[1], 34))
        legend_below(figure, handles, str(found.metadata.get("title", "")) or None, 2)
    return figure
