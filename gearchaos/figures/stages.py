"""Stages of a sweep as shades behind a diagram."""

import csv
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from gearchaos.figures.labels import legend_title
from gearchaos.figures.lanes import diagram_lanes
from gearchaos.figures.page import legend_below
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import LabelledLanes, Stage, labelled_lanes, stage_table

# Blues darken with the period; period 3, the best-known window in chaos, has another colour. Shades
# without hatching differ in lightness, and all are light enough for black points to be visible.
with Path(__file__).with_name("shades.csv").open(encoding="utf-8", newline="") as _file:
    _ROWS = [*csv.DictReader(_file)]
SHADES = {row["kind"]: row["colour"] for row in _ROWS}
HATCHES = {row["kind"]: row["hatch"] for row in _ROWS if row["hatch"]}
"""Hatching by kind of stage, and before it the colour by kind, in the order of the legend."""

OWN_SHARE = 0.75
"""Least share of the lanes with the motion of their stage; below it, it has several motions."""

NARROWEST_SHARE = 1.0 / 150.0
"""Least width of a stage relative to the axis: half a mm in one column. Narrower stages merge."""


def shade_stages(
    axes: Axes, result: Result, *, lanes: LabelledLanes | None = None, legend: bool = True
) -> list[Rectangle]:
    """Shade the stages of a sweep behind a diagram; limits and labels do not change.

    Parameters
    ----------
    axes : Axes
        Axes with the swept parameter along x and limits set.
    result : Result
        A result over one swept parameter, with labels of the motion.
    lanes : LabelledLanes, optional
        Lanes with other labels than those of the result.
    legend : bool
        Whether to put a legend below the figure, which needs the constrained layout.

    Returns
    -------
    list of Rectangle
        One rectangle for each stage within the limits; its label is the kind of the stage.

    Raises
    ------
    FileError, FigureError
        If the result has no labels; if it has two swept parameters.

    Notes
    -----
    "Several motions" are values whose starts or gear pairs have different motions, and stages
    with more than a quarter of their lanes in stages narrower than a 150th of the axis.

    Examples
    --------
    >>> axes = Figure(layout="constrained").subplots()
    >>> result = gearchaos.open_result("pan2021.h5")
    >>> drawn = figures.bifurcation(axes, result)
    >>> rectangles = figures.shade_stages(axes, result)
    """
    diagram_lanes(result)  # Refuses two swept parameters.
    lanes = labelled_lanes(result, repeats=True) if lanes is None else lanes
    low, high = sorted(axes.get_xlim())
    stages = stage_table(lanes, NARROWEST_SHARE * (high - low))
    # Stages meet halfway between their lanes; the outermost ones reach the ends of the axis.
    edges = [low, *((one.end + other.start) / 2.0 for one, other in pairwise(stages)), high]
    kinds = [_kind(stage, lanes) for stage in stages]
    shades, drawn = [], set()
    for kind, (left, right) in zip(kinds, pairwise(edges), strict=True):
        if left < high and right > low:
            place = max(left, low), min(right, high)
            look: Any = {"linewidth": 0.0, "zorder": 0.0, "label": kind, **look_of(kind)}
            shades.append(axes.axvspan(*place, **look))
            drawn.add(kind)
    axes.set_xlim(low, high)
    if legend:
        named = [kind for kind in dict.fromkeys([*SHADES, *kinds]) if kind in drawn]
        _legend(axes, named, legend_title(result))
    return shades


def _legend(axes: Axes, kinds: Sequence[str], title: str | None) -> None:
    """Name the shades in a legend below the figure of the axes."""
    handles = [Patch(linewidth=0.3, label=kind, **look_of(kind)) for kind in kinds]
    # Below the figure: above are the letter of the panel and the legend of the marks. The title
    # of the legend replaces the footnote, which would lie on the legend.
    figure: Any = axes.figure
    legend_below(figure, handles, title, columns=5)


def look_of(kind: str) -> dict[str, Any]:
    """Return fill, edge and hatching of a kind of motion; unknown kinds look unresolved."""
    # Files of a later format version may contain further kinds of motion.
    shade = SHADES.get(kind, SHADES["unresolved"])
    return {"facecolor": shade, "edgecolor": "0.55", "hatch": HATCHES.get(kind)}


def _kind(stage: Stage, lanes: LabelledLanes) -> str:
    if np.mean(lanes.labels[stage.first : stage.last + 1] == stage.label) < OWN_SHARE:
        return "several motions"
    return "period 4 or more" if stage.period > 3 else stage.label
