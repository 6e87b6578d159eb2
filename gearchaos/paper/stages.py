"""Labels for the third stage of Pan 2021: two bands visited in turn, until a crisis widens them.

The paper's "two-times quasi-periodic" motion (its figure 10: two closed bands of curves, two sets
of section points) is interpreted as the end of a cascade of period doublings: motions of longer
periods, then chaos on bands that are visited in turn and grow until they touch. An interior crisis
ends this stage: the attractor suddenly grows.
"""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats, Mask
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import LabelledLanes, labelled_lanes

TWO_BANDS = "two bands"
TOUCHING = "two bands that touch"

OUT_OF_TURN = 0.25
"""Largest share of points out of turn: half of a random sequence's, below a period 3's third."""


class Widening(NamedTuple):
    """Swept value at which the section suddenly widens, and its widths before and after."""

    value: float
    before: float
    after: float


def crisis_of(sweep: Result) -> Widening:
    """Find the largest growth from one lane to the next of the running maximum of the width.

    The lanes are those from the first motion on two bands to the last that visits them in turn.
    """
    lanes, section = labelled_lanes(sweep), sweep["section_delta_5"]
    shares = out_of_turn(section)
    first = int(np.argmax(_longer(lanes) & (shares == 0.0)))
    turning = np.logical_and.accumulate(shares[first:] <= OUT_OF_TURN)
    widest = np.maximum.accumulate(np.ptp(section[first:][turning], axis=1))
    last = int(np.argmax(widest[1:] / widest[:-1]))
    place = float(lanes.values[first + last + 1])
    return Widening(place, float(widest[last]), float(widest[last + 1]))


def lanes_as_printed(result: Result, crisis: Widening, *, strictly: bool = False) -> LabelledLanes:
    """Label motions on two bands: more than two points, visited in turn, narrow as before a crisis.

    Narrow means below the mean of the two widths of the crisis. If ``strictly``, bands that are not
    visited strictly in turn are labelled as touching; the bands of figure 10 are apart.
    """
    lanes, section = labelled_lanes(result), result["section_delta_5"]
    widest = (crisis.before + crisis.after) / 2.0
    shares = out_of_turn(section)
    on_two = _longer(lanes) & (shares <= OUT_OF_TURN) & (np.ptp(section, axis=1) < widest)
    names = np.where(strictly & (shares > 0.0), TOUCHING, TWO_BANDS)
    return lanes._replace(
        labels=np.where(on_two, names, lanes.labels), period=np.where(on_two, 0, lanes.period)
    )


def out_of_turn(section: Floats) -> Floats:
    """Return the share of points on the same side of the median as their predecessor, (lanes,).

    It is zero for two bands visited in turn, and a half for a random sequence.
    """
    above = section > np.median(section, axis=1, keepdims=True)
    return np.asarray(np.mean(above[:, 1:] == above[:, :-1], axis=1))


def _longer(lanes: LabelledLanes) -> Mask:
    # Unresolved motions are left out: they may be a period 2 with a long transient.
    return np.asarray((lanes.period > 2) | np.isin(lanes.labels, ("chaotic", "quasi-periodic")))
