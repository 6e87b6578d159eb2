"""Basins of attraction over two states of the start, and their shares over a swept parameter."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label, in_words, legend_title
from gearchaos.figures.lanes import cell_edges, diagram_lanes
from gearchaos.figures.page import Page, few_ticks, page
from gearchaos.figures.shares import Drawn, layer
from gearchaos.figures.stages import look_of
from gearchaos.figures.style import BLACK, LEGEND, SINGLE_COLUMN_MM, SMALL_FONT_PT
from gearchaos.results.basins import Basin, Basins
from gearchaos.results.units import unit_of
from gearchaos.results.variables import STATE_WORDING

COLORS = ("#D6E6F3", "#EDBE62", "#5DB898", "#C284AD", "#B4602F", "#4C6E8E")
"""Of attractors by their numbers, over and over again; lightness tells them apart in grey."""

MOST_POINTS = 500
"""Section points that are drawn of an attractor."""


def basins(axes: Axes, found: Basins, value: int = 0) -> ScalarMappable:
    """Draw the basins over the two states of a grid of starts, with the attractors on top.

    Every start is a cell in the colour of its attractor, circles are the points of a periodic one
    that lie within the axes, dots those of any other. ``found``: from `find_basins`, ``value``:
    which of its values. Raises FigureError if the starts are not on a grid over two states.
    """
    if len(found.grid) != 2:
        raise FigureError(
            'basins are drawn over two states: set start.kind = "grid" and name two states in '
            "start.box; of other starts, their shares are drawn over several values of a parameter"
        )
    here = {one.number: one for one in found.basins if one.value == found.values[value]}
    numbers, cells = np.unique(found.numbers[value], return_inverse=True)
    (x, along), (y, up) = found.grid.items()
    ends = cell_edges(along), cell_edges(up)
    colours = ListedColormap([_look(here[number])["facecolor"] for number in numbers.tolist()])
    cells = cells.reshape(along.size, up.size).T
    image = axes.pcolorfast(*ends, cells, cmap=colours, vmin=-0.5, vmax=len(numbers) - 0.5)
    columns = [found.result.variables["state"].flags.index(state) for state in (x, y)]
    for one in here.values():
        face, size, edge = (_look(one)["facecolor"], 5.0, 0.6) if one.period else (BLACK, 1.0, 0.0)
        points = one.section[:MOST_POINTS, columns].T
        axes.plot(*points, "o", ms=size, mfc=face, mec=BLACK, mew=edge)
    axes.set(xlim=ends[0][[0, -1]], ylim=ends[1][[0, -1]], xlabel=_label(x), ylabel=_label(y))
    return image


def fractions(axes: Axes, found: Basins) -> list[Drawn]:
    """Draw the shares of all basins over the parameter on top of each other, number 1 lowest.

    ``found``: from `find_basins`, of several values. Returns what is drawn, with labels, in the
    order of the numbers.
    """
    base, layers = np.zeros(found.values.size), []
    for number in sorted({one.number for one in found.basins}, key=lambda n: (n < 0, abs(n))):
        mine = [one for one in found.basins if one.number == number]
        motions = [*dict.fromkeys(one.motion for one in mine)]
        words = ", ".join(motions[:3]) + (", ..." if len(motions) > 3 else "")
        look = _look(mine[0]) | {"label": f"{number}: {words}" if number > 0 else words}
        top = base + np.mean(found.numbers == number, axis=1)
        layers.append(layer(axes, found.values, base, top, **look))
        base = top
    axes.set(ylim=(0.0, 1.0), xlabel=axis_label(found.result, found.parameter))
    axes.set(xlim=diagram_lanes(found.result).limits, ylabel="Share of starts")
    return layers


def basins_page(
    found: Basins, width_mm: float = SINGLE_COLUMN_MM, height_mm: float | None = None
) -> Page:
    """Draw the basins of one value as `basins` does, those of several as `fractions`.

    Width and height are those of the page; raises FigureError as `basins`.
    """
    several, fixed = found.values.size > 1, found.result.fixed
    with page(width_mm, height_mm or 20.0 + (0.55 if several else 0.85) * width_mm) as figure:
        axes = figure.subplots()
        if several:
            drawn: list[Any] = fractions(axes, found)
        else:
            basins(axes, found)
            drawn = [Patch(**_look(b), lw=0.3, label=_in_words(b)) for b in found.basins]
            fixed = fixed | {found.parameter: float(found.values[0])}
        few_ticks(axes, 8, 6)
        figure.suptitle(in_words(found.result, fixed), fontsize=SMALL_FONT_PT)
        look = {"title_fontsize": SMALL_FONT_PT, "loc": "outside lower center", **LEGEND}
        figure.legend(handles=drawn, title=legend_title(found.result), ncols=2, **look)
    return figure


def _look(one: Basin) -> dict[str, Any]:
    if one.number < 0:
        return look_of(one.motion)
    return {"facecolor": COLORS[(one.number - 1) % len(COLORS)], "edgecolor": "0.55"}


def _label(state: str) -> str:
    wording, symbol = STATE_WORDING[state]
    unit = unit_of(state)
    return f"{wording.capitalize()}, {symbol} ({unit.stands_for if unit else '1'})"


def _in_words(one: Basin) -> str:
    share, low, high = (100.0 * part for part in (one.share, *one.share_95_percent))
    number = f"{one.number}: " if one.number > 0 else ""
    return f"{number}{one.motion}, {share:.3g} % ({low:.3g} to {high:.3g})"
