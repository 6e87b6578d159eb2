"""The stages of Pan 2021, and the third one: two bands visited in turn, until a crisis widens them.

The paper's "two-times quasi-periodic" motion (its figure 10: two closed bands of curves, two sets
of section points) is read as what a cascade of period doublings leaves behind: first motions of
longer periods, then chaos on bands that are visited in turn, and that grow until they touch. An
interior crisis ends it: the attractor takes in at once what was beside it.
"""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats, Mask
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import LabelledLanes, labelled_lanes

TWO_BANDS = "two bands"
TOUCHING = "two bands that touch"

OUT_OF_TURN = 0.25
"""Largest share of points out of turn: half of that of a coin, below the third of a period 3."""


class Widening(NamedTuple):
    """Where a section widens at once: ``before``, the widest up to there, and ``after``, there."""

    value: float
    before: float
    after: float


def crisis_of(sweep: Result) -> Widening:
    """Find the greatest growth, from a lane to the next, of the widest section so far.

    Among the lanes from the first motion on two bands to the first that no longer takes turns.
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
    """Label as two bands what has more than two points, takes turns, and is as before a crisis.

    Narrower, that is, than the mean of the two widths of the crisis. If ``strictly``, bands that
    are not visited strictly in turn touch: the two of a single motion, as in figure 10, lie apart.
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
    """Return the share of points on the same side of the median as the one before, (lanes,).

    It is zero for two bands in turn, and a half where the next point could be on either side.
    """
    above = section > np.median(section, axis=1, keepdims=True)
    return np.asarray(np.mean(above[:, 1:] == above[:, :-1], axis=1))


def _longer(lanes: LabelledLanes) -> Mask:
    # What is unresolved may be a period 2 that is slow to settle.
    return np.asarray((lanes.period > 2) | np.isin(lanes.labels, ("chaotic", "quasi-periodic")))
