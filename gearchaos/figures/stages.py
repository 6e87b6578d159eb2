"""Stages of a sweep as shades behind a diagram, so that its parts can be named."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.patches import Patch, Rectangle

from gearchaos.errors import FigureError
from gearchaos.figures.style import LEGEND, SMALL_FONT_PT
from gearchaos.results.result import Result
from gearchaos.results.stage_table import Stage, labelled_lanes, stage_table

# Blues that darken with the period; the others differ from them in hue, and all are light enough
# for black points to stand out.
SHADES = {
    "period 1": "#E3EEF8",
    "period 2": "#BBD7EF",
    "longer period": "#8FBCE2",
    "quasi-periodic": "#CDE8CF",
    "chaotic": "#FCE5C4",
    "unresolved": "#E2E2E2",
    "diverged": "#F6CDBB",
    "grows": "#F6CDBB",
}
"""Colour of each kind of stage, in the order of the legend."""

NARROWEST_SHARE = 1.0 / 150.0
"""Narrower stages, in parts of the axis, go into what surrounds them: half a mm in a column."""


class StageArtists(NamedTuple):
    """What `shade_stages` has drawn: one rectangle per stage, and the legend."""

    stages: list[Stage]
    shades: list[Rectangle]
    legend: Legend | None


def shade_stages(
    axes: Axes,
    result: Result,
    *,
    narrowest: float | None = None,
    legend: bool = True,
) -> StageArtists:
    """Shade the stages of a sweep behind what the axes show, limits and labels left as they are.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With the swept parameter along x, limits set.
    result : Result
        Of one axis, with labels of the motion. Where it was chosen among several starts
        (``result.sel(start=0)``), the legend names that start.
    narrowest : float, optional
        Narrower stages go into what surrounds them; default a 150th of the axis.
    legend : bool
        Put a legend of the shades below everything in the figure, which needs the constrained
        layout.

    Returns
    -------
    StageArtists

    Raises
    ------
    FileError
        If the result has no labels.
    FigureError
        If it has several axes.
    """
    if len(result.axes) > 1:
        raise FigureError(
            f"stages are those of one axis, but the result has {', '.join(result.axes)}; fix the "
            "others with result.sel"
        )
    lanes = labelled_lanes(result)
    low, high = sorted(axes.get_xlim())
    stages = stage_table(lanes, NARROWEST_SHARE * (high - low) if narrowest is None else narrowest)
    # Neighbours meet halfway between their lanes, and the outermost reach to the ends of the axis.
    edges = [low, *((one.end + other.start) / 2.0 for one, other in pairwise(stages)), high]
    # A later version of the file format may know motions that this one does not.
    colours = {**SHADES, **dict.fromkeys({*map(_kind, stages)} - {*SHADES}, SHADES["unresolved"])}
    shades = [
        axes.axvspan(
            max(left, low), min(right, high), color=colours[_kind(stage)], linewidth=0.0, zorder=0.0
        )
        for stage, left, right in zip(stages, edges[:-1], edges[1:], strict=True)
        if left < high and right > low
    ]
    axes.set_xlim(low, high)
    drawn = {_kind(stage) for stage in stages if stage.start <= high and stage.end >= low}
    handles = [
        Patch(facecolor=shade, edgecolor="0.6", linewidth=0.3, label=kind)
        for kind, shade in colours.items()
        if kind in drawn
    ]
    title = f"stages of start {result.fixed['start']:g}" if "start" in result.fixed else None
    if not legend:
        return StageArtists(stages, shades, None)
    assert axes.figure is not None
    # Above the axes are the panel's letter and the marks of lanes that cannot be shown.
    names = axes.figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=len(handles),
        title=title,
        title_fontsize=SMALL_FONT_PT,
        **LEGEND,
    )
    return StageArtists(stages, shades, names)


def _kind(stage: Stage) -> str:
    return "longer period" if stage.period > 2 else stage.label
