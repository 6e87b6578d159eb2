"""The Lyapunov chart: largest exponent against the swept parameter, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from gearchaos.errors import ConfigurationError
from gearchaos.figures.labels import axis_label
from gearchaos.figures.lanes import (
    Between,
    Floats,
    Mask,
    legend_above,
    mark_diverged,
    mark_off_scale,
    parameter_limits,
    robust_limits,
    say_nothing_to_show,
    select_lanes,
)
from gearchaos.figures.style import EXPONENT, POSITIVE, REFERENCE
from gearchaos.results.result import Result

VARIABLE = "lyapunov_exponent"
ERROR_VARIABLE = "lyapunov_exponent_standard_error"
BAND_STANDARD_ERRORS = 2.0


@dataclass(frozen=True)
class LyapunovArtists:
    """What `lyapunov` has drawn.

    Attributes
    ----------
    line : Line2D
        The exponent in the order of the parameter, NaN where a lane diverged.
    points : Line2D
        Exponents without a neighbour to draw a line to: between diverged lanes, or all of
        them where a parameter value has several starts.
    band, bars : PolyCollection, LineCollection
        Two standard errors to either side, of the line and of the points.
    positive : PolyCollection
        The area between a positive exponent and zero.
    zero : Line2D
    diverged : Line2D or None
        The rug of diverged lanes.
    off_scale : list of Line2D
        Triangles for lanes beyond the bottom and beyond the top.
    legend : Legend or None
    """

    line: Line2D
    points: Line2D
    band: PolyCollection
    bars: LineCollection
    positive: PolyCollection
    zero: Line2D
    diverged: Line2D | None
    off_scale: list[Line2D]
    legend: Legend | None


def lyapunov(
    axes: Axes,
    result: Result,
    *,
    between: Between = (None, None),
    full_range: bool = False,
    legend: bool = True,
) -> LyapunovArtists:
    """Draw the largest Lyapunov exponent into axes, with zero line and uncertainty.

    Diverged lanes are gaps with a red tick at the bottom; a positive exponent is shaded down
    to zero; the vertical axis always holds zero, and lanes beyond robust limits get a triangle.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    result : Result
    between : (float or None, float or None)
        The part of the parameter range to show.
    full_range : bool
        Let the vertical axis reach every exponent, however few lie far out.
    legend : bool
        Put a legend above the axes.

    Returns
    -------
    LyapunovArtists

    Raises
    ------
    ConfigurationError
        If the result has no Lyapunov exponents, or no lane in the range.
    """
    if VARIABLE not in result:
        raise ConfigurationError("the result has no Lyapunov exponents: the sweep left them out")
    parameter, chosen, diverged = select_lanes(result, between)
    lanes = np.flatnonzero(chosen)
    lanes = lanes[np.argsort(parameter[lanes], kind="stable")]
    x = parameter[lanes]
    exponent = np.where(diverged, np.nan, result[VARIABLE])[lanes]
    reach = BAND_STANDARD_ERRORS * _standard_error(result)[lanes]
    lower, upper = exponent - reach, exponent + reach
    alone = _without_neighbours(x, exponent)
    joined = np.where(alone, np.nan, exponent)

    zero = axes.axhline(0.0, color=REFERENCE, linewidth=0.5, linestyle=(0, (4, 2)), zorder=1)
    positive = axes.fill_between(
        x, 0.0, joined, where=joined > 0.0, interpolate=True, color=POSITIVE, alpha=0.4, lw=0.0
    )
    band = axes.fill_between(
        x,
        np.where(alone, np.nan, lower),
        np.where(alone, np.nan, upper),
        color=EXPONENT,
        alpha=0.35,
        linewidth=0.0,
        label="\N{PLUS-MINUS SIGN}2 standard errors",
    )
    bars = axes.vlines(x[alone], lower[alone], upper[alone], colors=EXPONENT, lw=0.6, alpha=0.5)
    (line,) = axes.plot(x, exponent, color=EXPONENT, linewidth=0.6)
    (points,) = axes.plot(
        x[alone],
        exponent[alone],
        linestyle="none",
        marker=".",
        markersize=float(np.clip(300.0 / x.size, 1.0, 3.0)),
        markeredgewidth=0.0,
        color=EXPONENT,
    )
    if alone.any() and _repeats(x):
        line.set_linestyle("none")

    axes.set_xlim(parameter_limits(x, between))
    axes.set_xlabel(axis_label(result, result.axis))
    axes.set_ylabel(axis_label(result, VARIABLE, line_length=20))
    rug = mark_diverged(axes, result, parameter[chosen & diverged])
    off_scale = _set_limits(axes, x, exponent, reach, full_range)
    if not np.isfinite(exponent).any():
        say_nothing_to_show(axes, x.size, int(np.count_nonzero(chosen & diverged)))
    spread = band if np.isfinite(reach[np.isfinite(exponent)]).any() else None
    entries = legend_above(axes, [spread, rug, *off_scale]) if legend else None
    return LyapunovArtists(line, points, band, bars, positive, zero, rug, off_scale, entries)


def _standard_error(result: Result) -> Floats:
    if ERROR_VARIABLE in result:
        return np.asarray(result[ERROR_VARIABLE], dtype=np.float64)
    return np.full(result[VARIABLE].shape, np.nan)


def _repeats(x: Floats) -> bool:
    return bool(np.any(np.diff(x) == 0.0))


def _without_neighbours(x: Floats, exponent: Floats) -> Mask:
    there = np.isfinite(exponent)
    if _repeats(x):
        # Several starts may lie on different motions, which no line should join.
        return there
    beside = np.zeros(x.size, dtype=bool)
    beside[1:] |= there[:-1]
    beside[:-1] |= there[1:]
    return there & ~beside


def _set_limits(
    axes: Axes, x: Floats, exponent: Floats, reach: Floats, full_range: bool
) -> list[Line2D]:
    there = np.isfinite(exponent)
    if not there.any():
        axes.set_ylim(-1.0, 1.0)
        return []
    spread = np.nan_to_num(reach[there])
    low, high = exponent[there] - spread, exponent[there] + spread
    axes.set_ylim(robust_limits(low, high, hold_zero=True, full_range=full_range))
    return mark_off_scale(axes, x[there], exponent[there], exponent[there])
