"""The stages of a sweep as the paper counts them: spans with one motion, narrow windows aside."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from gearchaos.paper.published import Stage
from gearchaos.paper.verdict import RULES
from gearchaos.results.result import Result
from gearchaos.results.stage_table import LabelledLanes, labelled_lanes

Span = tuple[float, float]

WINDOW = 0.1
"""Width, in multiples of e(tau), up to which other motions inside a stage do not end it."""


def counterparts(published: Sequence[Stage], result: Result) -> list[Span | None]:
    """Find the stage of a sweep that answers each printed one.

    Of the spans with the printed motion, the one that has most in common with the printed span; if
    there is none that overlaps, the nearest one within reach of the rule for boundaries, or None.
    """
    lanes = labelled_lanes(result)
    return [_counterpart(stage, _spans(lanes, stage.motion)) for stage in published]


def motion_at(result: Result, value: float) -> str:
    """Return the label of the lane next to a value, such as ``period 2`` or ``chaotic``."""
    lanes = labelled_lanes(result)
    return str(lanes.labels[np.argmin(np.abs(lanes.values - value))])


def motions_between(result: Result, first: float, last: float) -> list[str]:
    """Return the labels of the lanes from one value to another, both included."""
    lanes = labelled_lanes(result)
    # A value that is the first or the last but for rounding is inside.
    margin = 1e-9 * (abs(first) + abs(last))
    inside = (lanes.values >= first - margin) & (lanes.values <= last + margin)
    return [str(label) for label in lanes.labels[inside]]


def _spans(lanes: LabelledLanes, motion: str) -> list[Span]:
    """First and last value of every span with a motion, other motions in narrow windows aside."""
    numbers = np.flatnonzero(lanes.labels == motion)
    if not numbers.size:
        return []
    values = lanes.values[numbers]
    apart = (np.diff(values) > WINDOW) & (np.diff(numbers) > 1)
    edges = [0, *(np.flatnonzero(apart) + 1).tolist(), values.size]
    return [(float(values[a]), float(values[b - 1])) for a, b in pairwise(edges)]


def _counterpart(stage: Stage, spans: Sequence[Span]) -> Span | None:
    def common(span: Span) -> float:
        return min(span[1], stage.last) - max(span[0], stage.first)

    best = max(spans, key=common, default=None)
    return best if best is not None and common(best) >= -RULES["boundary"].in_kind else None
