"""What the figures of the gallery have in common: a page of stacked panels, lettered."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.ticker import AutoMinorLocator, MaxNLocator

from gearchaos.figures.page import Page
from gearchaos.figures.style import MM_PER_INCH, SINGLE_COLUMN_MM, SMALL_FONT_PT, STYLE

WITHOUT_ERROR, WITH_ERROR = "#0072B2", "#D55E00"
"""Blue and vermilion of Okabe and Ito: without and with pitch error."""

SHOWN_PERIODS = 4.0


@contextmanager
def page(height_mm: float) -> Iterator[Page]:
    """Make a page as wide as one column of a journal; what is drawn has the project's style."""
    with mpl.rc_context(STYLE):
        size = (SINGLE_COLUMN_MM / MM_PER_INCH, height_mm / MM_PER_INCH)
        figure = Page(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        # Ticks are made at the first drawing, in the style of that moment.
        figure.draw_without_rendering()
        # The layout is found; looking for it again takes longer than the drawing itself.
        figure.set_layout_engine("none")


def letter(panels: Iterable[Axes]) -> None:
    """Write (a), (b), ... above the left end of the panels."""
    for number, axes in enumerate(panels):
        axes.set_title(f"({chr(ord('a') + number)})", loc="left")


def letter_inside(panels: Iterable[Axes]) -> None:
    """Write (a), (b), ... into the upper left corner of panels whose top is taken."""
    for number, axes in enumerate(panels):
        axes.text(
            0.02,
            0.94,
            f"({chr(ord('a') + number)})",
            transform=axes.transAxes,
            va="top",
            fontweight="bold",
        )


def remark_inside(axes: Axes, text: str) -> None:
    """Write a few words into the upper right corner of a panel."""
    axes.text(
        0.985,
        0.93,
        text,
        transform=axes.transAxes,
        ha="right",
        va="top",
        fontsize=SMALL_FONT_PT,
    )


def remark(axes: Axes, text: str) -> None:
    """Write a few words above the right end of a panel."""
    axes.set_title(text, loc="right", fontsize=SMALL_FONT_PT, fontweight="normal")


def few_ticks(axes: Axes, x: int | None = 5, y: int | None = 4) -> None:
    """Leave so many intervals at most on the axes of a small panel; None leaves an axis alone."""
    for axis, most in ((axes.xaxis, x), (axes.yaxis, y)):
        if most is not None:
            axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
            axis.set_minor_locator(AutoMinorLocator())
