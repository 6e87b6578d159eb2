"""A page for a journal: its size and style, and what is written beside its panels."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from io import BytesIO

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import AutoMinorLocator, MaxNLocator

from gearchaos.figures.style import MM_PER_INCH, SINGLE_COLUMN_MM, SMALL_FONT_PT, style

NOTEBOOK_DPI = 200


class Page(Figure):
    """A matplotlib figure that a notebook shows by itself, without pyplot."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        with mpl.rc_context(style()):
            self.savefig(picture, format="png", dpi=NOTEBOOK_DPI)
        return picture.getvalue()


@contextmanager
def page(width_mm: float, height_mm: float) -> Iterator[Page]:
    """Make a page of this size; what is drawn on it meanwhile has the project's style."""
    with mpl.rc_context(style()):
        size = (width_mm / MM_PER_INCH, height_mm / MM_PER_INCH)
        figure = Page(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        # Ticks are made at the first drawing, in the style of that moment.
        figure.draw_without_rendering()
        # The layout is found; looking for it again takes longer than the drawing itself. The engine
        # "none" would have every page drawn twice.
        figure.set_layout_engine(None)


column = partial(page, SINGLE_COLUMN_MM)
"""Make a page as wide as one column of a journal, of a height in millimetres."""


def letter(panels: Iterable[Axes]) -> None:
    """Write (a), (b), ... above the left end of the panels."""
    for name, axes in zip("abcdefghij", panels, strict=False):
        axes.set_title(f"({name})", loc="left")


def remark(axes: Axes, text: str) -> None:
    """Write a few words above the right end of a panel."""
    axes.set_title(text, loc="right", fontsize=SMALL_FONT_PT, fontweight="normal")


def footnote(figure: Figure, text: str) -> None:
    """Write a line at the foot of a page; nothing where there is no text."""
    if text:
        figure.supxlabel(text, fontsize=SMALL_FONT_PT, color="0.4", x=0.99, ha="right")


def few_ticks(axes: Axes, x: int | None = 5, y: int | None = 4) -> None:
    """Leave so many intervals at most on the axes of a panel; None leaves an axis alone."""
    for axis, most in ((axes.xaxis, x), (axes.yaxis, y)):
        if most is not None:
            axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
            axis.set_minor_locator(AutoMinorLocator())
