"""Figures of ensembles: shares of motions among gear pairs and starts, basins of attraction."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap
from matplotlib.container import Container
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, NullLocator

from gearchaos.arrays import Floats
from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label, in_words, label_of, legend_title
from gearchaos.figures.lanes import Between, cell_edges, diagram_lanes
from gearchaos.figures.page import Page, few_ticks, legend_below, letter, page, remark
from gearchaos.figures.stages import SHADES, look_of
from gearchaos.figures.style import BLACK, SINGLE_COLUMN_MM, VERMILION
from gearchaos.models.catalogues import scale_of, subject_of
from gearchaos.outputs.names import REPEATS
from gearchaos.outputs.variable import Variable
from gearchaos.results.reading.ensembles import (
    Basin,
    Basins,
    Counted,
    MotionShares,
    in_order,
    motion_shares,
)
from gearchaos.results.reading.result import Result

Drawn = Artist | Container

NOT_PERIOD_1 = {"fmt": "none", "color": BLACK, "label": "not period 1, 95 % confidence"}
LEAVES_PERIOD_1 = {"fmt": "o", "color": BLACK, "label": "leaves period 1"}
LOSES_CONTACT = {"fmt": "^", "color": VERMILION, "label": "loses contact"}
"""Looks of shares with confidence intervals."""

COLORS = ("#D6E6F3", "#EDBE62", "#5DB898", "#C284AD", "#B4602F", "#4C6E8E")
"""Colours of attractors by number, used cyclically; they differ in lightness when grey."""

SECTION_POINTS: dict[str, Any] = {"mfc": "none", "mec": BLACK, "mew": 0.6}
SECTION_POINTS |= {"ls": "", "marker": "o", "ms": 5.0, "label": "motion at the section"}
"""Look of the circles in basins, in their legend."""

MOST_POINTS = 500  # Most section points drawn per attractor.

MOST_BARS = 24
"""Most values drawn as bars with error bars; more are drawn as steps with a confidence band."""


def shares(
    axes: Axes, result: Result, *, between: Between = (None, None), contact: Axes | None = None
) -> list[Drawn]:
    """Draw the shares of all motions at each swept value, stacked with period 1 on top.

    Parameters
    ----------
    axes, between
        As for `bifurcation`.
    result : Result
        A result over one swept parameter, with labels, of several gear pairs or starts.
    contact : Axes, optional
        Axes for the share of motions that leave period 1, and of those that lose contact if the
        result contains it. Without them the former is drawn at the edge below period 1.

    Returns
    -------
    list of Artist or Container
        Drawn and labelled parts of the first axes, in the order of a legend.

    Raises
    ------
    FigureError
        If no lane is in the range or there are two swept parameters.
    ConfigurationError, FileError
        If the result has one lane per value, or no labels.

    Notes
    -----
    The edge below period 1 is the share of all other motions, including diverged and unresolved
    lanes. Its 95 % confidence interval (Wilson 1927) assumes independent gear pairs and starts.

    Examples
    --------
    >>> axes = Figure(layout="constrained").subplots()
    >>> drawn = figures.shares(axes, gearchaos.open_result("starts.h5"))
    """
    counted, limits = motion_shares(result), diagram_lanes(result, between).limits
    values, known = counted.values, list(dict.fromkeys([*SHADES, *counted.motions]))
    each = dict(zip(counted.motions, (counted.counts.T / counted.other.lanes), strict=True))
    lowest_first = sorted(each, key=known.index, reverse=True)
    looks = [{"label": motion, **look_of(motion)} for motion in lowest_first]
    layers = _stacked(axes, values, [each[motion] for motion in lowest_first], looks)
    axes.set_ylabel("Share of motions")
    if contact is None:
        layers.insert(0, _confidence(axes, values, counted.other, NOT_PERIOD_1))
    else:
        contact.set_ylabel("Share, with 95 %\nconfidence", linespacing=1.0)
        layers[:0] = _two_shares(contact, values, counted)
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
    """Draw the shares of all motions (a) above those that leave period 1 or lose contact (b).

    Parameters
    ----------
    result, between
        As for `shares`.
    width_mm, height_mm : float
        Size of the page.

    Returns
    -------
    Page
        A figure unknown to pyplot.

    Raises
    ------
    FigureError, ConfigurationError, FileError
        As for `shares`.

    Examples
    --------
    >>> page = figures.shares_page(gearchaos.open_result("starts.h5"))
    """
    with page(width_mm, height_mm or 60.0 + 0.35 * width_mm) as figure:
        stack = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
        drawn = shares(stack[0], result, between=between, contact=stack[1])
        stack[0].set_xlabel("")
        letter(stack)
        names = zip(REPEATS, ("gear pairs", "starts"), strict=True)
        sizes = [f"{result[axis].size} {name}" for axis, name in names if axis in result.axes]
        remark(stack[0], f"{' with '.join(sizes)} each")
        if result.fixed:
            figure.suptitle(in_words(result, result.fixed))
        legend_below(figure, drawn, legend_title(result), columns=3)
        figure.align_ylabels(stack)
    return figure


def _stacked(
    axes: Axes, values: Floats, shares: Sequence[Floats], looks: Sequence[dict[str, Any]]
) -> list[Drawn]:
    """Draw stacked shares, each of shape (values,), the first one lowest."""
    drawn: list[Drawn] = []
    width = 0.8 * (np.diff(values).min() if values.size > 1 else 1.0)
    edges, tops = cell_edges(values), np.cumsum(shares, axis=0)
    for base, top, look in zip([np.zeros(values.size), *tops], tops, looks, strict=False):
        if values.size <= MOST_BARS:
            drawn.append(axes.bar(values, top - base, width, base, linewidth=0.3, **look))
        else:
            look = {"baseline": base, "fill": True, "linewidth": 0.0, **look}
            drawn.append(axes.stairs(top, edges, **look))
    return drawn


def _two_shares(axes: Axes, values: Floats, counted: MotionShares) -> list[Drawn]:
    """Draw the share that leaves period 1 and, if known, the share that loses contact."""
    few = values.size <= MOST_BARS
    # Side by side, so that neither hides the other.
    aside = 0.1 * np.diff(values).min() if few and values.size > 1 and counted.apart else 0.0
    drawn = [_confidence(axes, values - aside, counted.other, LEAVES_PERIOD_1)]
    if counted.apart:
        drawn.append(_confidence(axes, values + aside, counted.apart, LOSES_CONTACT))
    return drawn[::-1]


def _confidence(axes: Axes, values: Floats, counted: Counted, look: dict[str, Any]) -> Drawn:
    """Draw shares with their confidence intervals: error bars for few values, else a band."""
    share, (low, high) = counted.shares, counted.intervals.T
    if values.size <= MOST_BARS:
        size: dict[str, Any] = {"ms": 2.5, "lw": 0.7, "capsize": 1.5, "capthick": 0.7}
        return axes.errorbar(values, share, (share - low, high - share), **size, **look)
    color, label = look["color"], look["label"]
    axes.plot(values, share, color=color, linewidth=0.6, drawstyle="steps-mid")
    band: dict[str, Any] = {"step": "mid", "color": color, "alpha": 0.25, "linewidth": 0.0}
    return axes.fill_between(values, low, high, label=label, **band)


def basins(axes: Axes, found: Basins, value: int = 0) -> ScalarMappable:
    """Draw the basins over a grid of starts in two states, with the attractors on top.

    Parameters
    ----------
    axes : Axes
        The axes to draw into.
    found : Basins
        Basins from `find_basins`.
    value : int
        Number of the swept value.

    Returns
    -------
    ScalarMappable
        The image: one cell per start, in the colour of its attractor. Circles are the section
        points of periodic attractors, dots those of all others.

    Raises
    ------
    FigureError
        If the starts are not on a grid over two states.

    Examples
    --------
    >>> from gearchaos.engine.basins import find_basins
    >>> axes = Figure(layout="constrained").subplots()
    >>> image = figures.basins(axes, find_basins(gearchaos.open_result("grid.h5")))
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
    axes.set(
        xlim=ends[0][[0, -1]],
        ylim=ends[1][[0, -1]],
        xlabel=_label(found, x),
        ylabel=_label(found, y),
    )
    return image


