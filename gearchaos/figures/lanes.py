"""Which lanes a panel shows, how far its axes reach, and how it marks what it cannot show."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from gearchaos.errors import ConfigurationError
from gearchaos.figures.labels import number, plain
from gearchaos.figures.style import DIVERGED, REFERENCE, SMALL_FONT_PT
from gearchaos.results.result import Result

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Between = tuple[float | None, float | None]

OUTLYING_SHARE = 0.03
MARGIN = 0.05


def select_lanes(result: Result, between: Between = (None, None)) -> tuple[Floats, Mask, Mask]:
    """Return the parameter of every lane, which lanes are asked for and which diverged.

    Parameters
    ----------
    result : Result
    between : (float or None, float or None)
        Lowest and highest parameter value, both included; None: as far as the sweep goes.

    Returns
    -------
    parameter : ndarray of float, shape (lanes,)
    chosen : ndarray of bool, shape (lanes,)
    diverged : ndarray of bool, shape (lanes,)
        Lanes with any status but 0.

    Raises
    ------
    ConfigurationError
        If no lane lies in between.
    """
    parameter = np.asarray(result[result.axis], dtype=np.float64)
    low, high = between
    chosen = np.isfinite(parameter)
    if low is not None:
        chosen &= parameter >= low
    if high is not None:
        chosen &= parameter <= high
    if not chosen.any():
        wanted = (
            f"from {low if low is not None else '...'} to {high if high is not None else '...'}"
        )
        there = f"{parameter.min():g} to {parameter.max():g}" if parameter.size else "no lane"
        raise ConfigurationError(f"no lane with {result.axis} {wanted}; the result has {there}")
    if "status" in result:
        return parameter, chosen, result["status"] != 0
    return parameter, chosen, np.zeros(parameter.shape, dtype=bool)


def parameter_limits(parameter: Floats, between: Between = (None, None)) -> tuple[float, float]:
    """Return the ends of the parameter axis: those asked for, otherwise those of the lanes."""
    low = float(parameter.min()) if between[0] is None else between[0]
    high = float(parameter.max()) if between[1] is None else between[1]
    if low < high:
        return low, high
    pad = abs(low) * MARGIN or 0.5
    return low - pad, high + pad


def robust_limits(
    low: Floats, high: Floats, *, hold_zero: bool = False, full_range: bool = False
) -> tuple[float, float]:
    """Return limits that a few outlying lanes cannot stretch.

    Where the outermost 3 % of the lanes at either end would take more than half of the height
    from all the others, those that lie far out are left out; `mark_off_scale` then says so.

    Parameters
    ----------
    low, high : ndarray of float, shape (lanes,)
        Lowest and highest value of each lane, all finite.
    hold_zero : bool
        Zero is part of what is to be shown.
    full_range : bool
        Show every lane however far it lies.
    """
    bottom, top = float(low.min()), float(high.max())
    inner_bottom = float(np.quantile(low, OUTLYING_SHARE))
    inner_top = float(np.quantile(high, 1.0 - OUTLYING_SHARE))
    if hold_zero:
        bottom, inner_bottom = min(bottom, 0.0), min(inner_bottom, 0.0)
        top, inner_top = max(top, 0.0), max(inner_top, 0.0)
    inner = inner_top - inner_bottom
    if not full_range and 0.0 < 2.0 * inner < top - bottom:
        bottom = min(inner_bottom, float(low[low >= inner_bottom - inner / 2.0].min()))
        top = max(inner_top, float(high[high <= inner_top + inner / 2.0].max()))
    pad = MARGIN * (top - bottom) or abs(top) * MARGIN or 0.5
    return bottom - pad, top + pad


def mark_diverged(axes: Axes, result: Result, parameter: Floats) -> Line2D | None:
    """Draw a rug of red ticks at the bottom of the axes where lanes diverged."""
    if parameter.size == 0:
        return None
    (rug,) = axes.plot(
        parameter,
        np.zeros(parameter.size),
        linestyle="none",
        marker="|",
        markersize=8.0,
        markeredgewidth=0.8,
        color=DIVERGED,
        transform=axes.get_xaxis_transform(),
        zorder=4,
        label=_failure_meaning(result),
    )
    return rug


def mark_off_scale(axes: Axes, parameter: Floats, low: Floats, high: Floats) -> list[Line2D]:
    """Draw a triangle at the edge of the axes for every lane that reaches beyond it."""
    bottom, top = axes.get_ylim()
    marks = []
    for beyond, height, marker, end in (
        (low < bottom, 0.02, "v", low),
        (high > top, 0.98, "^", high),
    ):
        if beyond.any():
            extreme = end[beyond].min() if marker == "v" else end[beyond].max()
            marks += axes.plot(
                parameter[beyond],
                np.full(np.count_nonzero(beyond), height),
                linestyle="none",
                marker=marker,
                markersize=2.2,
                markeredgewidth=0.0,
                color=REFERENCE,
                transform=axes.get_xaxis_transform(),
                zorder=4,
                label=f"off scale (to {number(float(extreme))})",
            )
    return marks


def say_nothing_to_show(axes: Axes, lanes: int, diverged: int) -> None:
    """Write into an empty panel why it is empty."""
    reason = f"all {lanes} lanes diverged" if lanes == diverged else "no finite values"
    axes.tick_params(axis="y", which="both", left=False, right=False, labelleft=False)
    axes.text(
        0.5,
        0.5,
        reason,
        transform=axes.transAxes,
        ha="center",
        va="center",
        backgroundcolor="white",
    )


def legend_above(axes: Axes, artists: Iterable[Artist | None]) -> Legend | None:
    """Place a legend above the right end of the axes, where it hides nothing."""
    handles = [artist for artist in artists if artist is not None]
    if not handles:
        return None
    return axes.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=len(handles),
        frameon=False,
        fontsize=SMALL_FONT_PT,
        borderpad=0.0,
        borderaxespad=0.3,
        handlelength=1.0,
        handletextpad=0.4,
        columnspacing=1.0,
    )


def _failure_meaning(result: Result) -> str:
    meanings = str(result.attributes("status").get("flag_meanings", "")).split()
    return plain(meanings[1].replace("_", " ")) if len(meanings) == 2 else "diverged"
