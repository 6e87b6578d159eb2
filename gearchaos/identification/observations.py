"""How each kind of observation is read off the lanes of a candidate, and how far off it is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearchaos.identification.evaluation import Records
from gearchaos.identification.targets import Crisis, Exponent, Increment, Jump, Stage, Targets
from gearchaos.records.period import section_distance
from gearchaos.results.jumps import SMALLEST, STEEPEST

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

GROWTH = 1.2
"""Least factor by which the section of a chaotic motion grows where there is a crisis."""

NOWHERE = 100.0
"""Widths that a number is off which a candidate does not have."""


class Observation(ABC):
    """One observed number.

    ``name``; ``wanted``, ``width``: the number and its unit of misfit; ``missing``: how many
    widths off is a candidate in which there is no such thing; ``values``: of the swept parameter,
    ascending, shape (values,), at which it is looked at.
    """

    name: str
    wanted: float
    width: float
    missing: float = NOWHERE
    values: Floats
    accelerated = False

    @abstractmethod
    def computed(self, records: Records) -> Floats:
        """Return the number of every candidate, NaN where there is none, shape (candidates,).

        ``records`` are those at the values of the observation.
        """

    def residual(self, computed: Floats) -> Floats:
        """Return how many widths off a number is, with its sign."""
        off = (computed - self.wanted) / self.width
        return np.clip(np.where(np.isnan(off), self.missing, off), -self.missing, self.missing)


class StageLength(Observation):
    """Over which length of a stage the motion is another one; none is wanted.

    The stage is cut into cells, small ones at its ends, each judged by the lane in its middle.
    """

    wanted = 0.0

    def __init__(self, stage: Stage) -> None:
        self.name = f"{stage.motion} from {stage.from_:g} to {stage.to:g}"
        self.width = stage.width
        half = _spaced((stage.to - stage.from_) / 2.0, stage.width / 2.0, 1.5)
        edges = np.concatenate([stage.from_ + half, stage.to - half[-2::-1]])
        self.values, self._lengths = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges)
        self.missing = (stage.to - stage.from_) / stage.width
        self._motion = stage.motion

    def computed(self, records: Records) -> Floats:
        """Return the length over which the motion is another one."""
        wrong = ~has_motion(records, self._motion)
        return np.asarray(np.sum(wrong * self._lengths, axis=1))


class JumpPlace(Observation):
    """Where the sweep jumps from one motion to another of the same period."""

    def __init__(self, place: Jump | Crisis) -> None:
        self.name = f"{type(place).__name__.lower()} at {place.at:g}"
        self.wanted, self.width = place.at, place.width
        low, high = place.within
        above, below = (
            _spaced(way, place.width / 2.0, 1.25) for way in (high - place.at, place.at - low)
        )
        # The place itself lies between two lanes.
        half = min(above[1], below[1]) / 2.0
        self.values = np.unique(
            np.clip(np.concatenate([place.at - half - below, place.at + half + above]), low, high)
        )
        self.missing = (high - low) / place.width

    def computed(self, records: Records) -> Floats:
        """Return the middle of the two lanes between which the section changes at once."""
        steps = self._steps(records)
        at = np.argmax(steps, axis=1)
        middle = (self.values[1:] + self.values[:-1]) / 2.0
        place: Floats = np.where(np.max(steps, axis=1) > 0.0, middle[at], np.nan)
        return place

    def _steps(self, records: Records) -> Floats:
        """Return by how much motions beside each other differ, 0 where this is no jump."""
        candidates, values, points = records.section.shape
        period = records.period
        common = np.where(period[:, 1:] == period[:, :-1], period[:, 1:], 0)
        one, other = records.section[:, :-1], records.section[:, 1:]
        apart = section_distance(
            one.reshape(-1, points, 1), other.reshape(-1, points, 1), np.ravel(common)
        ).reshape(candidates, values - 1)
        size = np.max(np.abs(np.where(np.isfinite(one), one, 0.0)), axis=(1, 2))[:, np.newaxis]
        cells = np.diff(self.values)
        rate = np.nan_to_num(apart) / cells
        nothing = np.zeros((candidates, 1))
        beside = np.maximum(
            np.concatenate([nothing, rate[:, :-1]], axis=1),
            np.concatenate([rate[:, 1:], nothing], axis=1),
        )
        jumps = (apart > SMALLEST * size) & (apart > STEEPEST * beside * cells)
        return np.where(jumps, apart, 0.0)


class CrisisPlace(JumpPlace):
    """Where the section of a motion first passes half of all that it grows within the span.

    Next to a crisis the motion leaves its former part of the section seldom, and the record of a
    single lane may miss it: so the growth is that over the span, and not from lane to lane.
    """

    def _steps(self, records: Records) -> Floats:
        extent = np.ptp(np.where(records.sound[..., np.newaxis], records.section, 0.0), axis=2)
        chaotic = has_motion(records, "chaotic")
        least = np.min(np.where(chaotic, extent, np.inf), axis=1, keepdims=True)
        most = np.max(np.where(chaotic, extent, 0.0), axis=1, keepdims=True)
        beyond = (most > GROWTH * least) & chaotic & (extent > (least + most) / 2.0)
        first = beyond & (np.cumsum(beyond, axis=1) == 1)
        steps: Floats = first[:, 1:].astype(np.float64)
        return steps


class ExponentAt(Observation):
    """The largest Lyapunov exponent at one value."""

    def __init__(self, exponent: Exponent) -> None:
        self.name = f"exponent at {exponent.at:g}"
        self.wanted, self.width = exponent.value, exponent.width
        self.values = np.array([exponent.at])

    def computed(self, records: Records) -> Floats:
        """Return the exponent."""
        return records.exponent[:, 0]


class AccelerationIncrement(Observation):
    """Growth of the largest acceleration of a coordinate between two values."""

    accelerated = True

    def __init__(self, increment: Increment, coordinates: Sequence[str]) -> None:
        ends = increment.from_, increment.to
        self.name = f"{increment.coordinate}'' from {ends[0]:g} to {ends[1]:g}"
        self.wanted, self.width = increment.value, increment.width
        self.values = np.array(sorted(ends))
        self._sign = 1.0 if ends[0] <= ends[1] else -1.0
        self._column = coordinates.index(increment.coordinate)

    def computed(self, records: Records) -> Floats:
        """Return the growth."""
        first, last = records.acceleration[:, :, self._column].T
        return np.asarray(self._sign * (last - first))


def observations_of(targets: Targets, coordinates: Sequence[str]) -> list[Observation]:
    """Return all observations, in the order of the targets file's tables.

    ``coordinates``: those of the records, see `coordinates_of`.
    """
    return [
        *map(StageLength, targets.stage),
        *map(JumpPlace, targets.jump),
        *map(CrisisPlace, targets.crisis),
        *map(ExponentAt, targets.exponent),
        *(AccelerationIncrement(one, coordinates) for one in targets.increment),
    ]


def has_motion(records: Records, motion: str) -> Mask:
    """Tell which lanes have a motion of this kind, shape (candidates, values).

    On n bands moves what is not of period n or of a divisor of it, and visits n parts of the
    section in turn that have no value of delta_5 in common: motions of the periods 2 n, 3 n and so
    on, and chaos.
    """
    kind, _, number = motion.partition(" ")
    period, has = records.period, records.sound.copy()
    if kind == "period":
        has &= period == int(number)
    elif kind == "bands":
        has &= (period == 0) | (int(number) % np.maximum(period, 1) > 0)
        has &= _on_bands(records.section, int(number))
    else:
        has &= period == 0
    if kind == "chaotic":
        has &= records.exponent > 0.0
    return has


def misfit(residuals: Floats) -> Floats:
    """Return the misfit of candidates, shape (candidates,), from residuals in widths.

    The sum of 2 (sqrt(1 + r^2) - 1) over the observations: r^2 where they are met nearly, and 2 r
    far off, so that no single one decides while others are wrong too.
    """
    return np.asarray(np.sum(2.0 * (np.sqrt(1.0 + residuals**2) - 1.0), axis=1))


def _on_bands(section: Floats, count: int) -> Mask:
    turns = section.shape[2] // count
    dealt = section[:, :, -turns * count :].reshape(*section.shape[:2], turns, count)
    low, high = np.min(dealt, axis=2), np.max(dealt, axis=2)
    order = np.argsort(low, axis=2)
    low, high = (np.take_along_axis(ends, order, axis=2) for ends in (low, high))
    return np.asarray(np.all(low[:, :, 1:] > high[:, :, :-1], axis=2))


def _spaced(way: float, first: float, growth: float) -> Floats:
    """Return places from 0 to the end of a way, each cell longer than the one before it."""
    first = min(first, way)
    count = max(1, round(np.log1p((growth - 1.0) * way / first) / np.log(growth)))
    places = np.cumsum(growth ** np.arange(count))
    return np.concatenate([[0.0], places * (way / places[-1])])
