"""The hop of figure 7: two motions that coexist, where they do, and which one a start comes to.

A pair that settles on one of two coexisting motions hops where its start passes from the basin of
one into that of the other. The ends of the interval in which both exist belong to the pair; the
place of a hop between them belongs to the start state as much as to the pair.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.configuration import Configuration
from gearchaos.dynamics.following import Branch
from gearchaos.engine.running import run
from gearchaos.results.jumps import directions_of
from gearchaos.results.result import Result
from gearchaos.system import System

Floats = NDArray[np.float64]

LOW, HIGH = 0.5, 2.0
"""Pitch errors between which both motions are followed, in multiples of e(tau)."""

STEP = 0.01
"""Step of the carried sweeps."""

FINENESS = 10
"""Parts of a step between which the place of a hop is told."""

FOLLOWING_PERIODS = 100
"""Mesh periods of a carried sweep per value: its motion changes little from one to the next."""

STARTS = {"rest": "at rest", "contact": "contact flank"}
"""Kinds of start states whose change from one motion to the other is looked for, worded."""

APART = 1e-3
"""Distance of the states from which on motions differ."""


class Hop(NamedTuple):
    """Two coexisting motions, and where they take over from each other.

    ``upwards``, ``downwards``: carried sweeps, on different motions between ``first`` and ``last``,
    to which the orbit of the downward and of the upward sweep can be followed; ``changes``: by the
    kind of the start, the last pitch error on the motion of the upward sweep and the next one.
    """

    upwards: Result
    downwards: Result
    first: Branch
    last: Branch
    changes: dict[str, tuple[float, float]]

    def share(self, pitch_error: float) -> float:
        """Return where a pitch error lies in the interval, 0 at its first and 1 at its last."""
        return (pitch_error - self.first.value) / (self.last.value - self.first.value)


def find_hop(config: Configuration, step: float = STEP, threads: int | None = None) -> Hop | None:
    """Follow both motions, to the ends of their interval too, and find where starts change over.

    ``config`` sweeps the pitch error; ``step``: of the carried sweeps. None where the sweeps
    upwards and downwards agree everywhere.
    """
    config = _states_only(config)
    carried = _over(config, LOW, HIGH, step)
    carried = carried.replace("integration.transient_periods", FOLLOWING_PERIODS)
    upwards, downwards = directions_of(run(carried.replace("start.carry", "both"), threads))
    values = upwards[upwards.axis]
    both = values[_apart(upwards["end_state"], downwards["end_state"]) > APART]
    if not both.size:
        return None
    inside = float(both[both.size // 2])
    first, last = _end(downwards, inside, LOW), _end(upwards, inside, HIGH)
    fine = step / FINENESS
    low, high = math.ceil(first.value / fine) * fine, math.floor(last.value / fine) * fine
    within = _over(config, low, high, fine)
    changes = {}
    for kind in STARTS:
        found = run(within.replace("start", {"kind": kind}), threads)
        starts, ends = found[found.axis], found["end_state"]
        # The motions of the carried sweeps, interpolated between their values.
        one, other = (
            np.stack([np.interp(starts, values, column) for column in sweep["end_state"].T], axis=1)
            for sweep in (upwards, downwards)
        )
        on_first = _apart(ends, one) < _apart(ends, other)
        places = np.flatnonzero(on_first[:-1] & ~on_first[1:])
        if places.size:
            changes[kind] = tuple(starts[places[0] : places[0] + 2].tolist())
    return Hop(upwards, downwards, first, last, changes)


def _end(sweep: Result, value: float, last: float) -> Branch:
    """Follow the period-1 orbit of a carried sweep from a value to where it ends."""
    system = System.of_lane(sweep, pitch_error=value)
    return system.follow(system.orbit(guess=system.state), "pitch_error", value, last)


def _apart(one: Floats, other: Floats) -> Floats:
    return np.asarray(np.abs(one - other).max(axis=1))


def exponents_beside(
    config: Configuration, change: tuple[float, float], threads: int | None = None
) -> list[float]:
    """Return the largest exponents on both sides of a change, of the states of a scene.

    They are those of the periodic orbits to which the start of ``config`` leads, from their Floquet
    multipliers; soft axial bearings take long to come to rest. Raises ConfigurationError where
    there is no such orbit.
    """
    sides = config.replace("sweep", {"parameter": "pitch_error", "values": change})
    found = run(_states_only(sides), threads)
    lanes = [System.of_lane(found, pitch_error=value) for value in change]
    return [lane.orbit(guess=lane.state).exponent for lane in lanes]


def _states_only(config: Configuration) -> Configuration:
    outputs = {"section": config.scene.states, "section_points": 1}
    config = config.replace("outputs", {**outputs, "lyapunov": False, "motion": False})
    return config.replace("integration.recorded_periods", 1)


def _over(config: Configuration, low: float, high: float, step: float) -> Configuration:
    count = round((high - low) / step) + 1
    sweep = {"parameter": "pitch_error", "from": low, "to": high, "count": count}
    return config.replace("sweep", sweep)
