"""The hop of figure 7: two motions that coexist, where they do, and which one a start comes to.

A pair that settles on one of two coexisting motions hops where its start passes from the basin of
one into that of the other. The ends of the interval in which both exist belong to the pair; the
place of a hop between them belongs to the start state as much as to the pair.
"""

import math
from typing import NamedTuple

import numpy as np

from gearchaos.configuration import Configuration
from gearchaos.dynamics.following import Branch
from gearchaos.engine.running import run
from gearchaos.results.jumps import directions_of
from gearchaos.results.result import Result
from gearchaos.system import System

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

CROSSINGS = "crossings_per_period"


class Hop(NamedTuple):
    """Two coexisting motions, and where they take over from each other.

    ``upwards``, ``downwards``: carried sweeps, on different motions between ``first`` and ``last``,
    to which the orbit of the downward and of the upward sweep can be followed; ``changes``: by the
    kind of the start, the last pitch error at which the teeth never part, as on the motion of the
    upward sweep, and the next one.
    """

    upwards: Result
    downwards: Result
    first: Branch
    last: Branch
    changes: dict[str, tuple[float, float]]


def find_hop(config: Configuration, step: float = STEP, threads: int | None = None) -> Hop | None:
    """Follow both motions, to the ends of their interval too, and find where starts change over.

    ``config`` sweeps the pitch error; ``step``: of the carried sweeps. None where teeth part alike
    in the sweeps upwards and downwards.
    """
    outputs = {"section": ["delta_5"], "section_points": 1, "lyapunov": False, "motion": False}
    config = config.replace("outputs", outputs).replace("integration.recorded_periods", 1)
    carried = _over(config, LOW, HIGH, step).replace("start.carry", "both")
    carried = carried.replace("integration.transient_periods", FOLLOWING_PERIODS)
    upwards, downwards = directions_of(run(carried, threads))
    both = upwards[upwards.axis][upwards[CROSSINGS] != downwards[CROSSINGS]]
    if not both.size:
        return None
    inside = float(both[both.size // 2])
    ends = []
    for sweep, end in (downwards, LOW), (upwards, HIGH):
        system = System.of_lane(sweep, pitch_error=inside)
        orbit = system.orbit(guess=system.state)
        ends.append(system.follow(orbit, "pitch_error", inside, end))
    first, last = ends
    fine = step / FINENESS
    low, high = math.ceil(first.value / fine) * fine, math.floor(last.value / fine) * fine
    within = _over(config, low, high, fine)
    changes = {}
    for kind in STARTS:
        found = run(within.replace("start", {"kind": kind}), threads)
        held = found[CROSSINGS] == 0.0
        places = np.flatnonzero(held[:-1] & ~held[1:])
        if places.size:
            changes[kind] = tuple(found[found.axis][places[0] : places[0] + 2].tolist())
    return Hop(upwards, downwards, first, last, changes)


def _over(config: Configuration, low: float, high: float, step: float) -> Configuration:
    count = round((high - low) / step) + 1
    sweep = {"parameter": "pitch_error", "from": low, "to": high, "count": count}
    return config.replace("sweep", sweep)
