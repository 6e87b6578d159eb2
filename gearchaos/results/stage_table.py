"""Stages of a sweep: stretches of the swept parameter over which the motion keeps its label."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.results.result import Result

Floats = NDArray[np.float64]

LABELS = ("motion", "period")
EXPONENT = "lyapunov_exponent"


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


def labelled_lanes(result: Result, start: int = 0, *, name: str = "the result") -> LabelledLanes:
    """Take the labels out of a result.

    Parameters
    ----------
    result : Result
    start : int
        Number of the start, where every value has several.
    name : str
        What messages call the result.

    Raises
    ------
    FileError
        If the result has no labels.
    ConfigurationError
        If there is no such start.
    """
    if not all(variable in result for variable in LABELS):
        raise FileError(
            f"{name}: holds no labels of the motion; run the sweep again with outputs.motion = true"
        )
    mine = lanes_of_start(result, start)
    if not mine.any():
        highest = result["start"].max() if "start" in result else 0
        raise ConfigurationError(
            f"{name}: start {start}: there is none; give one from 0 to {highest}"
        )
    meanings = result.variables["motion"].flags
    period = result["period"][mine]
    labels = [
        label_text(meanings[motion], int(n))
        for motion, n in zip(result["motion"][mine], period, strict=True)
    ]
    known = EXPONENT in result
    return LabelledLanes(
        result[result.axis][mine],
        np.array(labels),
        period,
        result[EXPONENT][mine] if known else np.full(period.shape, np.nan),
    )


def lanes_of_start(result: Result, start: int) -> NDArray[np.bool_]:
    """Return which lanes have this start; where every value has one, its number is 0."""
    numbers = result["start"] if "start" in result else np.zeros(result[result.axis].size, int)
    return np.asarray(numbers == start)


def label_text(meaning: str, period: int) -> str:
    """Word a label: "period 3", "quasi-periodic", "chaotic"."""
    return f"period {period}" if period > 0 else meaning.replace("_", "-")


def stage_table(lanes: LabelledLanes, narrowest: float = 0.0) -> list[Stage]:
    """List the stages of a sweep in ascending order.

    Parameters
    ----------
    lanes : LabelledLanes
    narrowest : float
        Stages narrower than this go into what surrounds them: the narrowest first, into both
        neighbours where these are alike and otherwise into the wider one. A stage reaches halfway
        to the lanes beside it.
    """
    changes = np.flatnonzero(lanes.labels[1:] != lanes.labels[:-1]) + 1
    edges = [0, *changes.tolist(), lanes.values.size]
    # Of each stage: first lane, the lane after its last one, a lane that has its label, narrower.
    parts = [[a, b, a, 0] for a, b in pairwise(edges)]
    middles = (lanes.values[1:] + lanes.values[:-1]) / 2.0
    borders = np.concatenate([lanes.values[:1], middles, lanes.values[-1:]])

    def width(part: list[int]) -> float:
        return float(borders[part[1]] - borders[part[0]])

    while len(parts) > 1:
        at = min(range(len(parts)), key=lambda number: width(parts[number]))
        if width(parts[at]) >= narrowest:
            break
        beside = parts[max(at - 1, 0) : at] + parts[at + 1 : at + 2]
        label = lanes.labels[max(beside, key=width)[2]]
        merged = [part for part in beside if lanes.labels[part[2]] == label] + [parts[at]]
        whole = [
            min(part[0] for part in merged),
            max(part[1] for part in merged),
            merged[0][2],
            1 + sum(part[3] for part in merged),
        ]
        here = parts.index(min(merged))
        parts[here : here + len(merged)] = [whole]
    return [_stage(lanes, *part) for part in parts]


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
