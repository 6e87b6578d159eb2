"""Changes that labels do not show: jumps between motions of one period, crises, hysteresis.

In an interior crisis a chaotic set collides with an unstable orbit and suddenly grows (Grebogi,
Ott, Yorke 1982). Close to the crisis, bursts are rare and a section of some hundred points may miss
them. The lane beside the crisis is therefore found from the sections of several lanes.
"""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Counts, Floats, Integers, Mask
from gearchaos.outputs.names import DIRECTION, WAYS
from gearchaos.records.period import TOLERANCE, section_distance
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.result import Result, section_variables
from gearchaos.results.reading.stage_table import labelled_lanes

STEEPEST, STEEPER = 5.0, 3.0
"""Factors by which lanes at a jump are farther apart than the lanes on one side, and on both.

Where a contact begins, a motion may change with the square root of the parameter: the first step is
then up to 2.5 times as long as the next one, and any number of times as long as the one before.
"""

SMALLEST = 0.02  # Smallest jump, relative to the size of the section over the sweep.
FAINT, FAINTEST = 2.0, 1e-3
"""The same factor for a jump that may be one, on both sides, and its smallest size."""

UNSETTLED = 1e3
"""Smallest jump next to a lane that still converges, in return distances of this lane.

The distance from the orbit is the return distance over 1 - |multiplier| of the slowest mode.
"""

BESIDE = 8  # Number of lanes on either side of a crisis that are compared.
FEWEST = 3  # Fewest lanes on either side of a crisis; two of them must be chaotic.
SMALLEST_GROWTH = 0.15  # Smallest growth of the extent, relative to the largest one before.


class Jump(NamedTuple):
    """Two neighbouring values, ``below`` and ``above``, with the same label but distant motions."""

    below: float
    above: float
    label: str


class Crisis(NamedTuple):
    """Two neighbouring swept values between which a chaotic set suddenly grows or shrinks.

    Attributes
    ----------
    below, above : float
        The two values.
    section : str
        The section variable whose extent changes most.
    lowest_below, highest_below, lowest_above, highest_above : float
        Extremes of that variable over the eight lanes below and the eight lanes above.
    """

    below: float
    above: float
    section: str
    lowest_below: float
    highest_below: float
    lowest_above: float
    highest_above: float


class Apart(NamedTuple):
    """A stretch of swept values in which the upward and the downward sweep differ.

    Attributes
    ----------
    first, last : int
        Numbers of its outermost lanes.
    start, end : float
        Swept values of these lanes.
    lower, upper : float
        Halfway to the lanes beside them, or the end of the sweep. The downward sweep jumps at
        ``lower``, the upward sweep at ``upper``.
    motion_upwards, motion_downwards : str
        Labels of the motions in the order of the values.
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

    Parameters
    ----------
    result : Result
        A result with one axis and labels. Without a section no jump is found.

    Returns
    -------
    list of Jump
        The jumps in ascending order.

    Notes
    -----
    On one branch the points of a section move by similar steps from lane to lane. They move fastest
    towards a fold; even there each step is less than three times the one before.

    Examples
    --------
    >>> from gearchaos.results.reading.jumps import jumps
    >>> jumps(gearchaos.open_result("pan2021.h5"))
    []
    """
    lanes = labelled_lanes(result)
    sections = sections_of(result)
    sizes = jump_sizes(lanes.period, sections / size_of(sections))
    # A lane that still converges to its orbit may be at any distance from it.
    returns = np.nan_to_num(result["return_distance"])
    away = np.maximum(returns[:-1], returns[1:])
    arrived = (away <= TOLERANCE) | (sizes > UNSETTLED * away)
    found = np.flatnonzero((sizes > 0.0) & arrived)
    return [
        Jump(float(lanes.values[at]), float(lanes.values[at + 1]), str(lanes.labels[at]))
        for at in found
    ]


def sections_of(result: Result) -> Floats:
    """Return the sections of all lanes, one point per excitation period.

    Shape (lanes, points, states); without a section there are no points and no states.
    """
    names = section_variables(result)
    if not names:
        return np.zeros((result.lanes("period").size, 0, 0))
    # Neighbouring lanes may differ by whole excitation periods along their orbit, not by parts.
    every = excitation_of(result.metadata).excitation_period
    return np.stack([result.lanes(name)[:, ::-every][:, ::-1] for name in names], axis=2)


def size_of(sections: Floats) -> Floats:
    """Return the size of each state over the lanes of sections, shape (states,)."""
    size = np.nanmax(np.abs(sections), axis=(0, 1), initial=0.0)
    return np.where(size > 0.0, size, 1.0)


