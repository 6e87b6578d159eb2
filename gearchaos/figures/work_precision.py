"""Error against steps and against time: what accuracy costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from gearchaos.figures.page import Page, letter, page
from gearchaos.figures.style import BLACK, BLUE, LEGEND, ORANGE, SINGLE_COLUMN_MM

LOOKS: dict[str, dict[str, Any]] = {
    "plain": {"color": ORANGE, "marker": "o"},
    "resolved": {"color": BLUE, "marker": "s"},
    "flow map": {"color": BLACK, "marker": "^"},
}
HEIGHT_MM = 65.0

Points = Sequence[tuple[float, float]]


def work_precision(axes: Axes, modes: Mapping[str, Points]) -> list[Line2D]:
    """Draw the error of each mode against what it costs, both logarithmic.

    Parameters
    ----------
    axes : Axes
    modes : mapping of str to sequence of (cost, error)
        Points without an error are left out.
    """
    lines = []
    for mode, points in modes.items():
        known = [point for point in points if np.isfinite(point[1]) and point[1] > 0.0]
        columns = zip(*known, strict=True) if known else ([], [])
        lines += axes.plot(*columns, label=mode, markersize=3, linewidth=0.8, **LOOKS[mode])
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(0.08)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    return lines


def work_precision_page(
    modes: Mapping[str, Sequence[tuple[int, float, float]]], width_mm: float = SINGLE_COLUMN_MM
) -> Page:
    """Draw the error against the steps per period and against the time as a figure of its own.

    Parameters
    ----------
    modes : mapping of str to sequence of (steps, seconds, error)
    width_mm : float
    """
    with page(width_mm, HEIGHT_MM) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for cost, label in enumerate(("Steps per mesh period", "Time (s)")):
            chosen = {mode: [(one[cost], one[2]) for one in modes[mode]] for mode in modes}
            lines = work_precision(panels[cost], chosen)
            panels[cost].set_xlabel(label)
        # Times rarely span a decade, within which nothing would be labelled, or everything.
        panels[1].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panels[0].set_ylabel("Error of section and exponent")
        letter(panels)
        figure.legend(handles=lines, loc="outside upper center", ncols=3, **LEGEND)
    return figure
