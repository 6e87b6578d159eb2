"""Which share of the gear pairs moves in which way: how much pitch error a pair may have."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.container import Container
from matplotlib.ticker import MaxNLocator, NullLocator

from gearchaos.figures.labels import axis_label, in_words, legend_title
from gearchaos.figures.lanes import Between, Floats, cell_edges, diagram_lanes
from gearchaos.figures.page import Page, few_ticks, letter, page, remark
from gearchaos.figures.stages import SHADES, look_of
from gearchaos.figures.style import BLACK, LEGEND, SINGLE_COLUMN_MM, SMALL_FONT_PT
from gearchaos.results.result import Result
from gearchaos.results.shares import Counted, motion_shares
from gearchaos.results.variables import REPEATS

Drawn = Artist | Container

MOST_BARS = 24
"""More values than these are steps side by side, with a band instead of bars of confidence."""


def shares(
    axes: Axes, result: Result, *, between: Between = (None, None), contact: Axes | None = None
) -> list[Drawn]:
    """Draw the shares of all motions of each value on top of each other, period 1 as the highest.

    The edge below period 1 is so the share of motions that are not period 1, those diverged or
    unresolved among them; drawn around it is its confidence interval of 95 % (Wilson 1927), which
    takes gear pairs and starts for independent.

    Parameters
    ----------
    axes, result, between
        As for `bifurcation`, with labels of the motion of several gear pairs or starts.
    contact : matplotlib.axes.Axes, optional
        Where to draw the share of motions whose teeth lose contact, if the result tells.

    Returns
    -------
    list
        What is drawn into the first axes, with labels, in the order of a legend.

    Raises
    ------
    FigureError
        If there is no lane in the range, or two swept parameters.
    ConfigurationError, FileError
        If the result has neither several gear pairs nor several starts, or no labels.
    """
    limits, counted = diagram_lanes(result, between).limits, motion_shares(result)
    values, known = counted.values, list(dict.fromkeys([*SHADES, *counted.motions]))
    base, layers = np.zeros(values.size), []
    for motion in sorted(counted.motions, key=known.index, reverse=True):
        top = base + counted.counts[:, counted.motions.index(motion)] / counted.other.lanes
        layers.append(layer(axes, values, base, top, label=motion, **look_of(motion)))
        base = top
    layers.insert(0, _confidence(axes, values, counted.other, "none"))
    axes.set_ylabel("Share of motions")
    if contact and counted.apart:
        _confidence(contact, values, counted.apart, "o")
        contact.set_ylabel("Share that\nloses contact", linespacing=1.0)
    for one in filter(None, (axes, contact)):
        one.set(xlim=limits, ylim=(-0.03, 1.03), xlabel=axis_label(result, result.axis))
        few_ticks(one, 8, 6)
        if values.size <= MOST_BARS and not np.any(values % 1.0):
            one.xaxis.set_major_locator(MaxNLocator(10, integer=True))
            one.xaxis.set_minor_locator(NullLocator())
    return layers[::-1]


def shares_page(
    result: Result,
    between: Between = (None, None),
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw the shares of all motions (a) over the share that loses contact (b), if that is known.

    Parameters and errors as for `shares`; width and height are those of the page.
    """
    panels = 2 if motion_shares(result).apart else 1
    height = height_mm or (60.0 + 0.35 * width_mm) * (1.0 if panels == 2 else 0.7)
    with page(width_mm, height) as figure:
        ratios = (1.6, 1.0)[:panels]
        stack = figure.subplots(panels, 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
        contact = stack[-1] if panels == 2 else None
        drawn = shares(stack[0], result, between=between, contact=contact)
        if panels == 2:
            stack[0].set_xlabel("")
            letter(stack)
        names = zip(REPEATS, ("gear pairs", "starts"), strict=True)
        sizes = [f"{result[axis].size} {name}" for axis, name in names if axis in result.axes]
        remark(stack[0], f"{' with '.join(sizes)} each")
        if result.fixed:
            figure.suptitle(in_words(result, result.fixed), fontsize=SMALL_FONT_PT)
        look = {"title_fontsize": SMALL_FONT_PT, "loc": "outside lower center", **LEGEND}
        figure.legend(handles=drawn, title=legend_title(result), ncols=3, **look)
        figure.align_ylabels(stack)
    return figure


def layer(axes: Axes, values: Floats, base: Floats, top: Floats, **look: Any) -> Drawn:
    """Draw one of several shares on top of each other, from base to top, both (values,)."""
    if values.size <= MOST_BARS:
        width = 0.8 * (np.diff(values).min() if values.size > 1 else 1.0)
        return axes.bar(values, top - base, width, base, linewidth=0.3, **look)
    return axes.stairs(top, cell_edges(values), baseline=base, fill=True, linewidth=0.0, **look)


def _confidence(axes: Axes, values: Floats, counted: Counted, marker: str) -> Drawn:
    """Draw shares with their intervals of confidence: bars at few values, a band over many."""
    label = "not period 1, 95 % confidence"
    share, (low, high) = counted.shares, counted.intervals.T
    if values.size <= MOST_BARS:
        look: dict[str, Any] = {
            "fmt": marker,
            "ms": 2.5,
            "lw": 0.7,
            "capsize": 1.5,
            "capthick": 0.7,
        }
        reach = (share - low, high - share)
        return axes.errorbar(values, share, reach, color=BLACK, label=label, **look)
    axes.plot(values, share, color=BLACK, linewidth=0.6, drawstyle="steps-mid")
    band: dict[str, Any] = {"step": "mid", "color": BLACK, "alpha": 0.25, "linewidth": 0.0}
    return axes.fill_between(values, low, high, label=label, **band)
