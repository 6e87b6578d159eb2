"""Stages of a sweep: stretches of the swept parameter over which the motion keeps its label."""

from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Counts, Floats
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.outputs.names import BANDS, LABELS, LARGEST_EXPONENT, REPEATS, UNSWEPT
from gearchaos.results.reading.result import Result


class LabelledLanes(NamedTuple):
    """Lanes in ascending order of the swept value, one for each value.

    Attributes
    ----------
    values : array, shape (lanes,)
        Swept values.
    labels : array of str, shape (lanes,)
        Labels such as "period 3" or "chaotic".
    period : array of int, shape (lanes,)
        Period in periods of the excitation, 0 where the motion is not periodic.
    exponent : array, shape (lanes,)
        Largest Lyapunov exponent, NaN where it is unknown.
    bands : array of int, shape (lanes,)
        Number of bands, 0 where the motion has none or they are unknown.
    repeats : tuple of array, or None
        Exponents and bands of all drawn systems and starts of each value, both (lanes, repeats), if
        a value has several; ``exponent`` and ``bands`` are then those of the first one.
    """

    values: Floats
    labels: NDArray[np.str_]
    period: Counts
    exponent: Floats
    bands: Counts
    repeats: tuple[Floats, Counts] | None = None


class Stage(NamedTuple):
    """A stretch of the swept parameter with one kind of motion.

    Attributes
    ----------
    first, last : int
        Numbers of its outermost lanes.
    start, end : float
        Swept values of these lanes.
    label : str
        Label of the motion.
    period : int
        Period in periods of the excitation, 0 where the motion is not periodic.
    lowest_exponent, highest_exponent : float
        Range of the largest Lyapunov exponent over the lanes with this label, NaN if unknown.
    lanes : int
        Number of lanes with all systems and starts, including those of narrower stages that were
        merged into it.
    bands : dict of int to int
        Number of lanes with this label by their number of bands.
    """

    first: int
    last: int
    start: float
    end: float
    label: str
    period: int
    lowest_exponent: float
    highest_exponent: float
    lanes: int
    bands: dict[int, int]


class _Stretch(NamedTuple):
    """First lane of a stretch, the lane after its last one, and a lane that has its label."""

    first: int
    after: int
    own: int


def require_labels(result: Result, name: str = "the result") -> None:
    """Raise a FileError if a result has no labels of the motion; messages use this name."""
    if not all(label in result for label in LABELS):
        raise FileError(
            f"{name}: holds no labels of the motion; run the sweep again with outputs.motion = true"
        )


def labelled_lanes(
    result: Result, *, name: str = "the result", repeats: bool = False
) -> LabelledLanes:
    """Return the labels of a result with one axis.

    Parameters
    ----------
    result : Result
        A result with labels of the motion.
    name : str
        How messages call the result.
    repeats : bool
        Whether the result may also have several drawn pairs and starts. Where their labels differ,
        the label is "several motions", without a period, an exponent or bands.

    Returns
    -------
    LabelledLanes
        Value, label, period, exponent and bands of every lane.

    Raises
    ------
    FileError
        If the result has no labels.
    ConfigurationError
        If it does not have exactly one axis.

    Examples
    --------
    >>> from gearchaos.results.reading.stage_table import labelled_lanes
    >>> labelled_lanes(gearchaos.open_result("pan2021.h5")).values.ndim
    1
    """
    require_labels(result, name)
    one = result.sel(**{axis: result[axis][0] for axis in REPEATS if repeats and axis in result})
    if len(one.axes) != 1:
        raise ConfigurationError(
            f"{name}: has {len(one.axes)} axes ({', '.join(one.axes)}), and stages lie along "
            "one; choose a value of every other axis with --at"
        )
    motion, period = one["motion"].tolist(), one["period"]
    meanings = result.variables["motion"].flags
    labels = [label_text(meanings[m], n) for m, n in zip(motion, period.tolist(), strict=True)]
    every = np.stack([result[label].reshape(period.size, -1) for label in LABELS])
    alike = (every == every[:, :, :1]).all(axis=(0, 2))
    known = LARGEST_EXPONENT in result
    exponents = result[LARGEST_EXPONENT] if known else np.full(period.size, np.nan)
    exponents = np.where(alike[:, np.newaxis], exponents.reshape(period.size, -1), np.nan)
    bands = np.where(alike[:, np.newaxis], result[BANDS].reshape(period.size, -1), 0)
    return LabelledLanes(
        values=one[one.axis],
        labels=np.where(alike, labels, "several motions"),
        period=np.where(alike, period, 0),
        exponent=exponents[:, 0],
        bands=bands[:, 0],
        repeats=(exponents, bands) if every.shape[2] > 1 else None,
    )


