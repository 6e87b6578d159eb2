"""Diagrams of a sweep over its parameter: section points, largest exponent, amplitudes."""

from fractions import Fraction
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label, check_variable
from gearchaos.figures.lanes import (
    MOST_DOTS,
    Between,
    ShownLanes,
    cell_edges,
    diagram_lanes,
    dots,
    outermost,
    portions,
)
from gearchaos.figures.lines import draw_line, joined
from gearchaos.figures.maps import NO_VALUE
from gearchaos.figures.panel import Diagram, close_panel
from gearchaos.figures.stages import look_of
from gearchaos.figures.style import BLACK, DASHES, GREY, VERMILION
from gearchaos.models.gear_pair.outputs import DEFAULT_VARIABLE
from gearchaos.outputs.names import (
    CONTACT_STATE,
    EXPONENT_NUMBER,
    LABELS,
    LARGEST_EXPONENT,
    ORDER,
    RECORD,
    STANDARD_ERROR,
    STATUS,
)
from gearchaos.results.reading.result import Result, section_variables

HATCH = "////"
"""Hatching under a positive exponent."""

BAND_STANDARD_ERRORS = 2.0
TWO_ERRORS = "\N{PLUS-MINUS SIGN}2 standard errors"
LINE_PT = 0.6  # Width of lines.
DECADES = 5  # Decades of the colour scale, down from the largest amplitude.


def bifurcation(
    axes: Axes,
    result: Result,
    variable: str | None = None,
    *,
    between: Between = (None, None),
    color: str = BLACK,
    label: str | None = None,
    marker: str = ".",
    lines: bool = False,
) -> Diagram:
    """Draw the bifurcation diagram of one section variable into axes.

    Parameters
    ----------
    axes : Axes
        The axes to draw into. Limits, triangles and legend cover all diagrams in them.
    result : Result
        A result over one swept parameter.
    variable : str, optional
        A section variable, or a variable with one number per lane. By default the first section
        variable of the result.
    between : (float or None, float or None)
        Part of the parameter range to show; None is the end of the sweep.
    color, label, marker : str
        Colour, legend entry and marker of the dots.
    lines : bool
        Draw a variable with one number per lane as a line, broken where the label of the motion
        changes and at jumps. Motions that are not periodic keep their dots, and so do sections.

    Returns
    -------
    Diagram
        What was drawn; its ``points`` are the dots, and ``parts`` may hold the ``line``.

    Raises
    ------
    FigureError
        If the variable is missing, no lane is in the range, or there are two swept parameters.

    Notes
    -----
    Each section point is a translucent, rasterised dot. Points of a periodic motion coincide in a
    black line; chaos is grey, darker where visited more often. Above `figures.lanes.MOST_DOTS` the
    dots are counted per pixel. Diverged lanes get a red tick, lanes beyond the limits a triangle.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> result = gearchaos.open_result("pan2021.h5")
    >>> drawn = figures.bifurcation(axes, result, "section_delta_5", between=(5.0, None))
    """
    variable = _diagram_variable(result, variable)
    lanes = diagram_lanes(result, between)
    rows = result.lanes(variable).reshape(result.lanes(STATUS).size, -1)
    alpha = _opacity(lanes.numbers.size, max(1, rows.shape[1]))
    look = {"markersize": lanes.dot_size(0.8), "marker": marker, "color": color, "label": label}
    dotted, parts = lanes, dict[str, Any]()
    if lines and rows.shape[1] == 1:
        values = rows[lanes.numbers, 0]
        join, dash = joined(result, lanes, values), DASHES.get(marker, "-")
        parts["line"] = draw_line(axes, lanes, values, join, color=color, lw=LINE_PT, ls=dash)
        beside = np.pad(join, 1)
        dotted = lanes._replace(diverged=lanes.diverged | beside[1:] | beside[:-1])
    points = dots(axes, dotted, rows, rasterized=True, alpha=alpha, **look)
    axes.set_ylabel(axis_label(result, variable, line_length=34))
    low, high = _extremes(lanes, rows)
    reach = _reach_of(result, variable, lanes)
    named: list[Artist] = []
    if (reach > 0.0).any():
        parts["bars"] = _bars(axes, lanes.parameter, low, reach, color)
        named.append(parts["bars"])
    own = Diagram(points, lanes, low, high, reach, named, parts=parts)
    return close_panel(axes, result, own)


def _reach_of(result: Result, variable: str, lanes: ShownLanes) -> Floats:
    """Return two standard errors of a variable of each lane, (lanes,), 0 where it has none.

    It is 0 as well for variables with several numbers per lane, whose bars would hide each other.
    """
    error = variable + STANDARD_ERROR
    if variable == LARGEST_EXPONENT or error not in result.variables[variable].errors:
        return np.zeros(lanes.numbers.size)
    spread: Floats = np.nan_to_num(BAND_STANDARD_ERRORS * result.lanes(error)[lanes.numbers])
    return spread if spread.ndim == 1 else np.zeros(lanes.numbers.size)


