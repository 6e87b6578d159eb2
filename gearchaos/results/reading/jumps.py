"""What labels do not show: jumps to a motion of the same period, crises, directions that differ.

In an interior crisis a chaotic set collides with an unstable orbit and bursts out into what lies
beyond it (Grebogi, Ott, Yorke 1982). Close to it the bursts are rare, so that a section of some
hundred points may miss them: the lane beside the crisis is told from what several lanes visit.
"""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Counts, Floats, Integers, Mask
from gearchaos.outputs.names import DIRECTION, WAYS
from gearchaos.records.period import TOLERANCE, section_distance
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.result import Result, section_variables
from gearchaos.results.reading.stage_table import labelled_lanes

STEEPEST = 5.0
"""Neighbouring lanes lie this many times farther apart than those beside them where they jump."""

SMALLEST = 0.02  # Smallest jump, relative to the size of the section over the sweep.
BESIDE = 8  # Lanes on either side of a crisis that are compared.
FEWEST = 3  # Lanes that there must be on either side, two of them chaotic.
SMALLEST_GROWTH = 0.15  # Growth of the extent that counts, relative to the largest one before.


class Jump(NamedTuple):
    """Two neighbouring values with the same label and motions far apart."""

    below: float
    above: float
    label: str


class Crisis(NamedTuple):
    """Two neighbouring values of the swept parameter between which chaos grows or shrinks at once.

    ``section`` is the variable in which it does so most; the four others are the smallest and
    largest value that it takes on the eight lanes below and above.
    """

    below: float
    above: float
    section: str
    lowest_below: float
    highest_below: float
    lowest_above: float
    highest_above: float


class Apart(NamedTuple):
    """Neighbouring values at which both directions come to different motions.

    ``first``, ``last``: the numbers of its outermost lanes; ``start``, ``end``: their values;
    ``lower``, ``upper``: halfway to the lanes beside them, where the sweep downwards and the one
    upwards jump, or where the sweep ends; ``motion_upwards``, ``motion_downwards``: the labels of
    the motions, in the order of the values.
    """

    first: int
    last: int
    start: float
    end: float
    lower: float
    upper: float
    motion_upwards: str
    motion_downwards: str


def jumps(result: Result) -> list[Jump]:
    """Find where a sweep jumps from one motion to another of the same period.

    On one branch the points of the section move little from lane to lane, and steadily so: towards
    a fold, where they move fastest, each step is less than three times the one before. The result
    has one axis and labels; without a section nothing is found.
    """
    lanes = labelled_lanes(result)
    # A lane still on its way to its orbit lies anywhere.
    arrived = ~(result["return_distance"] > TOLERANCE)
    sections = sections_of(result)
    period = np.where(arrived, lanes.period, 0)
    found = np.flatnonzero(jump_sizes(period, sections / size_of(sections)))
    return [
        Jump(float(lanes.values[at]), float(lanes.values[at + 1]), str(lanes.labels[at]))
        for at in found
    ]


def sections_of(result: Result) -> Floats:
    """Return all sections along one axis, a point for each excitation period.

    Shape (lanes, points, states), with no states where there is no section.
    """
    names = section_variables(result)
    if not names:
        return np.zeros((result[result.axis].size, 0, 0))
    # Neighbours may be an excitation period apart on their orbit, but never a part of one.
    every = excitation_of(result.metadata).excitation_period
    return np.stack([result[name][:, ::-every][:, ::-1] for name in names], axis=2)


def size_of(sections: Floats) -> Floats:
    """Return the size of each state over the lanes of sections, shape (states,)."""
    size = np.nanmax(np.abs(sections), axis=(0, 1), initial=0.0)
    return np.where(size > 0.0, size, 1.0)


def jump_sizes(
    period: Counts, section: Floats, cells: Floats | float = 1.0, alone: float = np.nan
) -> Floats:
    """Return how far neighbouring lanes move apart where they jump, else 0, shape (lanes - 1,).

    Lanes of the same period, that is, that move on different branches. ``period`` (lanes,) is 0
    where the motion is not periodic; ``section`` (lanes, points, states) is relative to the size of
    each state over the sweep; ``cells`` (lanes - 1,): distances of the swept values; ``alone``: how
    far apart lanes of different motions count, so that with 0 two that have no others beside them
    may jump.
    """
    enough = (period[1:] > 0) & (period[1:] <= section.shape[1])
    common = np.where(enough & (period[1:] == period[:-1]), period[1:], 0).astype(np.int32)
    apart = section_distance(section[:-1], section[1:], common)
    # Where one side is missing, or another stage begins there, the other side must do.
    rate = np.pad(np.where(np.isnan(apart), alone, apart) / cells, 1, constant_values=alone)
    beside = np.fmax(rate[:-2], rate[2:]) * cells
    return np.where((apart > SMALLEST) & (apart > STEEPEST * beside), apart, 0.0)


