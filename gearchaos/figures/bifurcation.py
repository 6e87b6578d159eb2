"""The bifurcation diagram: stroboscopic section points against the swept parameter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from gearchaos.errors import ConfigurationError
from gearchaos.figures.labels import axis_label
from gearchaos.figures.lanes import (
    Between,
    Floats,
    legend_above,
    mark_diverged,
    mark_off_scale,
    parameter_limits,
    robust_limits,
    say_nothing_to_show,
    select_lanes,
)
from gearchaos.figures.style import POINTS
from gearchaos.results.result import Result, section_variables


@dataclass(frozen=True)
class BifurcationArtists:
    """What `bifurcation` has drawn.

    Attributes
    ----------
    points : Line2D
        The section points; its data are the file's, lane after lane.
    diverged : Line2D or None
        The rug of diverged lanes.
    off_scale : list of Line2D
        Triangles for lanes beyond the bottom and beyond the top.
    legend : Legend or None
    """

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
    legend: bool = True,
) -> BifurcationArtists:
    """Draw the bifurcation diagram of one section variable into axes.

    Every section point is a small translucent dot: a periodic motion, whose points coincide,
    shows as a crisp black line, and chaos as grey whose depth is the density of visits. The
    dots are rasterised, so that a PDF stays small. Diverged lanes get a red tick at the
    bottom, lanes beyond robust limits a triangle at the edge.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    result : Result
    variable : str, optional
        A section variable; default `section_delta_5`, or the first that the result has.
    between : (float or None, float or None)
        The part of the parameter range to show.
    full_range : bool
        Let the vertical axis reach every point, however few lie far out.
    legend : bool
        Put a legend above the axes if lanes diverged or are off scale.

    Returns
    -------
    BifurcationArtists

    Raises
    ------
    ConfigurationError
        If the result has no such section variable, or no lane in the range.
    """
    variable = _known_variable(result, variable)
    parameter, chosen, diverged = select_lanes(result, between)
    shown = chosen & ~diverged
    values = np.asarray(result[variable], dtype=np.float64)[shown]
    x = np.repeat(parameter[shown], values.shape[1])
    y = values.ravel()
    finite = np.isfinite(y)
    lanes = int(np.count_nonzero(chosen))
    (points,) = axes.plot(
        x[finite],
        y[finite],
        linestyle="none",
        marker=".",
        markersize=float(np.clip(200.0 / lanes, 0.8, 1.8)),
        markeredgewidth=0.0,
        color=POINTS,
        alpha=min(1.0, 4.0 / max(1, values.shape[1]) ** 0.5),
        rasterized=True,
    )
    axes.set_xlim(parameter_limits(parameter[chosen], between))
    axes.set_xlabel(axis_label(result, result.axis))
    axes.set_ylabel(axis_label(result, variable, line_length=34))
    rug = mark_diverged(axes, result, parameter[chosen & diverged])
    off_scale: list[Line2D] = []
    if finite.any():
        drawn, low, high = _extremes(parameter[shown], values)
        axes.set_ylim(robust_limits(low, high, full_range=full_range))
        off_scale = mark_off_scale(axes, drawn, low, high)
    else:
        say_nothing_to_show(axes, lanes, int(np.count_nonzero(chosen & diverged)))
    return BifurcationArtists(
        points, rug, off_scale, legend_above(axes, [rug, *off_scale]) if legend else None
    )


def _known_variable(result: Result, variable: str | None) -> str:
    names = section_variables(result)
    if not names:
        raise ConfigurationError("the result has no section points: the sweep did not record any")
    if variable is None:
        return names[0]
    if variable not in names:
        raise ConfigurationError(
            f"no section variable {variable!r} in the result; it has {', '.join(names)}"
        )
    return variable


def _extremes(parameter: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    finite = np.isfinite(values)
    some = finite.any(axis=1)
    low = np.where(finite, values, np.inf)[some].min(axis=1)
    high = np.where(finite, values, -np.inf)[some].max(axis=1)
    return parameter[some], low, high