def fractions(axes: Axes, found: Basins) -> list[Drawn]:
    """Draw the shares of all basins over the swept parameter, stacked with number 1 lowest.

    Parameters
    ----------
    axes : Axes
        The axes to draw into.
    found : Basins
        Basins at several values, from `find_basins`.

    Returns
    -------
    list of Artist or Container
        Drawn and labelled parts, in the order of the numbers.

    Examples
    --------
    >>> from gearchaos.engine.basins import find_basins
    >>> axes = Figure(layout="constrained").subplots()
    >>> drawn = figures.fractions(axes, find_basins(gearchaos.open_result("starts.h5")))
    """
    numbers, looks = in_order(one.number for one in found.basins), []
    for number in numbers:
        mine = [one for one in found.basins if one.number == number]
        motions = [*dict.fromkeys(one.motion for one in mine)]
        words = ", ".join(motions[:3]) + (", ..." if len(motions) > 3 else "")
        looks.append(_look(mine[0]) | {"label": f"{number}: {words}" if number > 0 else words})
    axes.set(ylim=(0.0, 1.0), xlabel=axis_label(found.result, found.parameter))
    axes.set(xlim=diagram_lanes(found.result).limits, ylabel="Share of starts")
    shares = [np.mean(found.numbers == number, axis=1) for number in numbers]
    return _stacked(axes, found.values, shares, looks)


