"""Computation of each kind of observation from the lanes of a candidate, and its residual."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gearchaos.arrays import Floats, Mask
from gearchaos.identification.evaluation import CandidateRecords
from gearchaos.identification.targets import (
    Exponent,
    Increment,
    ObservedPlace,
    ObservedStage,
    Targets,
)
from gearchaos.results.reading.jumps import jump_sizes

GROWTH = 1.2  # Least factor by which the section of a chaotic motion grows in a crisis.
NOWHERE = 100.0  # Default residual, in widths, of a candidate without the observed number.


@dataclass(frozen=True)
class Observation:
    """One observed number, and how it is computed from the lanes of candidates.

    Attributes
    ----------
    name : str
        Name in reports and files.
    wanted, width : float
        The number, and its unit of misfit.
    values : (values,)
        Swept values that are needed, ascending.
    computed : callable
        Returns the number of every candidate, (candidates,), from the records at these values;
        NaN for candidates without it.
    missing : float
        Residual of a candidate without the number, in widths.
    """

    name: str
    wanted: float
    width: float
    values: Floats
    computed: Callable[[CandidateRecords], Floats]
    missing: float = NOWHERE

    def residual(self, computed: Floats) -> Floats:
        """Return the signed difference from the observed number in widths."""
        off = (computed - self.wanted) / self.width
        return np.clip(np.where(np.isnan(off), self.missing, off), -self.missing, self.missing)


def stage_length(stage: ObservedStage) -> Observation:
    """Observe the length of a stage over which the motion differs; zero is wanted.

    The stage is cut into cells, small ones at its ends. The lane in its middle decides for a cell.
    """
    length = stage.to - stage.from_
    half = _spaced(length / 2.0, stage.width / 2.0, 1.5)
    edges = np.concatenate([stage.from_ + half, stage.to - half[-2::-1]])

    def computed(records: CandidateRecords) -> Floats:
        wrong = ~has_motion(records, stage.motion)
        return np.asarray(np.sum(wrong * np.diff(edges), axis=1))

    name = f"{stage.motion} from {stage.from_:g} to {stage.to:g}"
    values = (edges[1:] + edges[:-1]) / 2.0
    return Observation(name, 0.0, stage.width, values, computed, length / stage.width)


def change_place(kind: str, place: ObservedPlace) -> Observation:
    """Observe the place of a jump or a crisis, halfway between two lanes."""
    low, high = place.within
    above, below = (
        _spaced(way, place.width / 2.0, 1.25) for way in (high - place.at, place.at - low)
    )
    # The place itself lies between two lanes.
    half = min(above[1], below[1]) / 2.0
    around = np.concatenate([place.at - half - below, place.at + half + above])
    values = np.unique(np.clip(around, low, high))

    def computed(records: CandidateRecords) -> Floats:
        steps = _growth(records) if kind == "crisis" else _jumps(records, np.diff(values))
        middle = (values[1:] + values[:-1]) / 2.0
        there = np.max(steps, axis=1) > 0.0
        return np.where(there, middle[np.argmax(steps, axis=1)], np.nan)

    missing = (high - low) / place.width
    return Observation(f"{kind} at {place.at:g}", place.at, place.width, values, computed, missing)


def _jumps(records: CandidateRecords, cells: Floats) -> Floats:
    """Return the sizes of jumps between neighbouring values, 0 where there is none.

    Shape (candidates, values - 1); ``cells`` (values - 1,): distances of the values.
    """
    sound = np.where(records.sound[..., np.newaxis], records.section, 0.0)
    size = np.max(np.abs(sound), axis=(1, 2), keepdims=True)
    lanes = (records.section / np.where(size > 0.0, size, 1.0))[..., np.newaxis]
    sizes = (jump_sizes(*one, cells, alone=0.0) for one in zip(records.period, lanes, strict=True))
    return np.stack([*sizes])


def _growth(records: CandidateRecords) -> Floats:
    """Return 1 where the section of a motion first passes half of its total growth, else 0.

    Close to a crisis bursts are rare, and the record of a single lane may miss them. The growth is
    therefore taken over the whole interval, not from lane to lane.
    """
    extent = np.ptp(np.where(records.sound[..., np.newaxis], records.section, 0.0), axis=2)
    chaotic = has_motion(records, "chaotic")
    least = np.min(np.where(chaotic, extent, np.inf), axis=1, keepdims=True)
    most = np.max(np.where(chaotic, extent, 0.0), axis=1, keepdims=True)
    beyond = (most > GROWTH * least) & chaotic & (extent > (least + most) / 2.0)
    first = beyond & (np.cumsum(beyond, axis=1) == 1)
    return np.asarray(first[:, 1:], dtype=np.float64)


def exponent_at(exponent: Exponent) -> Observation:
    """Observe the largest Lyapunov exponent at one value."""
    at, wanted, width = exponent.at, exponent.value, exponent.width
    return Observation(
        f"exponent at {at:g}", wanted, width, np.array([at]), lambda lanes: lanes.exponent[:, 0]
    )


def acceleration_increment(increment: Increment, coordinates: Sequence[str]) -> Observation:
    """Observe the growth of the largest acceleration of a coordinate between two values."""
    ends, column = (increment.from_, increment.to), coordinates.index(increment.coordinate)
    sign = 1.0 if ends[0] <= ends[1] else -1.0

    def computed(records: CandidateRecords) -> Floats:
        first, last = records.acceleration[:, :, column].T
        return np.asarray(sign * (last - first))

    name = f"{increment.coordinate}'' from {ends[0]:g} to {ends[1]:g}"
    values = np.array(sorted(ends))
    return Observation(name, increment.value, increment.width, values, computed)


def observations_of(targets: Targets, coordinates: Sequence[str]) -> list[Observation]:
    """Return all observations, in the order of the targets file's tables.

    ``coordinates``: those whose accelerations the records hold.
    """
    return [
        *map(stage_length, targets.stage),
        *(change_place("jump", one) for one in targets.jump),
        *(change_place("crisis", one) for one in targets.crisis),
        *map(exponent_at, targets.exponent),
        *(acceleration_increment(one, coordinates) for one in targets.increment),
    ]


def has_motion(records: CandidateRecords, motion: str) -> Mask:
    """Return which lanes have a motion of this kind, shape (candidates, values).

    A motion on n bands visits n parts of the section in turn whose ranges of delta_5 do not
    overlap, and its period is not a divisor of n. Such motions are chaotic or have periods 2 n,
    3 n and so on.
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

    The sum of 2 (sqrt(1 + r^2) - 1) over the observations: about r^2 for small residuals and
    2 |r| for large ones, so that no single observation dominates.
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
    """Return places from 0 to ``way``; each cell is longer than the one before it."""
    first = min(first, way)
    count = max(1, round(np.log1p((growth - 1.0) * way / first) / np.log(growth)))
    places = np.cumsum(growth ** np.arange(count))
    return np.concatenate([[0.0], places * (way / places[-1])])
