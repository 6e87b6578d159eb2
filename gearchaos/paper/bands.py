"""The third stage of Pan 2021: motion that visits two bands in turn, until a crisis widens it.

The paper's "two-times quasi-periodic" motion (its figure 10: two closed bands of curves, two sets
of section points) is read as what a cascade of period doublings leaves behind: first motions of
longer periods, then chaos on bands that are visited in turn, and that grow until they touch. An
interior crisis ends it: the attractor takes in at once what was beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.results.result import Result
from gearchaos.results.stage_table import LabelledLanes, labelled_lanes

Floats = NDArray[np.float64]

TWO_BANDS = "two bands"
TOUCHING = "two bands that touch"

OUT_OF_TURN = 0.25
"""Largest share of points out of turn: half of that of a coin, below the third of a period 3."""


class Crisis(NamedTuple):
    """Where a section widens at once: ``before``, the widest up to there, and ``after``, there."""

    value: float
    before: float
    after: float


def crisis_of(sweep: Result) -> Crisis | None:
    """Find the greatest growth, from a lane to the next, of the widest section so far.

    Among the lanes from the first motion on two bands to the first that no longer takes turns; None
    where there are fewer than three.
    """
    lanes, width = labelled_lanes(sweep), np.ptp(sweep["section_delta_5"], axis=1)
    shares = out_of_turn(sweep["section_delta_5"])
    strictly = np.flatnonzero(_longer(lanes) & (shares == 0.0))
    if not strictly.size:
        return None
    first = int(strictly[0])
    lost = np.flatnonzero(~(shares[first:] <= OUT_OF_TURN))
    after = first + int(lost[0]) if lost.size else lanes.values.size
    if after - first < 3:
        return None
    widest = np.maximum.accumulate(width[first:after])
    last = int(np.argmax(widest[1:] / widest[:-1]))
    return Crisis(
        float(lanes.values[first + last + 1]), float(widest[last]), float(widest[last + 1])
    )


def lanes_as_printed(result: Result, crisis: Crisis | None = None) -> LabelledLanes:
    """Label as two bands what has more than two points, takes turns, and is as before a crisis.

    Narrower, that is, than the mean of the two widths of the crisis.
    """
    lanes, section = labelled_lanes(result), result["section_delta_5"]
    widest = np.inf if crisis is None else (crisis.before + crisis.after) / 2.0
    on_two = _longer(lanes) & (out_of_turn(section) <= OUT_OF_TURN)
    on_two &= np.ptp(section, axis=1) < widest
    return lanes._replace(
        labels=np.where(on_two, TWO_BANDS, lanes.labels), period=np.where(on_two, 0, lanes.period)
    )


def motions_shown(result: Result, crisis: Crisis | None = None) -> LabelledLanes:
    """Label as `lanes_as_printed`, but call bands that are not visited strictly in turn touching.

    For a single motion: the two sets of section points of figure 10 lie apart.
    """
    lanes = lanes_as_printed(result, crisis)
    touch = (lanes.labels == TWO_BANDS) & (out_of_turn(result["section_delta_5"]) > 0.0)
    return lanes._replace(labels=np.where(touch, TOUCHING, lanes.labels))


def out_of_turn(section: Floats) -> Floats:
    """Return the share of points on the same side of the median as the one before, (lanes,).

    It is zero for two bands in turn, and a half where the next point could be on either side.
    """
    above = section > np.median(section, axis=1, keepdims=True)
    return np.asarray(np.mean(above[:, 1:] == above[:, :-1], axis=1))


def _longer(lanes: LabelledLanes) -> NDArray[np.bool_]:
    # What is unresolved may be a period 2 that is slow to settle.
    return np.asarray((lanes.period > 2) | np.isin(lanes.labels, ("chaotic", "quasi-periodic")))