def _bars(axes: Axes, x: Floats, values: Floats, reach: Floats, color: str) -> Artist:
    """Draw bars of two standard errors behind the dots of a variable."""
    look: dict[str, Any] = {"colors": _pale(color), "lw": 0.6, "zorder": 1.0}
    return axes.vlines(x, values - reach, values + reach, label=TWO_ERRORS, **look)


def _pale(color: str) -> Any:
    """Return the colour of uncertainty around what has a colour."""
    return 0.6 + 0.4 * np.array(to_rgb(color))


def _opacity(lanes: int, points: int) -> float:
    """Choose the opacity of dots from the number of lanes and of points per lane."""
    opacity: float = min(1.0, 4.0 / points**0.5) * min(1.0, MOST_DOTS / (lanes * points))
    return opacity


def _extremes(lanes: ShownLanes, rows: Floats) -> tuple[Floats, Floats]:
    """Return the lowest and the highest value of each lane, (lanes,); NaN without a value."""
    low, high = np.full((2, lanes.numbers.size), np.nan)
    for part, values in portions(lanes, rows):
        np.fmin.reduce(values, axis=1, out=low[part])
        np.fmax.reduce(values, axis=1, out=high[part])
    return low, high


def diagram_variables(result: Result) -> list[str]:
    """Return the variables that a diagram can show: sections first, then numbers of each lane.

    The last ones have a number for each Lyapunov exponent.
    """
    numbers = [v for v in result.variables.values() if v.dtype == "float64"]
    of_lanes = [v.name for v in numbers if v.dims == result.axes and v.name not in result.axes]
    spectrum = (*result.axes, EXPONENT_NUMBER)
    return [*section_variables(result), *of_lanes, *(v.name for v in numbers if v.dims == spectrum)]


def _diagram_variable(result: Result, variable: str | None) -> str:
    """Check the variable of a diagram, or return the default."""
    variable = variable or next(iter(section_variables(result)), DEFAULT_VARIABLE)
    kinds = result.variables[variable].flags if variable in result.variables else ()
    if kinds:
        listed = variable == LABELS[0] or variable.startswith(CONTACT_STATE)
        remedy = "gearchaos stages lists the values of each kind" if listed else "choose another"
        raise FigureError(
            f"{variable}: has kinds ({', '.join(kinds)}), and a diagram draws numbers; {remedy}"
        )
    check_variable(variable, diagram_variables(result), "of the diagram")
    return variable


def lyapunov(
    axes: Axes,
    result: Result,
    *,
    between: Between = (None, None),
    color: str = BLACK,
    label: str | None = None,
    marker: str = ".",
) -> Diagram:
    """Draw the largest Lyapunov exponent into axes, with zero line and uncertainty.

    Parameters
    ----------
    axes, result, between, color, label, marker
        As for `bifurcation`.

    Returns
    -------
    Diagram
        ``points`` is the line of the exponents. ``parts`` holds the line at ``zero``, the hatched
        ``positive`` part, the ``band`` and ``bars`` of two standard errors, and the ``dots`` of
        isolated exponents, or of all where a swept value has several starts.

    Raises
    ------
    FigureError
        If the result has no exponents, no lane in the range, or several swept parameters.

    Notes
    -----
    Diverged lanes are gaps with a red tick at the bottom; lanes beyond robust limits get a
    triangle. Zero is always within the limits. Where a page cannot resolve all lanes
    (`figures.lanes.COLUMNS`), only the lowest and the highest exponent of each column are drawn.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> drawn = figures.lyapunov(axes, gearchaos.open_result("pan2021.h5"))
    >>> bool(axes.get_xlim()[0] < 5.0 < axes.get_xlim()[1])
    True
    """
    shown = _exponents(result, between)
    look = {"color": color, "marker": marker, "label": label}
    line, parts = _draw_exponents(axes, result, shown, look)
    named: list[Artist] = [parts["band"]] if (shown.spread[shown.finite] > 0.0).any() else []
    named += _circle_mixed(axes, result, shown)
    if (shown.values[shown.finite & ~shown.isolated] > 0.0).any():
        named.append(Patch(fc="none", ec=GREY, lw=0.4, hatch=HATCH, label="positive exponent"))
    axes.set_ylabel(axis_label(result, LARGEST_EXPONENT, line_length=20))
    reach = np.nan_to_num(shown.spread)
    own = Diagram(line, shown.lanes, shown.values, shown.values, reach, named, parts)
    return close_panel(axes, result, own, hold_zero=True)


