"""How the figures look: sizes for a journal column, and colours that also print in grey."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any

import matplotlib as mpl

from gearchaos.errors import FigureError

SINGLE_COLUMN_MM = 85.0
DOUBLE_COLUMN_MM = 180.0
MM_PER_INCH = 25.4

# Colours of Okabe and Ito: colour-blind readers can distinguish them, and so can print in grey.
BLACK = "#000000"
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
GREY = "#595959"

OVERLAID = ((BLACK, "."), (BLUE, "^"), (GREEN, "v"), (PURPLE, "s"), (ORANGE, "D"))
"""Colours and markers of several results in the same axes."""

DASHES: dict[str, Any] = {
    ".": "-",
    "^": (0, (4, 2)),
    "v": (0, (1.5, 1.5)),
    "s": (0, (6, 2, 1.5, 2)),
    "D": (0, (8, 2)),
}
"""Dashes of the lines of several results, by the marker of their dots; all have one width."""

_STYLE = mpl.rc_params_from_file(
    Path(__file__).with_name("journal.mplstyle"), use_default_template=False
)
SMALL_FONT_PT = _STYLE["legend.fontsize"]
FONT_PT = _STYLE["font.size"]

LEGEND: dict[str, Any] = {
    "frameon": False,
    "fontsize": SMALL_FONT_PT,
    "title_fontsize": SMALL_FONT_PT,
    "borderpad": 0.0,
    "handlelength": 1.0,
    "handletextpad": 0.4,
    "columnspacing": 1.0,
}
"""Arguments of a legend outside of the axes."""


DRAWING = RLock()
"""Held by the thread that draws or writes a page.

Matplotlib's settings and its parser of formulae are global to the process.
"""
if hasattr(os, "register_at_fork"):
    # A process forked while a page is drawn would keep the settings, and never release the lock.
    os.register_at_fork(
        before=DRAWING.acquire, after_in_parent=DRAWING.release, after_in_child=DRAWING.release
    )


@contextmanager
def with_font(name: str | None) -> Iterator[None]:
    """Set the font of all texts but formulae within a context; None leaves it unchanged.

    Raises FigureError if matplotlib does not find the font.
    """
    if name is None:
        yield
        return
    from matplotlib.font_manager import findfont

    try:
        findfont(name, fallback_to_default=False)
    except ValueError:
        rule = "is no font that matplotlib finds; install it, or give another one"
        raise FigureError(f"--font {name}: {rule}, such as DejaVu Sans") from None
    with mpl.rc_context({"font.family": name}):
        yield


@contextmanager
def styled(settings: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Set the project's style within a context; other threads wait before they draw pages.

    ``settings``: of matplotlib, in place of those of the style.
    """
    with DRAWING, mpl.rc_context(style() | dict(settings or {})):
        yield


def style() -> dict[Any, Any]:
    """Return the settings of `styled`; settings that the user has changed are kept."""
    now, default = mpl.rcParams, mpl.rcParamsDefault
    return {
        **{key: now[key] if now[key] != default[key] else _STYLE[key] for key in _STYLE},
        # Overridden in any case: a page has the size of its figure, and is laid out once.
        "savefig.bbox": None,
        "figure.autolayout": False,
        "figure.constrained_layout.use": False,
    }
