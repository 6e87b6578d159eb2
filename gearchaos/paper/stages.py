"""The stages of a sweep beside those that the paper prints.

The paper's "two-times quasi-periodic" motion (its figure 10: two closed bands of curves, two sets
of section points) is read as one that visits two bands in turn, be it periodic or chaotic on them:
what a cascade of period doublings leaves behind, until a crisis widens the attractor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearchaos.paper.published import PrintedStage
from gearchaos.paper.verdict import RULES
from gearchaos.results.result import Result
from gearchaos.results.stage_table import LabelledLanes, Stage, labelled_lanes, stage_table

WINDOW = 0.1
"""Narrowest stage, in multiples of e(tau): narrower ones are windows in what surrounds them."""


TWO_BANDS = "two bands"

EXCEPTIONS = 0.05
"""Share of its section points that may follow one from the same band: the bands may touch."""


def lanes_as_printed(result: Result) -> LabelledLanes:
    """Label the lanes as the paper does: motions of more than two points on two bands by these."""
    lanes, on_two = labelled_lanes(result), on_two_bands(result)
    return lanes._replace(
        labels=np.where(on_two, TWO_BANDS, lanes.labels), period=np.where(on_two, 0, lanes.period)
    )


def on_two_bands(result: Result, exceptions: float = EXCEPTIONS) -> NDArray[np.bool_]:
    """Return which motions of more than two points visit two bands in turn, shape (lanes,).

    ``exceptions`` is the largest share of their section points that may be `out_of_turn`.
    """
    lanes, stays = labelled_lanes(result), out_of_turn(result["section_delta_5"])
    longer = (lanes.period > 2) | np.isin(lanes.labels, ("chaotic", "quasi-periodic", "unresolved"))
    return np.asarray(longer & (stays <= exceptions))


def out_of_turn(section: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of points on the same side of the median as the one before, (lanes,).

    It is zero for two bands in turn, and a half where the next point could be on either side.
    """
    above = section > np.median(section, axis=1, keepdims=True)
    return np.asarray(np.mean(above[:, 1:] == above[:, :-1], axis=1))


def counterparts(printed: Sequence[PrintedStage], result: Result) -> list[Stage | None]:
    """Find the stage of a sweep that answers each printed one.

    Of the stages with the printed motion, the one that has most in common with the printed one; if
    there is none that overlaps, the nearest one within reach of the rule for boundaries, or None.
    """
    stages = stage_table(lanes_as_printed(result), WINDOW)
    return [_counterpart(one, [s for s in stages if s.label == one.motion]) for one in printed]


def motion_at(result: Result, value: float) -> str:
    """Return the motion of the lane next to a value, such as ``period 2`` or ``two bands``."""
    lanes = lanes_as_printed(result)
    return str(lanes.labels[np.argmin(np.abs(lanes.values - value))])


def motions_between(result: Result, first: float, last: float) -> list[str]:
    """Return the motions of the lanes from one value to another, both included."""
    lanes = lanes_as_printed(result)
    # A value that is the first or the last but for rounding is inside.
    margin = 1e-9 * (abs(first) + abs(last))
    inside = (lanes.values >= first - margin) & (lanes.values <= last + margin)
    return [str(label) for label in lanes.labels[inside]]


def own_share(result: Result, stage: Stage) -> float:
    """Return the share of the lanes of a stage that have its own motion."""
    labels = lanes_as_printed(result).labels[stage.first : stage.last + 1]
    return float(np.mean(labels == stage.label))


def _counterpart(printed: PrintedStage, alike: Sequence[Stage]) -> Stage | None:
    def common(stage: Stage) -> float:
        return min(stage.end, printed.last) - max(stage.start, printed.first)

    best = max(alike, key=common, default=None)
    return best if best is not None and common(best) >= -RULES["boundary"].in_kind else None
