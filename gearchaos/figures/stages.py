"""Stages of a sweep as shades behind a diagram, so that its parts can be named."""

import csv
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

# Blues that darken with the period, but for period 3, the window in chaos that is looked for. Those
# without hatching differ in lightness, and all are light enough for black points to stand out.
with Path(__file__).with_name("shades.csv").open(encoding="utf-8", newline="") as _file:
    _ROWS = [*csv.DictReader(_file)]
SHADES = {row["kind"]: row["colour"] for row in _ROWS}
HATCHES = {row["kind"]: row["hatch"] for row in _ROWS if row["hatch"]}
"""Colour and hatching of each kind of stage, in the order of the legend."""

OWN_SHARE = 0.75
"""Of the lanes of a stage, at least this share has its motion, or it is one of several motions."""

NARROWEST_SHARE = 1.0 / 150.0
"""Narrower stages, in parts of the axis, go into what surrounds them: half a mm in a column."""


def shade_stages(
    axes: Axes,
    result: Result,
    *,
    lanes: LabelledLanes | None = None,
    legend: bool = True,
) -> list[Rectangle]:
    """Shade the stages of a sweep behind what the axes show, limits and labels left as they are.

    ``axes``: with the swept parameter along x, limits set; ``result``: over one swept parameter,
    with labels of the motion. Values whose starts or gear pairs come to different motions are
    "several motions"; so is a stage that hides too many of those narrower than a 150th of the axis.
    ``lanes``: with other labels than those of the result; ``legend``: put a legend of the shades
    below everything in the figure, which needs the constrained layout. Returns a rectangle for each
    stage within the axes. Raises FileError if the result has no labels, FigureError if it has
    several swept parameters.
    """
    diagram_lanes(result)  # Refuses two swept parameters.
    lanes = labelled_lanes(result, repeats=True) if lanes is None else lanes
    low, high = sorted(axes.get_xlim())
    stages = stage_table(lanes, NARROWEST_SHARE * (high - low))
    # Neighbours meet halfway between their lanes, and the outermost reach to the ends of the axis.
    edges = [low, *((one.end + other.start) / 2.0 for one, other in pairwise(stages)), high]
    kinds = [_kind(stage, lanes) for stage in stages]
    shades, drawn = [], set()
    for kind, (left, right) in zip(kinds, pairwise(edges), strict=True):
        if left < high and right > low:
            place = max(left, low), min(right, high)
            shades.append(axes.axvspan(*place, linewidth=0.0, zorder=0.0, **look_of(kind)))
            drawn.add(kind)
    axes.set_xlim(low, high)
    if legend:
        named = [kind for kind in dict.fromkeys([*SHADES, *kinds]) if kind in drawn]
        handles = [Patch(linewidth=0.3, label=kind, **look_of(kind)) for kind in named]
        # Above the axes are the panel's letter and the marks of lanes that cannot be shown; and a
        # line at the foot of the page would lie on the legend.
        figure: Any = axes.figure
        legend_below(figure, handles, legend_title(result), columns=5)
    return shades


def look_of(kind: str) -> dict[str, Any]:
    """Return how a kind of motion is filled, one unknown as one unresolved."""
    # A later version of the file format may know motions that this one does not.
    shade = SHADES.get(kind, SHADES["unresolved"])
    return {"facecolor": shade, "edgecolor": "0.55", "hatch": HATCHES.get(kind)}


def _kind(stage: Stage, lanes: LabelledLanes) -> str:
    if np.mean(lanes.labels[stage.first : stage.last + 1] == stage.label) < OWN_SHARE:
        return "several motions"
    return "period 4 or more" if stage.period > 3 else stage.label