def one_axis(result: Result, kept: Sequence[str] = (), /, **coordinates: float) -> Result:
    """Return the slice of a result along one swept parameter, at the coordinates nearest to these.

    All other axes are fixed at their first value, except those in ``kept``. Raises
    ConfigurationError if there is no such axis or value, or if no swept parameter is left.
    """
    part = result.sel("within", **coordinates)
    if part.axis in ("", *UNSWEPT):
        raise ConfigurationError(f"{', '.join(coordinates)}: fixed, no swept parameter is left")
    kept = (part.axis, *kept)
    return part.sel(**{name: part[name][0] for name in part.axes if name not in kept})


def slice_facts(result: Result, part: Result) -> dict[str, float]:
    """Return the value at which each axis is fixed that a slice lacks, by name."""
    return {name: part.fixed[name] for name in result.axes if name not in part.axes}


def label_text(meaning: str, period: int) -> str:
    """Return a label as text: "period 3", "quasi-periodic", "chaotic"."""
    return f"period {period}" if period > 0 else meaning.replace("_", "-")


def stage_table(lanes: LabelledLanes, narrowest: float = 0.0) -> list[Stage]:
    """List the stages of a sweep in ascending order.

    Parameters
    ----------
    lanes : LabelledLanes
        Labels of the lanes.
    narrowest : float
        Stages narrower than this, in units of the swept parameter, are merged into their
        neighbours, beginning with the narrowest one.

    Returns
    -------
    list of Stage
        The stages, without gaps between them.

    Notes
    -----
    A stage reaches halfway to the lanes beside it. A merged stage joins both neighbours where these
    have the same label. Otherwise it joins the wider one, or the lower one of two equal widths.

    Examples
    --------
    >>> from gearchaos.results.reading.stage_table import labelled_lanes, stage_table
    >>> stages = stage_table(labelled_lanes(gearchaos.open_result("pan2021.h5")))
    >>> stages[0].label
    'period 1'
    """
    changes = np.flatnonzero(lanes.labels[1:] != lanes.labels[:-1]) + 1
    edges = [0, *changes.tolist(), lanes.values.size]
    middles = (lanes.values[1:] + lanes.values[:-1]) / 2.0
    borders = np.concatenate([lanes.values[:1], middles, lanes.values[-1:]]).tolist()

    def width(stretch: _Stretch) -> float:
        return float(borders[stretch.after] - borders[stretch.first])

    by_first = {a: _Stretch(a, b, a) for a, b in pairwise(edges)}
    by_after = {stretch.after: stretch for stretch in by_first.values()}
    heap = [(width(stretch), stretch) for stretch in by_first.values()]
    heapify(heap)
    while len(by_first) > 1 and heap[0][0] < narrowest:
        _, stretch = heappop(heap)
        if by_first.get(stretch.first) is not stretch:
            continue  # Merged into another stage since it was put on the heap.
        beside = by_after.get(stretch.first), by_first.get(stretch.after)
        there = [neighbour for neighbour in beside if neighbour is not None]
        label = lanes.labels[max(there, key=width).own]
        merged = [near for near in there if lanes.labels[near.own] == label] + [stretch]
        first, after = min(old.first for old in merged), max(old.after for old in merged)
        whole = _Stretch(first, after, merged[0].own)
        for old in merged:
            del by_first[old.first], by_after[old.after]
        by_first[whole.first] = by_after[whole.after] = whole
        heappush(heap, (width(whole), whole))
    return [_stage(lanes, *by_first[first]) for first in sorted(by_first)]


def _stage(lanes: LabelledLanes, first: int, after: int, own: int) -> Stage:
    label, period = str(lanes.labels[own]), int(lanes.period[own])
    start, end = lanes.values[[first, after - 1]].tolist()
    alike = first + np.flatnonzero(lanes.labels[first:after] == label)
    exponents, bands = lanes.repeats or (lanes.exponent, lanes.bands)
    exponent, bands = exponents[alike], bands[alike]
    count = (after - first) * (bands.shape[1] if lanes.repeats else 1)
    known = exponent[np.isfinite(exponent)]
    low, high = (float(extreme.reduce(known, initial=np.nan)) for extreme in (np.fmin, np.fmax))
    numbers, counts = np.unique(bands[bands > 0], return_counts=True)
    by_bands = dict(zip(numbers.tolist(), counts.tolist(), strict=True))
    return Stage(first, after - 1, start, end, label, period, low, high, count, by_bands)
