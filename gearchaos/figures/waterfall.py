"""The waterfall of a sweep: amplitudes at mesh orders over the swept parameter."""

from fractions import Fraction
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label, instead_of
from gearchaos.figures.lanes import Between, cell_edges, diagram_lanes
from gearchaos.figures.maps import NO_VALUE
from gearchaos.figures.stages import look_of
from gearchaos.results.result import Result
from gearchaos.results.variables import ORDER

DECADES = 5  # Below the largest amplitude; what is smaller has the lightest colour.


def waterfall(axes: Axes, result: Result, variable: str, *, between: Between = (None, None)) -> Any:
    """Draw amplitudes of the lanes of a sweep into axes, a row for each mesh order.

    Colours are logarithmic, lanes without amplitudes grey. ``variable``: such as
    "amplitude_transmission_error"; ``between``: as for `bifurcation`. Returns the image. Raises
    FigureError if the result has no such amplitudes, no lane in the range, two swept parameters or
    several lanes for one value.
    """
    there = [name for name in result if result.dims(name) == (*result.axes, ORDER)]
    if variable not in there:
        raise FigureError(
            f"no amplitudes {variable!r} in the result; {instead_of(variable, there)}"
        )
    lanes = diagram_lanes(result, between)
    values = np.unique(lanes.parameter)
    if axes.images or values.size < lanes.numbers.size:
        rule = "is drawn of one result, with one lane for each value"
        raise FigureError(f"{variable}: {rule}; choose them with --at (in Python: result.sel)")
    amplitudes = result.lanes(variable)[lanes.numbers].T
    most = float(np.nanmax(amplitudes, initial=0.0)) or 1.0
    least = most / 10.0**DECADES
    colours = mpl.colormaps["YlGnBu"].with_extremes(bad=look_of(NO_VALUE)["facecolor"])
    edges = cell_edges(values), np.arange(len(amplitudes) + 1) - 0.5
    look: Any = {"cmap": colours, "norm": LogNorm(least, most), "zorder": 1.0}
    image = axes.pcolorfast(*edges, np.ma.masked_invalid(np.maximum(amplitudes, least)), **look)
    names = [str(Fraction(order).limit_denominator(1_000_000)) for order in result[ORDER]]
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="y", which="minor", left=False, right=False)
    axes.set(xlim=lanes.limits, xlabel=axis_label(result, result.axis), ylabel="Mesh order")
    assert axes.figure is not None
    label: Any = {"location": "top", "label": axis_label(result, variable), "extend": "min"}
    axes.figure.colorbar(image, ax=axes, aspect=40, **label)
    return image