def crises(result: Result) -> list[Crisis]:
    """Find where a sweep has a crisis, see `grows_at`, with the parameter growing or falling.

    The result has one axis and labels; without a section nothing is found.
    """
    lanes = labelled_lanes(result)
    chaotic = lanes.labels == "chaotic"
    found: dict[int, tuple[float, Crisis]] = {}
    for name in section_variables(result):
        lowest, highest = np.min(result[name], axis=1), np.max(result[name], axis=1)
        extent = highest - lowest
        upwards = grows_at(extent, chaotic)
        downwards = extent.size - grows_at(extent[::-1], chaotic[::-1])
        for lane in (*upwards.tolist(), *downwards.tolist()):
            sides = slice(max(0, lane - BESIDE), lane), slice(lane, lane + BESIDE)
            ends = [(np.nanmin(lowest[side]), np.nanmax(highest[side])) for side in sides]
            one, other = (high - low for low, high in ends)
            growth = max(one / other, other / one)
            if lane not in found or growth > found[lane][0]:
                place = lanes.values[lane - 1 : lane + 1].tolist()
                found[lane] = growth, Crisis._make([*place, name, *np.ravel(ends).tolist()])
    return [found[lane][1] for lane in sorted(found)]


def grows_at(extent: Floats, chaotic: Mask) -> Integers:
    """Return the lanes at which the extent of chaotic sections grows at once, in ascending order.

    ``extent`` (lanes,) of the section in one coordinate, in the order of the swept value;
    ``chaotic`` (lanes,). Such a lane is chaotic, and extends by 15 % more than any of the eight
    before it, half of the eight from it on do by something; these are level among themselves, their
    largest extent nearer to the median than to that of the lane. Lanes before it may belong to
    periodic windows.
    """
    found: list[int] = []
    for lane in np.flatnonzero(chaotic):
        before, after = slice(max(0, lane - BESIDE), lane), slice(lane, lane + BESIDE)
        if any(np.sum(chaotic[side]) < 2 or extent[side].size < FEWEST for side in (before, after)):
            continue
        largest, usual = np.nanmax(extent[before]), np.nanmedian(extent[before])
        grown = extent[lane] > (1.0 + SMALLEST_GROWTH) * largest
        lasting = np.nanmedian(extent[after]) > largest
        level = extent[lane] - largest > largest - usual
        # The next lanes may show still more of what the same crisis has opened.
        if grown and lasting and level and not (found and lane - found[-1] < BESIDE):
            found.append(int(lane))
    return np.array(found, dtype=np.intp)


def directions_of(result: Result) -> list[Result]:
    """Return the results of both directions, or the result itself where there are not two."""
    both = DIRECTION in result.axes and result.axis != DIRECTION
    return [result.sel(direction=way) for way in WAYS] if both else [result]


def apart(result: Result, narrowest: float = 0.0) -> list[Apart]:
    """Find the stretches in which both directions of a result with labels differ.

    They do in their labels, or in sections or, of period 1, end states farther apart than the
    smallest jump that is told. Chaos and quasi-periodic motions of one label count as one motion.
    Stretches narrower than ``narrowest`` are left out; without directions, or with several starts
    or gear pairs, there are none.
    """
    ways = directions_of(result)
    if len(ways) == 1 or len(ways[0].axes) > 1:
        return []
    lanes = [labelled_lanes(one) for one in ways]
    differ = lanes[0].labels != lanes[1].labels
    period = np.where(differ, 0, lanes[0].period)
    # Branches may cross in the states of a section, but not in all; the end state is one point.
    ends = (one["end_state"][:, np.newaxis] for one in ways)
    for one, other in map(sections_of, ways), ends:
        size = size_of(np.concatenate([one, other]))
        held = np.where(period <= one.shape[1], period, 0)
        differ |= section_distance(one / size, other / size, held) > SMALLEST
    values, changes = lanes[0].values, np.diff(differ, prepend=False, append=False)
    borders = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2.0, values[-1:]])
    return [
        Apart(
            first,
            after - 1,
            *values[[first, after - 1]].tolist(),
            *borders[[first, after]].tolist(),
            *(", ".join(dict.fromkeys(way.labels[first:after].tolist())) for way in lanes),
        )
        for first, after in np.flatnonzero(changes).reshape(-1, 2).tolist()
        if borders[after] - borders[first] >= narrowest
    ]