def basins_page(
    found: Basins, width_mm: float = SINGLE_COLUMN_MM, height_mm: float | None = None
) -> Page:
    """Draw the basins at one value as `basins` does, those at several as `fractions` does.

    Parameters
    ----------
    found : Basins
        Basins from `find_basins`.
    width_mm, height_mm : float
        Size of the page.

    Returns
    -------
    Page
        A figure unknown to pyplot.

    Raises
    ------
    FigureError
        As for `basins`, at one value.

    Examples
    --------
    >>> from gearchaos.engine.basins import find_basins
    >>> page = figures.basins_page(find_basins(gearchaos.open_result("grid.h5")))
    """
    several, fixed = found.values.size > 1, found.result.fixed
    with page(width_mm, height_mm or 20.0 + (0.55 if several else 0.85) * width_mm) as figure:
        axes = figure.subplots()
        if several:
            drawn: list[Any] = fractions(axes, found)
        else:
            basins(axes, found)
            drawn = [*basin_patches(found), Line2D([], [], **SECTION_POINTS)]
            fixed = fixed | {found.parameter: float(found.values[0])}
        few_ticks(axes, 8, 6)
        figure.suptitle(in_words(found.result, fixed))
        legend_below(figure, drawn, legend_title(found.result), columns=2)
    return figure


def basin_patches(found: Basins) -> list[Patch]:
    """Return a patch in the colour of each basin, labelled with number, motion and share."""
    return [Patch(**_look(one), lw=0.3, label=_in_words(one)) for one in found.basins]


def _look(one: Basin) -> dict[str, Any]:
    if one.number < 0:
        return look_of(one.motion)
    return {"facecolor": COLORS[(one.number - 1) % len(COLORS)], "edgecolor": "0.55"}


def _label(found: Basins, state: str) -> str:
    """Return the label of a state, in the units of the basins."""
    subject, scale = subject_of(state), scale_of(state, found.result.metadata)
    words = subject.long_name, subject.symbol
    units = found.units.get(state, "1")
    return label_of(Variable(state, (), "float64", units, *words, scale=scale))


def _in_words(one: Basin) -> str:
    share, low, high = (100.0 * part for part in (one.share, *one.share_95_percent))
    number = f"{one.number}: " if one.number > 0 else ""
    return f"{number}{one.motion}, {share:.3g} % ({low:.3g} to {high:.3g})"
