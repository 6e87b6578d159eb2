"""The bifurcation diagram: stroboscopic section points against the swept parameter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label
from gearchaos.figures.lanes import Between, diagram_lanes
from gearchaos.figures.panel import close_panel
from gearchaos.figures.style import BLACK
from gearchaos.results.result import Result, section_variables


class BifurcationArtists(NamedTuple):
    """What `bifurcation` has drawn: the section points, lane after lane, and its `Marks`."""

    points: Line2D
    diverged: Line2D | None
    off_scale: list[Line2D]
    legend: Legend | None


def bifurcation(
    axes: Axes,
    result: Result,
    variable: str | None = None,
    *,
    between: Between = (None, None),
    full_range: bool = False,
) -> BifurcationArtists:
    """Draw the bifurcation diagram of one section variable into axes.

    Every section point is a small translucent dot: a periodic motion, whose points coincide,
    shows as a crisp black line, and chaos as grey whose depth is the density of visits. The
    dots are rasterised, so that a PDF stays small. Diverged lanes get a red tick at the
    bottom, lanes beyond robust limits a triangle at the edge, and a legend above says so.

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

    Raises
    ------
    FigureError
        If the result has no such section variable, no lane in the range, or two swept parameters.
    """
    variable = _known_variable(result, variable)
    lanes = diagram_lanes(result, between)
    values = np.asarray(result.lanes(variable), dtype=np.float64)[lanes.numbers]
    values = np.where(lanes.diverged[:, np.newaxis], np.nan, values)
    finite = np.isfinite(values)
    (points,) = axes.plot(
        np.broadcast_to(lanes.parameter[:, np.newaxis], values.shape)[finite],
        values[finite],
        linestyle="none",
        marker=".",
        markersize=float(np.clip(200.0 / lanes.numbers.size, 0.8, 1.8)),
        markeredgewidth=0.0,
        color=BLACK,
        alpha=min(1.0, 4.0 / max(1, values.shape[1]) ** 0.5),
        rasterized=True,
    )
    axes.set_ylabel(axis_label(result, variable, line_length=34))
    known = np.ma.masked_invalid(values)
    low, high = (extreme.filled(np.nan) for extreme in (known.min(axis=1), known.max(axis=1)))
    return BifurcationArtists(
        points, *close_panel(axes, result, lanes, low, high, full_range=full_range)
    )


def _known_variable(result: Result, variable: str | None) -> str:
    names = section_variables(result)
    if not names:
        raise FigureError("the result has no section points: the sweep did not record any")
    if variable is not None and variable not in names:
        raise FigureError(
            f"no section variable {variable!r} in the result; it has {', '.join(names)}"
        )
    return variable or names[0]
