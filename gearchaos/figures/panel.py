"""Limits and legend of a diagram, and marks for lanes it cannot show."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from gearchaos.arrays import Floats
from gearchaos.figures.labels import axis_label, short
from gearchaos.figures.lanes import ShownLanes, columns
from gearchaos.figures.style import BLACK, GREY, LEGEND, VERMILION
from gearchaos.results.reading.result import Result

OUTLYING_SHARE = 0.03  # Share of the lanes at either end that limits may leave out.
WIDEST = 0.84  # Width of axes relative to that of a page with one panel in a row.
MARGIN = 0.05  # Margin of the limits, relative to their distance.

_DIAGRAM = "_gearchaos_diagram"
"""Attribute of the line of a diagram that holds the diagram."""


@dataclass(eq=False)
class Diagram:
    """The parts that one call has drawn into axes, and the range of their values.

    Attributes
    ----------
    points : Line2D
        Dots or line of the lanes.
    lanes : ShownLanes
        The lanes in the order of the arrays below.
    low, high : (lanes,)
        Lowest and highest value of each lane; NaN without a value.
    spread : (lanes,) or float
        Distance beyond ``low`` and ``high`` that the limits include.
    named : list of Artist
        Further entries of the legend.
    parts : dict
        Further parts by name.
    diverged : Line2D, optional
        Ticks of the diverged lanes.
    off_scale : list of Line2D
        Triangles for lanes beyond the bottom and the top.
    legend : Legend, optional
        The legend of all diagrams in the axes.
    """

    points: Line2D
    lanes: ShownLanes
    low: Floats
    high: Floats
    spread: Floats | float = 0.0
    named: list[Artist] = field(default_factory=list)
    parts: dict[str, Any] = field(default_factory=dict)
    diverged: Line2D | None = None
    off_scale: list[Line2D] = field(default_factory=list)
    legend: Legend | None = None


def close_panel(axes: Axes, result: Result, own: Diagram, *, hold_zero: bool = False) -> Diagram:
    """Set limits and the label of the parameter, and mark the lanes that cannot be shown.

    Limits and marks cover all diagrams in the axes; ``hold_zero`` is as for `robust_limits`.
    """
    # Stored in its line: clearing the axes removes it, and it does not outlive its figure.
    setattr(own.points, _DIAGRAM, own)
    drawn = [getattr(line, _DIAGRAM) for line in axes.lines if hasattr(line, _DIAGRAM)]
    left, right = zip(*(one.lanes.limits for one in drawn), strict=True)
    axes.set_xlim(min(left), max(right))
    axes.set_xlabel(axis_label(result, result.axis))
    color, label = own.points.get_color(), str(own.points.get_label())
    if not label.startswith("_"):
        sample = own.parts.get("line", own.points)
        shape = sample.get_marker(), sample.get_linestyle()
        look: dict[str, Any] = dict(zip(("marker", "ls"), shape, strict=True))
        look |= {"ms": 4.0, "lw": sample.get_linewidth()}
        own.named.insert(0, Line2D([], [], color=color, label=label, **look))
    if own.lanes.diverged.any():
        look = {"marker": "|", "ms": 8.0, "mew": 0.8, "color": VERMILION}
        parameter = own.lanes.parameter[own.lanes.diverged]
        own.diverged = _marks(axes, parameter, 0.0, "diverged", **look)
        own.named.append(own.diverged)
    least = np.concatenate([one.low - one.spread for one in drawn])
    most = np.concatenate([one.high + one.spread for one in drawn])
    there = np.isfinite(least)
    if there.any():
        axes.set_ylim(robust_limits(least[there], most[there], hold_zero=hold_zero))
    for one in drawn:
        for mark in one.off_scale:
            mark.remove()
        one.off_scale[:] = _mark_off_scale(axes, one)
    # Entries that several results have in common appear once.
    named = {str(mark.get_label()): mark for one in drawn for mark in one.named + one.off_scale}
    own.legend = legend_above(axes, list(named.values()))
    return own


def robust_limits(low: Floats, high: Floats, *, hold_zero: bool = False) -> tuple[float, float]:
    """Return limits that a few outlying lanes cannot stretch.

    Parameters
    ----------
    low, high : (lanes,)
        Lowest and highest value of each lane, all finite.
    hold_zero : bool
        Whether the limits must include zero.

    Returns
    -------
    (float, float)
        Lower and upper limit. If the outermost 3 % of the lanes at either end would take more than
        half of the height, lanes farther out than half of the inner height are left out.
    """
    bottom, top = float(low.min()), float(high.max())
    inner_bottom = float(np.quantile(low, OUTLYING_SHARE))
    inner_top = float(np.quantile(high, 1.0 - OUTLYING_SHARE))
    if hold_zero:
        bottom, inner_bottom = min(bottom, 0.0), min(inner_bottom, 0.0)
        top, inner_top = max(top, 0.0), max(inner_top, 0.0)
    inner = inner_top - inner_bottom
    if 0.0 < 2.0 * inner < top - bottom:
        bottom = min(inner_bottom, float(low[low >= inner_bottom - inner / 2.0].min()))
        top = max(inner_top, float(high[high <= inner_top + inner / 2.0].max()))
    pad = MARGIN * (top - bottom) or abs(top) * MARGIN or 0.5
    return bottom - pad, top + pad


def _mark_off_scale(axes: Axes, drawn: Diagram) -> list[Line2D]:
    """Draw a triangle at the edge of the axes for every lane that reaches beyond it."""
    low, high, (bottom, top) = drawn.low, drawn.high, axes.get_ylim()
    color = drawn.points.get_color()
    color = GREY if color == BLACK else color
    marks = []
    ends = (low < bottom, low, np.min, 0.02, "v"), (high > top, high, np.max, 0.98, "^")
    for beyond, values, extreme, height, marker in ends:
        if beyond.any():
            place = axes, drawn.lanes.parameter[beyond], height
            label = f"off scale (to {short(extreme(values[beyond]), 3)})"
            marks.append(_marks(*place, label, marker=marker, ms=2.2, mew=0.0, color=color))
    return marks


def _marks(axes: Axes, parameter: Floats, height: float, label: str, **look: Any) -> Line2D:
    """Draw marks at a height relative to that of the axes, at most one per column."""
    parameter = parameter[columns(parameter, axes.get_xlim())]
    look |= {"linestyle": "none", "transform": axes.get_xaxis_transform(), "zorder": 4}
    return axes.plot(parameter, np.full(parameter.size, height), label=label, **look)[0]


def mark_values(panels: Sequence[Axes], label: str, values: Sequence[float]) -> None:
    """Tick values of the parameter at the upper edge of panels, named in the legend of the first.

    The legend keeps its former entries.
    """
    look: dict[str, Any] = {"marker": "|", "ms": 8.0, "mew": 0.9, "color": VERMILION}
    ticks = [_marks(axes, np.asarray(values), 1.0, label, **look) for axes in panels]
    legend_above(panels[0], [ticks[0], *legend_entries(panels[0])])


def legend_entries(axes: Axes) -> list[Artist]:
    """Return the entries of the legend of axes with their names, which areas in it have lost."""
    legend = axes.get_legend()
    if legend is None:
        return []
    entries: list[Artist] = [one for one in legend.legend_handles if one is not None]
    for entry, text in zip(entries, legend.get_texts(), strict=True):
        entry.set_label(text.get_text())
    return entries


def legend_above(axes: Axes, handles: Sequence[Artist]) -> Legend | None:
    """Place a legend above the right end of the axes; None without entries."""
    if not handles:
        return None
    # Widths in points: a column takes its mark, its gaps and 3.2 for each letter.
    # The layout, which comes later, gives the axes more of the page than they have now.
    figure: Any = axes.figure
    room = 72.0 * max(axes.get_position().width, WIDEST) * figure.get_size_inches()[0]
    column = 17.0 + 3.2 * max(len(str(one.get_label())) for one in handles)
    most = int(np.clip(room // column, 1, 3))
    columns = -(-len(handles) // -(-len(handles) // most))
    place: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.3}
    return axes.legend(handles=handles, ncols=columns, **place, **LEGEND)
