"""The stages of a sweep beside those that the paper prints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearchaos.paper.published import PrintedStage
from gearchaos.paper.verdict import RULES
from gearchaos.results.stage_table import LabelledLanes, Stage, stage_table

WINDOW = 0.1
"""Narrowest stage, in multiples of e(tau): narrower ones are windows in what surrounds them."""


def counterparts(printed: Sequence[PrintedStage], lanes: LabelledLanes) -> list[Stage | None]:
    """Find the stage of a sweep that answers each printed one.

    Of the stages with the printed motion, the one that has most in common with the printed one; if
    there is none that overlaps, the nearest one within reach of the rule for boundaries, or None.
    """
    stages = stage_table(lanes, WINDOW)
    return [_counterpart(one, [s for s in stages if s.label == one.motion]) for one in printed]


def motion_at(lanes: LabelledLanes, value: float) -> str:
    """Return the motion of the lane next to a value, such as ``period 2`` or ``two bands``."""
    return str(lanes.labels[np.argmin(np.abs(lanes.values - value))])


def motions_between(lanes: LabelledLanes, first: float, last: float) -> list[str]:
    """Return the motions of the lanes from one value to another, both included."""
    # A value that is the first or the last but for rounding is inside.
    margin = 1e-9 * (abs(first) + abs(last))
    inside = (lanes.values >= first - margin) & (lanes.values <= last + margin)
    return [str(label) for label in lanes.labels[inside]]


def own_share(lanes: LabelledLanes, stage: Stage) -> float:
    """Return the share of the lanes of a stage that have its own motion."""
    labels = lanes.labels[stage.first : stage.last + 1]
    return float(np.mean(labels == stage.label))


def _counterpart(printed: PrintedStage, alike: Sequence[Stage]) -> Stage | None:
    def common(stage: Stage) -> float:
        return min(stage.end, printed.last) - max(stage.start, printed.first)

    best = max(alike, key=common, default=None)
    return best if best is not None and common(best) >= -RULES["boundary"].in_kind else None
