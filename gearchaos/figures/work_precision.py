"""Work-precision diagram: error against steps per period and against computing time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from gearchaos.figures.page import Page, column, letter
from gearchaos.figures.style import BLACK, BLUE, LEGEND, ORANGE

LOOKS: tuple[dict[str, Any], ...] = (
    {"color": ORANGE, "marker": "o"},
    {"color": BLUE, "marker": "s"},
    {"color": BLACK, "marker": "^"},
)
HEIGHT_MM = 65.0


def work_precision_page(modes: Mapping[str, Sequence[tuple[int, float, float]]]) -> Page:
    """Draw the error against steps per period (a) and against time (b), all logarithmic.

    Parameters
    ----------
    modes : mapping of str to sequence of (int, float, float)
        Steps per mesh period, time in s and error by mode; at most as many modes as `LOOKS`. Points
        whose error is zero or not finite are left out.
    """
    with column(HEIGHT_MM) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for cost, label in enumerate(("Steps per period", "Time (s)")):
            axes, lines = panels[cost], []
            for (mode, points), look in zip(modes.items(), LOOKS, strict=False):
                known = [(one[cost], one[2]) for one in points if 0.0 < one[2] < np.inf]
                columns = zip(*known, strict=True) if known else ([], [])
                lines += axes.plot(*columns, label=mode, ms=3, lw=0.8, **look)
            axes.set(xlabel=label, xscale="log", yscale="log")
            axes.margins(0.08)
            axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.xaxis.set_minor_formatter(NullFormatter())
        # Times rarely span a decade; the default locator would label no tick or all of them.
        panels[1].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panels[0].set_ylabel("Error of section and exponent")
        letter(panels)
        figure.legend(handles=lines, loc="outside upper center", ncols=3, **LEGEND)
    return figure
