"""Branches of periodic orbits: into a bifurcation diagram, and on a page of their own."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.arrays import Floats
from gearchaos.errors import FigureError
from gearchaos.figures.labels import check_variable, label_of
from gearchaos.figures.lanes import Between
from gearchaos.figures.overlay import OverlaidLine, OverlaidPoint, Overlay
from gearchaos.figures.page import Page, continued, footnote, legend_below, letter, page
from gearchaos.figures.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SINGLE_COLUMN_MM, VERMILION
from gearchaos.models.gear_pair.outputs import DEFAULT_VARIABLE
from gearchaos.outputs.variable import Variable
from gearchaos.records.branch import (
    BRANCH_POINT,
    FOLD,
    GRAZING,
    GROWS,
    MEANINGS,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    PeriodicBranch,
)
from gearchaos.results.files.branch_file import BranchSet

MARKERS: dict[str, dict[str, Any]] = {
    FOLD: {"marker": "o", "color": ORANGE},
    BRANCH_POINT: {"marker": "*", "color": PURPLE},
    PERIOD_DOUBLING: {"marker": "s", "color": BLUE},
    NEIMARK_SACKER: {"marker": "D", "color": PURPLE},
    GRAZING: {"marker": "x", "color": GREY},
}
"""Marker and colour of each kind of special point."""

STABLE: dict[str, Any] = {"color": GREEN, "linestyle": "-", "linewidth": 0.9}
UNSTABLE: dict[str, Any] = {"color": VERMILION, "linestyle": (0, (4, 1.5)), "linewidth": 0.6}
STABLE_ORBITS, UNSTABLE_ORBITS = "stable orbits", "unstable orbits"
"""Kinds of lines."""

ON_CIRCLE = 1e-6
"""Distance of a multiplier from the unit circle within which its side is not known."""

LEAST_LABELLED = 0.02
"""Smallest share of the width of the axes that branches need for each digit of their label."""

LEAST_MODULUS = 1e-4
"""Smallest modulus of a multiplier that a page shows."""


def draw_branches(
    axes: Axes,
    found: BranchSet,
    variable: str | None = None,
    *,
    between: Between = (None, None),
) -> list[Line2D]:
    """Draw branches into axes over the swept parameter, with their special points.

    Parameters
    ----------
    axes : Axes
        Axes with the parameter along x, such as those of `bifurcation`. Their limits along x stay;
        those along y grow where branches need it.
    found : BranchSet
        The branches.
    variable : str, optional
        A section variable, by default that of the first state that the diagram would show, or an
        output of the orbits, such as ``"load_factor_largest"``.
    between : (float or None, float or None)
        Part of the parameter range whose branches are drawn.

    Returns
    -------
    list of Line2D
        One entry for the legend for each kind of line and marker.

    Raises
    ------
    FigureError
        If the branches have no such variable.

    Notes
    -----
    Stable orbits are solid lines, unstable ones dashed lines. A branch of period n is n lines, one
    for each of its section points. Lines and markers are as in `MARKERS`.
    """
    over = branch_overlay(found, checked_variable(found, variable), between)
    kinds: dict[str, Line2D] = {}
    for one in over.lines:
        # Below the markers, above the dots of the sweep.
        above = 3.0 + (one.kind == STABLE_ORBITS) / 10
        lines = axes.plot(one.x, one.y, zorder=above, **one.look)
        kinds.setdefault(one.kind, lines[0]).set_label(one.kind)
    for point in over.points:
        look: dict[str, Any] = {"ms": 2.5, "mew": 0.6, "mfc": "white", "ls": "none", "zorder": 4.0}
        (line,) = axes.plot(np.full(point.y.size, point.x), point.y, **look, **point.look)
        kinds.setdefault(point.kind, line).set_label(point.kind)
    axes.set_ylim(*limits_with(over, axes.get_ylim(), between))
    return [kinds[kind] for kind in over.kinds]


def branch_overlay(found: BranchSet, name: str, between: Between = (None, None)) -> Overlay:
    """Return the lines and special points of branches for one of their variables.

    ``between``: limits of the special points.
    """
    lines, points = list[OverlaidLine](), list[OverlaidPoint]()
    for branch in found.branches:
        rows = _rows(found, branch, name)
        for piece, stable in _pieces(branch):
            kind, look = (STABLE_ORBITS, STABLE) if stable else (UNSTABLE_ORBITS, UNSTABLE)
            line = OverlaidLine(kind, branch.value[piece], rows[piece], look, _grows(branch))
            lines.append(line)
        points += _special_points(found, branch, name, between)
    there = {one.kind for one in lines} | {one.kind for one in points}
    order = [STABLE_ORBITS, UNSTABLE_ORBITS, *MARKERS]
    return Overlay(lines, points, [kind for kind in order if kind in there])


def limits_with(
    over: Overlay, limits: tuple[float, float], between: Between = (None, None)
) -> tuple[float, float]:
    """Return limits along y, extended to a margin beyond the lines between two values of x.

    For lines that grow far, they are extended by the height between them at most.
    """
    for grows in (False, True):
        heights = [
            one.y[_inside(one.x, between)].ravel() for one in over.lines if one.grows == grows
        ]
        there = np.concatenate([np.zeros(0), *heights])
        there = there[np.isfinite(there)]
        if not there.size:
            continue
        low, high = limits
        least, most = float(there.min()), float(there.max())
        if grows:
            least, most = max(least, 2.0 * low - high), min(most, 2.0 * high - low)
        pad = 0.04 * (max(high, most) - min(low, least))
        limits = min(low, least - pad), max(high, most + pad)
    return limits


def _grows(branch: PeriodicBranch) -> bool:
    """Whether a branch grows so far that a panel shows only a part of it."""
    return GROWS in branch.ends


def _inside(values: Any, between: Between) -> Any:
    """Whether values lie between two limits; None is no limit."""
    low, high = between
    return (values >= (-np.inf if low is None else low)) & (
        values <= (np.inf if high is None else high)
    )


def checked_variable(found: BranchSet, variable: str | None) -> str:
    """Return the name of a section or an output of the orbits, or the default."""
    sections = [one.name for one in found.states]
    default = DEFAULT_VARIABLE if DEFAULT_VARIABLE in sections else sections[0]
    there = (*sections, *(one.name for one in found.quantities))
    check_variable(variable or default, there, "of the branches")
    return variable or default


def _described(found: BranchSet, name: str) -> Variable:
    """Return the description of a variable of the branches."""
    return next(one for one in (*found.states, *found.quantities) if one.name == name)


def _rows(found: BranchSet, branch: PeriodicBranch, name: str) -> Floats:
    """Return the values to draw of a branch, (points, lines)."""
    sections = [one.name for one in found.states]
    if name in sections:
        return branch.section[:, :, sections.index(name)]
    return branch.quantities[name][:, np.newaxis]


def _pieces(branch: PeriodicBranch) -> Iterator[tuple[slice, bool]]:
    """Cut the points of a branch into pieces of one stability that share their end points."""
    # At a special point a modulus is 1 up to rounding. It belongs to the pieces on both sides.
    unstable = np.abs(branch.multipliers[:, 0]) > 1.0 + ON_CIRCLE
    stable = ~(unstable[1:] | unstable[:-1])
    changes = np.flatnonzero(np.diff(stable)) + 1
    for begin, end in pairwise([0, *changes.tolist(), stable.size]):
        if end > begin:
            yield slice(begin, end + 1), bool(stable[begin])


def _special_points(
    found: BranchSet, branch: PeriodicBranch, name: str, between: Between
) -> Iterator[OverlaidPoint]:
    """Yield the special points of a branch between limits."""
    sections = [one.name for one in found.states]
    rows = _rows(found, branch, name)
    for special in branch.specials:
        if not _inside(special.value, between):
            continue
        if name in sections:
            heights = special.section[:, sections.index(name)]
        else:
            order = np.interp(special.arclength, branch.arclength, rows[:, 0])
            heights = np.array([order])
        text = f"{special.kind} of period {branch.period} at {found.parameter.name} = "
        text += f"{special.value:.8g}: {MEANINGS[special.kind]}"
        text += f" ({special.flank})" if special.flank else ""
        yield OverlaidPoint(special.kind, special.value, heights, MARKERS[special.kind], text)


def add_branches(
    figure: Page, found: BranchSet, variable: str | None = None, *, between: Between = (None, None)
) -> None:
    """Draw branches into the upper panel of a page of `bifurcation_page`, with a legend below.

    Parameters
    ----------
    figure : Page
        The page.
    found, variable, between
        As for `draw_branches`.

    Raises
    ------
    FigureError
        If the branches have no such variable.
    """
    with continued(figure):
        handles = draw_branches(figure.axes[0], found, variable, between=between)
        # The legend takes the place of the footnote, which becomes its title.
        legend_below(figure, handles, figure.get_supxlabel() or None, 4)
        footnote(figure, " ")


def branches_page(
    found: BranchSet,
    variable: str | None = None,
    *,
    between: Between = (None, None),
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw branches over the parameter (a) above their Floquet multipliers over the arclength (b).

    Parameters
    ----------
    found : BranchSet
        The branches.
    variable, between
        As for `draw_branches`.
    width_mm, height_mm : float
        Size of the page.

    Returns
    -------
    Page
        A figure unknown to pyplot.

    Raises
    ------
    FigureError
        If there are no branches, or no such variable.
    """
    if not found.branches:
        raise FigureError("nothing to draw: the file holds no branch")
    name = checked_variable(found, variable)
    with page(width_mm, height_mm or 55.0 + 0.55 * width_mm) as figure:
        upper, lower = figure.subplots(2, 1, height_ratios=(1.6, 1.0))
        values = np.concatenate([one.value for one in found.branches])
        low, high = between
        upper.set_xlim(values.min() if low is None else low, values.max() if high is None else high)
        limited = [one for one in found.branches if not _grows(one)] or found.branches
        rows = np.concatenate([_rows(found, one, name).ravel() for one in limited])
        upper.set_ylim(float(np.nanmin(rows)), float(np.nanmax(rows)))
        handles = draw_branches(upper, found, name, between=between)
        upper.set_xlabel(label_of(found.parameter))
        upper.set_ylabel(label_of(_described(found, name), 34))
        _draw_multipliers(lower, found.branches)
        for axes in (upper, lower):
            axes.yaxis.label.set_linespacing(1.0)
        legend_below(figure, handles, str(found.metadata.get("title", "")) or None, 3)
        letter((upper, lower))
    return figure


