"""Basins of attraction over two states of the start, and their shares over a swept parameter."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label, in_words, legend_title
from gearchaos.figures.lanes import diagram_lanes
from gearchaos.figures.page import Page, few_ticks, page
from gearchaos.figures.shares import Drawn, layer
from gearchaos.figures.stages import look_of
from gearchaos.figures.style import BLACK, LEGEND, SINGLE_COLUMN_MM, SMALL_FONT_PT
from gearchaos.results.basins import Basin, Basins
from gearchaos.results.units import unit_of
from gearchaos.results.variables import STATE_WORDING

COLORS = ("#D6E6F3", "#EDBE62", "#5DB898", "#C284AD", "#B4602F", "#4C6E8E")
MARKERS = ("o", "^", "s", "D", "v", "P")
"""Of attractors by their numbers, over and over again; lightness tells them apart in grey."""

MOST_POINTS = 500
"""Section points that are drawn of an attractor."""


def basins(axes: Axes, found: Basins, value: int = 0) -> AxesImage:
    """Draw the basins over the two states of a grid of starts, with the attractors on top.

    Every start is a cell in the colour of its attractor; markers are the section points of the
    attractors that lie within the axes.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    found : Basins
        From `find_basins`, of starts on a grid over two states.
    value : int
        Which of its values of the parameter.

    Raises
    ------
    FigureError
        If the starts are no such grid.
    """
    if len(found.grid) != 2:
        raise FigureError(
            'basins are drawn over two states: set start.kind = "grid" and name two states in '
            "start.box; of other starts, their shares are drawn over several values of a parameter"
        )
    here = [one for one in found.basins if one.value == found.values[value]]
    numbers = [one.number for one in here]
    place = np.argsort(numbers)[np.searchsorted(np.sort(numbers), found.numbers[value])]
    (x, along), (y, up) = found.grid.items()
    steps = [np.ptp(v) / max(1, v.size - 1) / 2.0 for v in (along, up)]
    ends = [(v[0] - step, v[-1] + step) for v, step in zip((along, up), steps, strict=True)]
    image = axes.imshow(
        place.reshape(along.size, up.size).T,
        cmap=ListedColormap([_look(one)["facecolor"] for one in here]),
        vmin=-0.5,
        vmax=len(here) - 0.5,
        extent=(*ends[0], *ends[1]),
        origin="lower",
        aspect="auto",
        interpolation="nearest",
    )
    states = found.result.variables["state"].flags
    for one in here:
        points = one.section[:MOST_POINTS]
        axes.plot(*(points[:, states.index(state)] for state in (x, y)), **_marker(one))
    axes.set(xlim=ends[0], ylim=ends[1], xlabel=_label(x), ylabel=_label(y))
    return image


def fractions(axes: Axes, found: Basins) -> list[Drawn]:
    """Draw the shares of all basins over the parameter on top of each other, number 1 lowest.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    found : Basins
        From `find_basins`, of several values.

    Returns
    -------
    list
        What is drawn, with labels, in the order of the numbers.
    """
    base, layers = np.zeros(found.values.size), []
    named = {one.number: one for one in found.basins}
    for number in sorted(named, key=lambda number: (number < 0, abs(number))):
        top = base + np.mean(found.numbers == number, axis=1)
        motions = [*dict.fromkeys(one.motion for one in found.basins if one.number == number)]
        words = ", ".join(motions[:3]) + (", ..." if len(motions) > 3 else "")
        look = _look(named[number]) | {"label": f"{number}: {words}" if number > 0 else words}
        layers.append(layer(axes, found.values, base, top, **look))
        base = top
    limits = diagram_lanes(found.result).limits
    axes.set(xlim=limits, ylim=(0.0, 1.0), xlabel=axis_label(found.result, found.parameter))
    axes.set_ylabel("Share of starts")
    return layers


def basins_page(
    found: Basins, width_mm: float = SINGLE_COLUMN_MM, height_mm: float | None = None
) -> Page:
    """Draw the basins of one value as `basins` does, those of several as `fractions`.

    Width and height are those of the page; raises FigureError as `basins`.
    """
    share = 0.85 if found.values.size == 1 else 0.55
    with page(width_mm, height_mm or 20.0 + share * width_mm) as figure:
        axes, fixed, labels = figure.subplots(), found.result.fixed, None
        if found.values.size > 1:
            drawn: list[Any] = fractions(axes, found)
        else:
            basins(axes, found)
            drawn = [
                (Patch(**_look(b), lw=0.3), Line2D([], [], **_marker(b))) for b in found.basins
            ]
            labels = [_in_words(one) for one in found.basins]
            fixed = fixed | {found.parameter: float(found.values[0])}
        few_ticks(axes, 8, 6)
        figure.suptitle(in_words(found.result, fixed), fontsize=SMALL_FONT_PT)
        look = {"title_fontsize": SMALL_FONT_PT, "loc": "outside lower center", **LEGEND}
        labels = labels or [str(one.get_label()) for one in drawn]
        figure.legend(drawn, labels, title=legend_title(found.result), ncols=2, **look)
    return figure


def _look(one: Basin) -> dict[str, Any]:
    if one.number < 0:
        return look_of(one.motion)
    return {"facecolor": COLORS[(one.number - 1) % len(COLORS)], "edgecolor": "0.55"}


def _marker(one: Basin) -> dict[str, Any]:
    marker = MARKERS[(one.number - 1) % len(MARKERS)] if one.number > 0 else "none"
    color = _look(one)["facecolor"]
    look: dict[str, Any] = {"ls": "none", "marker": marker, "ms": 5.0, "mfc": color}
    # Of chaos there are hundreds of points.
    size = {"mec": BLACK, "mew": 0.6} if one.period else {"ms": 1.0, "mfc": BLACK, "mew": 0.0}
    return look | size


def _label(state: str) -> str:
    wording, symbol = STATE_WORDING[state]
    unit = unit_of(state)
    return f"{wording[:1].upper()}{wording[1:]}, {symbol} ({unit.stands_for if unit else '1'})"


def _in_words(one: Basin) -> str:
    share, (low, high) = 100.0 * one.starts.shares, 100.0 * one.starts.intervals
    number = f"{one.number}: " if one.number > 0 else ""
    return f"{number}{one.motion}, {share:.3g} % ({low:.3g} to {high:.3g})"