def jump_sizes(
    period: Counts,
    section: Floats,
    cells: Floats | float = 1.0,
    alone: float = np.nan,
    faint: Mask | bool = False,
) -> Floats:
    """Return the distance of neighbouring lanes at a jump, 0 elsewhere, shape (lanes - 1,).

    A jump leads from one branch to another one of the same period.

    Parameters
    ----------
    period : array of int, shape (lanes,)
        Period of each motion, 0 where it is not periodic.
    section : array, shape (lanes, points, states)
        Sections relative to the size of each state over the sweep.
    cells : array, shape (lanes - 1,)
        Distances of the swept values.
    alone : float
        Distance that is assumed between lanes of different periods. With 0, two lanes without
        comparable lanes beside them may count as a jump. At the ends of the sweep only the inner
        side is compared.
    faint : bool, or array of bool, shape (lanes - 1,)
        Where smaller and less steep changes count as well. Some of them are no jumps.

    Returns
    -------
    array, shape (lanes - 1,)
        Distances of the sections, relative to the size of each state.
    """
    enough = (period[1:] > 0) & (period[1:] <= section.shape[1])
    common = np.where(enough & (period[1:] == period[:-1]), period[1:], 0).astype(np.int32)
    apart = section_distance(section[:-1], section[1:], common)
    # fmin and fmax: beside the end of a stage, only the other side can be compared.
    rate = np.where(np.isnan(apart), alone, apart) / cells
    rate = np.pad(rate, 1, constant_values=np.nan)
    one, both = (of(rate[:-2], rate[2:]) * cells for of in (np.fmin, np.fmax))
    jump = (apart > SMALLEST) & (apart > STEEPEST * one) & (apart > STEEPER * both)
    small = (apart > FAINTEST) & (apart > FAINT * both)
    return np.where(jump | faint & small, apart, 0.0)


def crises(result: Result) -> list[Crisis]:
    """Find the crises of a sweep, see `grows_at`, for a rising and for a falling parameter.

    Parameters
    ----------
    result : Result
        A result with one axis and labels. Without a section no crisis is found.

    Returns
    -------
    list of Crisis
        The crises in ascending order.

    Examples
    --------
    >>> from gearchaos.results.reading.jumps import crises
    >>> crises(gearchaos.open_result("pan2021.h5"))
    []
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
    """Return the lanes at which the extent of chaotic sections suddenly grows, in ascending order.

    Parameters
    ----------
    extent : array, shape (lanes,)
        Extent of the section in one coordinate, in the order of the swept value.
    chaotic : array of bool, shape (lanes,)
        Whether a lane is chaotic.

    Returns
    -------
    array of int, shape (crises,)
        Numbers of the lanes.

    Notes
    -----
    A lane counts if it is chaotic and all of these hold:

    - its extent exceeds that of each of the eight lanes before it by 15 %;
    - the median extent of the eight lanes from it on exceeds that of each lane before it;
    - the largest extent before it is nearer to the median extent before it than to its own.

    Lanes before it may belong to periodic windows.
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
        # Later lanes may visit more of the region that the same crisis has opened.
        if grown and lasting and level and not (found and lane - found[-1] < BESIDE):
            found.append(int(lane))
    return np.array(found, dtype=np.intp)


def directions_of(result: Result) -> list[Result]:
    """Return the results of both directions, or the result itself if it has no direction."""
    both = DIRECTION in result.axes and result.axis != DIRECTION
    return [result.sel(direction=way) for way in WAYS] if both else [result]


def apart(result: Result, narrowest: float = 0.0) -> list[Apart]:
    """Find the stretches in which the upward and the downward sweep differ.

    Parameters
    ----------
    result : Result
        A result with labels. Without directions, or with several starts or drawn systems, nothing
        is found.
    narrowest : float
        Narrower stretches, in units of the swept parameter, are left out.

    Returns
    -------
    list of Apart
        The stretches in ascending order.

    Notes
    -----
    Two motions differ if their labels differ, or if their sections are farther apart than
    `SMALLEST`; of motions of period 1, the end states are compared as well. Motions without a
    period also differ if the extents of their sections in some state have nothing in common.
    """
    ways = directions_of(result)
    if len(ways) == 1 or len(ways[0].axes) > 1:
        return []
    lanes = [labelled_lanes(one) for one in ways]
    differ = lanes[0].labels != lanes[1].labels
    differ |= (lanes[0].period <= 0) & _separate(*map(sections_of, ways))
    period = np.where(differ, 0, lanes[0].period)
    # Branches may cross in the recorded states, but not in all; the end state is one point of it.
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


def _separate(one: Floats, other: Floats) -> Mask:
    """Return whether the extents of two sections have nothing in common in some state, (lanes,)."""
    if not one.size:
        return np.zeros(len(one), dtype=bool)
    below = (one.max(axis=1) < other.min(axis=1)) | (other.max(axis=1) < one.min(axis=1))
    return np.asarray(below.any(axis=1))
