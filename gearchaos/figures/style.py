"""How the figures look: sizes for a journal column, fonts, and colours that also print in grey."""

from typing import Any

import matplotlib as mpl

SINGLE_COLUMN_MM = 85.0
DOUBLE_COLUMN_MM = 180.0
MM_PER_INCH = 25.4

# Of Okabe and Ito: told apart by colour-blind readers, and by their lightness in grey.
BLACK = "#000000"
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
GREY = "#595959"

OVERLAID = ((BLACK, "."), (BLUE, "^"), (GREEN, "v"), (PURPLE, "s"), (ORANGE, "D"))
"""Colours and markers of several results in the same axes."""

SMALL_FONT_PT = 7.0
FONT_PT = 8.0

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

TICKS = {
    "labelsize": SMALL_FONT_PT,
    "direction": "in",
    "minor.visible": True,
    "major.size": 2.8,
    "minor.size": 1.5,
    "major.width": 0.5,
    "minor.width": 0.4,
}
"""Settings for the ticks of either axis."""

_STYLE: dict[Any, Any] = {
    # That of `save_figure`: what is measured for the layout is then known when the page is drawn.
    "figure.dpi": 300,
    # The STIX fonts come with matplotlib, so that a figure is the same on every machine.
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": FONT_PT,
    "axes.labelsize": FONT_PT,
    "axes.titlesize": FONT_PT,
    "axes.titleweight": "bold",
    "axes.titlepad": 3.0,
    "axes.titley": 1.0,
    "axes.labelpad": 2.5,
    "axes.linewidth": 0.6,
    "axes.formatter.use_mathtext": True,
    "legend.fontsize": SMALL_FONT_PT,
    "figure.titlesize": SMALL_FONT_PT,
    **{f"{axis}tick.{name}": value for axis in "xy" for name, value in TICKS.items()},
    "xtick.top": True,
    "ytick.right": True,
    "hatch.linewidth": 0.3,
    "figure.constrained_layout.h_pad": 0.02,
    "figure.constrained_layout.w_pad": 0.02,
    # Journals ask for TrueType; matplotlib's default, Type 3, cannot be edited.
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
    "svg.hashsalt": "gearchaos",
    # Ticks in front of what is drawn, so that EPS can make one picture of the latter.
    "axes.axisbelow": False,
}

# Whatever a user's settings say: the page is as large as the figure, and laid out once.
_LAYOUT: dict[Any, Any] = {
    "savefig.bbox": None,
    "figure.autolayout": False,
    "figure.constrained_layout.use": False,
}


def style() -> dict[Any, Any]:
    """Return settings for `matplotlib.rc_context`; what a user has set otherwise stays."""
    now, default = mpl.rcParams, mpl.rcParamsDefault
    return {
        **{key: now[key] if now[key] != default[key] else _STYLE[key] for key in _STYLE},
        **_LAYOUT,
    }