class _Exponents(NamedTuple):
    """Largest exponents of the lanes in a range, each array of shape (lanes,).

    ``values``: NaN where the lane diverged; ``spread``: two standard errors; ``isolated``: whether
    no line joins the exponent to a neighbour; ``drawn``: numbers of the lanes to draw.
    """

    lanes: ShownLanes
    values: Floats
    spread: Floats
    isolated: Mask
    drawn: Integers

    @property
    def finite(self) -> Mask:
        """Whether a lane has an exponent."""
        return np.isfinite(self.values)

    @property
    def several_starts(self) -> bool:
        """Whether several lanes have the same swept value."""
        return bool(np.any(np.diff(self.lanes.parameter) == 0.0))


def _exponents(result: Result, between: Between) -> _Exponents:
    """Select the exponents of a diagram; FigureError if the result has none."""
    if LARGEST_EXPONENT not in result:
        raise FigureError("the result has no Lyapunov exponents: the sweep left them out")
    lanes = diagram_lanes(result, between)
    values = result.lanes(LARGEST_EXPONENT)[lanes.numbers]
    values[lanes.diverged | np.isinf(values)] = np.nan
    error = result.lanes(LARGEST_EXPONENT + STANDARD_ERROR)[lanes.numbers]
    drawn = outermost(lanes, values)
    found = _Exponents(lanes, values, BAND_STANDARD_ERRORS * error, np.isfinite(values), drawn)
    # Several starts may lie on different motions, which no line should join.
    if found.several_starts:
        return found
    beside = np.pad(found.finite, 1)
    return found._replace(isolated=found.finite & ~(beside[2:] | beside[:-2]))


def _draw_exponents(
    axes: Axes, result: Result, shown: _Exponents, look: dict[str, Any]
) -> tuple[Line2D, dict[str, Any]]:
    """Draw line, dots, zero, positive part and uncertainty; return the line, the others by name."""
    lanes, color = shown.lanes, look["color"]
    arrays = lanes.parameter, shown.values, shown.spread, shown.isolated
    x, exponent, reach, alone = (array[shown.drawn] for array in arrays)
    joined = np.where(alone, np.nan, exponent)
    zero = axes.axhline(0.0, color=GREY, linewidth=0.5, linestyle=(0, (4, 2)), zorder=1)
    # Colours are left to the stages behind: hatching and uncertainty are grey.
    fill: dict[str, Any] = {"where": joined > 0.0, "interpolate": True, "hatch": HATCH}
    positive = axes.fill_between(x, 0.0, joined, fc="none", ec=GREY, lw=0.0, **fill)
    pale = _pale(color)
    fill = {"color": pale, "lw": 0.0, "label": TWO_ERRORS}
    band = axes.fill_between(x, joined - reach, joined + reach, **fill)
    ends = (exponent - reach)[alone], (exponent + reach)[alone]
    bars = axes.vlines(x[alone], *ends, colors=pale, lw=0.6)
    dash = "none" if shown.several_starts and alone.any() else DASHES.get(look["marker"], "-")
    (line,) = axes.plot(x, exponent, ls=dash, lw=LINE_PT, color=color, label=look["label"])
    rows = result.lanes(LARGEST_EXPONENT)[:, np.newaxis]
    dot = {"markersize": lanes.dot_size(1.0), "color": color, "marker": look["marker"]}
    points = dots(axes, lanes._replace(diverged=~shown.isolated), rows, **dot)
    return line, {"dots": points, "band": band, "bars": bars, "positive": positive, "zero": zero}


def _circle_mixed(axes: Axes, result: Result, shown: _Exponents) -> list[Line2D]:
    """Circle the exponents of lanes whose record begins on another motion than the labelled one."""
    if RECORD not in result:
        return []
    mixed = result.lanes(RECORD)[shown.lanes.numbers][shown.drawn] == 1
    if not mixed.any():
        return []
    x, exponent = (array[shown.drawn][mixed] for array in (shown.lanes.parameter, shown.values))
    look: dict[str, Any] = {"ms": 3.0, "mfc": "none", "mew": 0.5, "color": VERMILION}
    return axes.plot(x, exponent, "o", label="settled after a transient", **look)


def waterfall(axes: Axes, result: Result, variable: str, *, between: Between = (None, None)) -> Any:
    """Draw amplitudes over the swept parameter into axes, one row per mesh order.

    Parameters
    ----------
    axes, result, between
        As for `bifurcation`.
    variable : str
        Amplitudes such as "amplitude_transmission_error".

    Returns
    -------
    ScalarMappable
        The image, shape (orders, lanes). Its colours are logarithmic; lanes without amplitudes are
        grey.

    Raises
    ------
    FigureError
        If the amplitudes are missing, no lane is in the range, there are two swept parameters, or
        several lanes have the same value.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> result = gearchaos.open_result("speeds.h5")
    >>> drawn = figures.waterfall(axes, result, "amplitude_transmission_error")
    """
    there = [name for name in result if result.dims(name) == (*result.axes, ORDER)]
    check_variable(variable, there, "over mesh orders")
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