def _shown(branch: PeriodicBranch, longest: float) -> slice:
    """Return the points of a branch that are drawn over its arclength; see `_draw_multipliers`."""
    along = branch.arclength
    if branch.ends[1] == GROWS:
        return slice(int(np.searchsorted(along, longest, "right")))
    if branch.ends[0] == GROWS:
        return slice(int(np.searchsorted(along, along[-1] - longest)), None)
    return slice(None)


def _draw_multipliers(axes: Axes, branches: Sequence[PeriodicBranch]) -> list[Artist]:
    """Draw the moduli of all multipliers over the arclength, one branch beside the other.

    Of a branch that grows, as much is drawn as of the longest one that does not. Neighbouring
    branches of the same period share a label.
    """
    longest = max([float(one.arclength[-1]) for one in branches if not _grows(one)], default=np.inf)
    drawn: list[Artist] = [axes.axhline(1.0, color=GREY, linewidth=0.5, linestyle=(0, (4, 2)))]
    offset, spans = 0.0, dict[int, tuple[float, float]]()
    least = min(float(np.abs(one.multipliers).min()) for one in branches)
    for branch in branches:
        shown = _shown(branch, longest)
        moduli = np.maximum(np.abs(branch.multipliers[shown]), LEAST_MODULUS)
        along = branch.arclength[shown] - branch.arclength[shown][0]
        drawn += axes.plot(offset + along, moduli, color="black", linewidth=0.6)
        first, _ = spans.get(branch.period, (offset, offset))
        offset += float(along[-1])
        spans[branch.period] = first, offset
        drawn.append(axes.axvline(offset, color="0.8", linewidth=0.5, zorder=0.0))
    axes.set(yscale="log", xlim=(0.0, offset), ylim=(max(least / 2.0, LEAST_MODULUS), None))
    labelled = {
        period: (first + last) / 2.0
        for period, (first, last) in spans.items()
        if last - first > LEAST_LABELLED * len(str(period)) * offset
    }
    axes.set_xticks([*labelled.values()], [*map(str, labelled)])
    axes.tick_params(axis="x", which="both", length=0.0)
    axes.set_xlabel("Period of the branch; along its arclength")
    axes.set_ylabel("Modulus of the\nFloquet multipliers")
    return drawn
