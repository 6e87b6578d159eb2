"""Error against time: what accuracy costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from gearchaos.figures.page import Page, page
from gearchaos.figures.style import BLACK, BLUE, ORANGE, SINGLE_COLUMN_MM

LOOKS: dict[str, dict[str, Any]] = {
    "plain": {"color": ORANGE, "marker": "o"},
    "resolved": {"color": BLUE, "marker": "s"},
    "flow map": {"color": BLACK, "marker": "^"},
}
HEIGHT_MM = 65.0

Points = Sequence[tuple[float, float, int]]


def work_precision(axes: Axes, modes: Mapping[str, Points]) -> list[Line2D]:
    """Draw the error of each mode against its time, both logarithmic.

    Parameters
    ----------
    axes : Axes
    modes : mapping of str to sequence of (seconds, error, steps)
        Points are labelled with their steps; those without an error are left out.
    """
    lines = []
    for mode, points in modes.items():
        known = [point for point in points if np.isfinite(point[1]) and point[1] > 0.0]
        seconds, errors = ([point[column] for point in known] for column in (0, 1))
        lines += axes.plot(seconds, errors, label=mode, markersize=3, linewidth=0.8, **LOOKS[mode])
        # Labels of neighbouring modes keep apart: above to the right, below to the left.
        offset, side = ((3, 3), "left") if mode == "plain" else ((-3, -7), "right")
        for x, y, steps in known:
            axes.annotate(
                f"{steps}",
                (x, y),
                offset,
                textcoords="offset points",
                fontsize=6,
                ha=side,
                color=LOOKS[mode]["color"],
            )
    axes.set_xscale("log")
    axes.set_yscale("log")
    # Times rarely span a decade, within which nothing would be labelled, or everything.
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(0.12)
    axes.set_xlabel("Time (s)")
    axes.set_ylabel("Error of section and exponent")
    axes.legend(frameon=False)
    return lines


def work_precision_page(modes: Mapping[str, Points], width_mm: float = SINGLE_COLUMN_MM) -> Page:
    """Draw `work_precision` as a figure of its own."""
    with page(width_mm, HEIGHT_MM) as figure:
        work_precision(figure.add_subplot(), modes)
    return figure
