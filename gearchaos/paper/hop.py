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
from gearchaos.dynamics.following import Orbit, StabilityLoss
from gearchaos.engine.running import run
from gearchaos.results.result import Result
from gearchaos.system import System

Floats = NDArray[np.float64]

PITCH_ERROR = "pitch_error"

LOW, HIGH = 0.5, 2.0
"""Pitch errors between which both motions are followed, in multiples of e(tau)."""

STEP = 0.01
"""Step of the carried sweeps."""

FINENESS = 10
"""Parts of a step between which the place of a hop is told."""

WIDTH = 1e-4
"""Width to which the ends of the interval are bisected."""

FOLLOWING_PERIODS = 100
"""Mesh periods of a carried sweep per value: its motion changes little from one to the next."""

SETTLING_PERIODS = 500
"""Fewest mesh periods in which a soft axial bearing comes to rest."""

STARTS = {"rest": "at rest", "contact": "contact flank"}
"""Kinds of start states whose change from one motion to the other is looked for, worded."""

APART = 1e-3
"""Distance of the section points, relative to the larger one, from which on motions differ."""


class Change(NamedTuple):
    """Where a kind of start changes from one motion to the other.

    ``before``, ``after``: last pitch error on the motion of the upward sweep, first one on the
    other; ``exponents``: the largest Lyapunov exponents there, those of the periodic orbits.
    """

    before: float
    after: float
    exponents: tuple[float, float]


class Hop(NamedTuple):
    """Two coexisting motions, and where they take over from each other.

    ``upwards``, ``downwards``: carried sweeps, on different motions between ``first`` and ``last``,
    the ends of the interval of pitch errors in which both exist; ``losses``: how the motion of the
    downward sweep ends at ``first``, that of the upward one at ``last``; ``changes``: by the kind
    of the start.
    """

    upwards: Result
    downwards: Result
    first: float
    last: float
    losses: tuple[StabilityLoss, StabilityLoss]
    changes: dict[str, Change]

    def share(self, pitch_error: float) -> float:
        """Return where a pitch error lies in the interval, 0 at its first and 1 at its last."""
        return (pitch_error - self.first) / (self.last - self.first)


def find_hop(config: Configuration, step: float = STEP, threads: int | None = None) -> Hop | None:
    """Follow both motions, bisect the ends of their interval, and find where starts change over.

    ``config`` sweeps the pitch error; ``step``: of the carried sweeps. None where the sweeps
    upwards and downwards agree everywhere.
    """
    config = _states_only(config)
    periods = min(FOLLOWING_PERIODS, config.integration.transient_periods)
    carried = _over(config, LOW, HIGH, round((HIGH - LOW) / step) + 1)
    carried = carried.replace("integration.transient_periods", periods)
    upwards, downwards = (
        run(carried.replace("start.carry", direction), threads)
        for direction in ("upwards", "downwards")
    )
    one, other = upwards["end_state"], downwards["end_state"]
    size = np.maximum(np.abs(one), np.abs(other)).max(axis=1)
    both = np.flatnonzero(np.abs(one - other).max(axis=1) > APART * size)
    if not both.size:
        return None
    # Next to an end a lane may still be on its way: the orbit is followed from the lane before.
    inner = (both[min(1, both.size - 1)], both[max(-2, -both.size)])
    first, falls = _end(downwards, int(inner[0]), -2.0 * step)
    last, rises = _end(upwards, int(inner[1]), 2.0 * step)
    fine = step / FINENESS
    low, high = math.ceil(first / fine), math.floor(last / fine)
    within = _over(config, low * fine, high * fine, high - low + 1)
    changes = {}
    for kind in STARTS:
        found = run(within.replace("start", {"kind": kind}), threads)
        on_first = _distance(found, upwards) < _distance(found, downwards)
        places = np.flatnonzero(on_first[:-1] & ~on_first[1:])
        if places.size:
            before, after = found[found.axis][places[0] : places[0] + 2].tolist()
            exponents = _orbit(found, before)[1].exponent, _orbit(found, after)[1].exponent
            changes[kind] = Change(before, after, exponents)
    return Hop(upwards, downwards, first, last, (falls, rises), changes)


def _states_only(config: Configuration) -> Configuration:
    outputs = {"section": config.scene.states, "section_points": 1}
    config = config.replace("outputs", {**outputs, "lyapunov": False, "motion": False})
    return config.replace("integration.recorded_periods", 1)


def _over(config: Configuration, low: float, high: float, count: int) -> Configuration:
    sweep = {"parameter": PITCH_ERROR, "from": low, "to": high, "count": count}
    return config.replace("sweep", sweep)


def exponents_beside(
    config: Configuration, change: Change, threads: int | None = None
) -> tuple[float, float]:
    """Return the largest exponents on both sides of a change, of all states of another scene.

    They are those of the periodic orbits to which the start of ``config`` leads, from their Floquet
    multipliers. Raises ConfigurationError where there is no such orbit.
    """
    sweep = {"parameter": PITCH_ERROR, "values": [change.before, change.after]}
    settling = max(SETTLING_PERIODS, config.integration.transient_periods)
    sides = _states_only(config.replace("sweep", sweep))
    found = run(sides.replace("integration.transient_periods", settling), threads)
    return _orbit(found, change.before)[1].exponent, _orbit(found, change.after)[1].exponent


def _end(sweep: Result, lane: int, step: float) -> tuple[float, StabilityLoss]:
    """Follow the period-1 orbit of a carried sweep beyond its last value, to where it ends."""
    value = float(sweep[sweep.axis][lane])
    system, orbit = _orbit(sweep, value)
    branch = system.follow(orbit, PITCH_ERROR, value, value + step, WIDTH)
    # Of an orbit that is unstable where the sweep has it, nothing is known.
    return (branch.value if math.isfinite(branch.value) else value), branch.loss


def _orbit(found: Result, pitch_error: float) -> tuple[System, Orbit]:
    """Find the period-1 orbit that a lane has come to."""
    system = System.of_lane(found, pitch_error=pitch_error)
    return system, system.orbit(guess=system.state)


def _distance(found: Result, sweep: Result) -> Floats:
    """Distance of each lane from the motion of a carried sweep, interpolated between its values."""
    values, known = found[found.axis], sweep["end_state"]
    there = [np.interp(values, sweep[sweep.axis], column) for column in known.T]
    return np.asarray(np.abs(found["end_state"] - np.column_stack(there)).max(axis=1))
