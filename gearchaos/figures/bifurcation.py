"""The bifurcation diagram: stroboscopic section points against the swept parameter."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from gearchaos.errors import FigureError
from gearchaos.figures.dots import MOST_DOTS, dots, portions
from gearchaos.figures.labels import axis_label
from gearchaos.figures.lanes import Between, diagram_lanes
from gearchaos.figures.panel import DiagramArtists, Drawn, close_panel
from gearchaos.figures.style import BLACK
from gearchaos.results.result import Result, section_variables


def bifurcation(
    axes: Axes,
    result: Result,
    variable: str | None = None,
    *,
    between: Between = (None, None),
    full_range: bool = False,
    color: str = BLACK,
    label: str | None = None,
    marker: str = ".",
) -> DiagramArtists:
    """Draw the bifurcation diagram of one section variable into axes.

    Every section point is a small translucent dot: a periodic motion, whose points coincide,
    shows as a crisp black line, and chaos as grey whose depth is the density of visits. The
    dots are rasterised, so that a PDF stays small. Above `figures.dots.MOST_DOTS` they are counted
    by pixel, and fainter the more there are, so that chaos stays grey.
    Diverged lanes get a red tick at the bottom, lanes beyond robust limits a triangle at the edge,
    and a legend above says so.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    result : Result
        Over one swept parameter.
    variable : str, optional
        A section variable; default `section_delta_5`, or the first that the result has.
    between : (float or None, float or None)
        The part of the parameter range to show.
    full_range : bool
        Let the vertical axis reach every lane, however few lie far out.
    color, label, marker : str
        Of the dots, for diagrams of several results in the same axes: the limits then hold what
        those of each would, the triangles follow them, and the legend names the labels.

    Raises
    ------
    FigureError
        If the result has no such section variable, no lane in the range, or two swept parameters.
    """
    names = section_variables(result)
    if not names:
        raise FigureError("the result has no section points: the sweep did not record any")
    variable = names[0] if variable is None else variable
    if variable not in names:
        there = ", ".join(names)
        raise FigureError(f"no section variable {variable!r} in the result; it has {there}")
    lanes = diagram_lanes(result, between)
    rows = result.lanes(variable)
    total, of_a_lane = max(1, lanes.numbers.size * rows.shape[1]), max(1, rows.shape[1])
    alpha = min(1.0, 4.0 / of_a_lane**0.5) * min(1.0, MOST_DOTS / total)
    look = {"markersize": lanes.dot_size(0.8), "marker": marker, "color": color, "label": label}
    points = dots(axes, lanes, rows, rasterized=True, alpha=alpha, **look)
    axes.set_ylabel(axis_label(result, variable, line_length=34))
    low, high = np.full((2, lanes.numbers.size), np.nan)
    for part, values in portions(lanes, rows):
        np.fmin.reduce(values, axis=1, out=low[part])
        np.fmax.reduce(values, axis=1, out=high[part])
    drawn = Drawn(points, lanes, low, high, 0.0, full_range, [], [])
    return close_panel(axes, result, drawn)
