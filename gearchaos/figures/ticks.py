"""Ticks that are laid out and drawn in less than half of matplotlib's time, and look the same."""

from typing import Any

from matplotlib.artist import Artist
from matplotlib.axis import Axis, XAxis
from matplotlib.ticker import NullFormatter, ScalarFormatter

from gearchaos.figures.style import FONT_PT


def light(axes: Any) -> None:
    """Let what is slow of the ticks of finished axes be drawn by what follows in this module."""
    for axis in (axes.xaxis, axes.yaxis):
        if type(axis.get_major_formatter()) is ScalarFormatter:
            axis.set_major_formatter(PlainNumbers())
        if isinstance(axis.get_minor_formatter(), NullFormatter):
            axes.add_artist(FineTicks(axis))
    # A power of ten stands where titles do, which look for none: that takes long.
    formatter = axes.yaxis.get_major_formatter()
    formatter.format_ticks(axes.yaxis.get_majorticklocs().tolist())
    if formatter.get_offset():
        pad = 72.0 * axes.titleOffsetTrans.get_matrix()[1, 2] / axes.figure.dpi
        axes.set_title(axes.get_title(), pad=pad + 1.25 * FONT_PT)


class PlainNumbers(ScalarFormatter):
    """Numbers as plain text, and a power of ten that all have in common as a formula."""

    def __init__(self) -> None:
        super().__init__(useMathText=False)

    def get_offset(self) -> str:
        """Return the power of ten."""
        self.set_useMathText(True)
        offset = super().get_offset()
        self.set_useMathText(False)
        return offset


class FineTicks(Artist):
    """The ticks without numbers of one axis, of which only one is made, to be drawn at all places.

    Their places are those of the minor locator of the axis at the time of drawing.
    """

    def __init__(self, axis: Axis) -> None:
        super().__init__()
        # Over the frame, as the axis itself is.
        self.set(in_layout=False, zorder=axis.get_zorder() + 0.01)
        tick = axis.get_minor_ticks(1)[0]
        self._axis, self._along_x = axis, isinstance(axis, XAxis)
        lines = tick.tick1line, tick.tick2line
        self._ends = [(line, end) for end, line in enumerate(lines) if line.get_visible()]
        parts: Any = ("left", "right", "bottom", "top")
        axis.set_tick_params(which="minor", **{n: False for p in parts for n in (p, f"label{p}")})
        for line, _ in self._ends:
            line.set_visible(True)

    def draw(self, renderer: Any) -> None:
        """Draw the ticks between the ends of the axis."""
        low, high = sorted(self._axis.get_view_interval())
        places = [place for place in self._axis.get_minorticklocs() if low <= place <= high]
        for line, end in self._ends:
            ends = [end] * len(places)
            line.set_data(*((places, ends) if self._along_x else (ends, places)))
            line.draw(renderer)
