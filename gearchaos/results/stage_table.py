"""Stages of a sweep: stretches of the swept parameter over which the motion keeps its label."""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.results.result import Result
from gearchaos.results.variables import BANDS, LABELS, LARGEST_EXPONENT, REPEATS

Floats = NDArray[np.float64]


class LabelledLanes(NamedTuple):
    """Lanes in ascending order of the swept value, one per value.

    ``values``, ``exponent`` (lanes,): not a number where no exponent is known; ``labels`` (lanes,):
    such as "period 3" or "chaotic"; ``period`` (lanes,) in mesh periods, 0 where not periodic.
    """

    values: Floats
    labels: NDArray[np.str_]
    period: NDArray[np.int32]
    exponent: Floats


class Stage(NamedTuple):
    """A stretch of the swept parameter with one kind of motion.

    ``first``, ``last``: the numbers of its outermost lanes; ``start``, ``end``: their values;
    ``narrower``: stages between them that are too narrow to be told apart; the exponents
    are those of the lanes with its own label.
    """

    first: int
    last: int
    start: float
    end: float
    label: str
    period: int
    narrower: int
    lowest_exponent: float
    highest_exponent: float

    @property
    def lanes(self) -> int:
        """Number of its lanes, those of narrower stages among them."""
        return self.last - self.first + 1


class _Stretch(NamedTuple):
    """First lane, the lane after its last one, a lane that has its label, narrower stages."""

    first: int
    after: int
    own: int
    narrower: int


def labelled_lanes(result: Result, *, name: str = "the result") -> LabelledLanes:
    """Take the labels out of a result with one axis, which messages call by a name.

    Raises FileError if the result has no labels, ConfigurationError if it has not one axis.
    """
    if not all(variable in result for variable in LABELS):
        raise FileError(
            f"{name}: holds no labels of the motion; run the sweep again with outputs.motion = true"
        )
    if len(result.axes) != 1:
        raise ConfigurationError(
            f"{name}: has {len(result.axes)} axes ({', '.join(result.axes)}), stages lie along "
            "one; fix the others with sel (--at)"
        )
    meanings, period = result.variables["motion"].flags, result["period"]
    labels = [
        label_text(meanings[motion], int(n))
        for motion, n in zip(result["motion"], period, strict=True)
    ]
    known = LARGEST_EXPONENT in result
    exponent = result[LARGEST_EXPONENT] if known else np.full(period.shape, np.nan)
    return LabelledLanes(result[result.axis], np.array(labels), period, exponent)


def one_axis(result: Result, **coordinates: float) -> Result:
    """Take the slice of a result along one swept parameter, at the coordinates nearest to these.

    Other axes are fixed at their first value. Raises ConfigurationError if there is no such axis,
    or if no swept parameter is left.
    """
    part = result.sel("nearest", **coordinates)
    if part.axis in ("", *REPEATS):
        raise ConfigurationError(f"{', '.join(coordinates)}: fixed, no swept parameter is left")
    return part.sel(**{name: part[name][0] for name in part.axes if name != part.axis})


def slice_facts(result: Result, part: Result) -> dict[str, dict[str, float]]:
    """Tell of each axis that a slice lacks at which value, which of how many, it was fixed."""
    return {
        name: {
            "value": part.fixed[name],
            "number": int(np.searchsorted(result[name], part.fixed[name])) + 1,
            "of": result[name].size,
        }
        for name in result.axes
        if name not in part.axes
    }


def slice_lines(facts: dict[str, dict[str, float]]) -> list[str]:
    """Word `slice_facts`, one line per axis."""
    return [
        f"slice {name} = {at['value']:.6g}, "
        f"{'the first' if at['number'] == 1 else 'number {number}'.format(**at)} of {at['of']}; "
        f"others with --at {name}=VALUE"
        for name, at in facts.items()
    ]


def label_text(meaning: str, period: int) -> str:
    """Word a label: "period 3", "quasi-periodic", "chaotic"."""
    return f"period {period}" if period > 0 else meaning.replace("_", "-")


def stage_table(lanes: LabelledLanes, narrowest: float = 0.0) -> list[Stage]:
    """List the stages of a sweep in ascending order.

    Stages narrower than ``narrowest`` go into what surrounds them: the narrowest first, into both
    neighbours where these are alike and otherwise into the wider one; of two alike the lower one. A
    stage reaches halfway to the lanes beside it.
    """
    changes = np.flatnonzero(lanes.labels[1:] != lanes.labels[:-1]) + 1
    edges = [0, *changes.tolist(), lanes.values.size]
    middles = (lanes.values[1:] + lanes.values[:-1]) / 2.0
    borders = np.concatenate([lanes.values[:1], middles, lanes.values[-1:]]).tolist()

    def width(stretch: _Stretch) -> float:
        return float(borders[stretch.after] - borders[stretch.first])

    by_first = {a: _Stretch(a, b, a, 0) for a, b in pairwise(edges)}
    by_after = {stretch.after: stretch for stretch in by_first.values()}
    heap = [(width(stretch), stretch) for stretch in by_first.values()]
    heapify(heap)
    while len(by_first) > 1 and heap[0][0] < narrowest:
        _, stretch = heappop(heap)
        if by_first.get(stretch.first) is not stretch:
            continue  # It has become part of another one since.
        beside = [by_after.get(stretch.first), by_first.get(stretch.after)]
        there = [neighbour for neighbour in beside if neighbour is not None]
        label = lanes.labels[max(there, key=width).own]
        merged = [near for near in there if lanes.labels[near.own] == label] + [stretch]
        whole = _Stretch(
            min(old.first for old in merged),
            max(old.after for old in merged),
            merged[0].own,
            1 + sum(old.narrower for old in merged),
        )
        for old in merged:
            del by_first[old.first], by_after[old.after]
        by_first[whole.first] = by_after[whole.after] = whole
        heappush(heap, (width(whole), whole))
    return [_stage(lanes, *by_first[first]) for first in sorted(by_first)]


def band_counts(result: Result, stages: Sequence[Stage]) -> list[dict[int, int]]:
    """Count in every stage the lanes with its own label by the number of their bands.

    Empty where the motion has none, or the result, which has one axis, does not tell.
    """
    if BANDS not in result:
        return [{} for _ in stages]
    labels, counts = labelled_lanes(result).labels, []
    for stage in stages:
        inside = slice(stage.first, stage.last + 1)
        bands = result[BANDS][inside][labels[inside] == stage.label]
        numbers, lanes = np.unique(bands[bands > 0], return_counts=True)
        counts.append(dict(zip(numbers.tolist(), lanes.tolist(), strict=True)))
    return counts


def _stage(lanes: LabelledLanes, first: int, after: int, own: int, narrower: int) -> Stage:
    label = str(lanes.labels[own])
    inside = slice(first, after)
    exponents = lanes.exponent[inside][lanes.labels[inside] == label]
    known = exponents[np.isfinite(exponents)]
    return Stage(
        first,
        after - 1,
        float(lanes.values[first]),
        float(lanes.values[after - 1]),
        label,
        int(lanes.period[own]),
        narrower,
        float(known.min()) if known.size else float("nan"),
        float(known.max()) if known.size else float("nan"),
    )
