"""Unstable periodic orbits embedded in chaos, found from close returns of a record."""

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Floats
from gearchaos.dynamics.orbits import Orbits, polish
from gearchaos.records.period import coordinate_scale

LONGEST_RECORD, FEWEST_RETURNS, MOST_MESH_PERIODS = 20_000, 100, 200_000
"""Longest and shortest default record in excitation periods, and its most mesh periods between."""

CLOSE = 0.2
"""Largest distance of a close return, in the scales of the states."""

MOST_GUESSES = 2000
"""Largest number of close returns that are tried, the closest first."""

SAME_ORBIT = 1e-6
"""Largest distance of the section points of two orbits that are the same, in their scales."""


def record_length(repeats_after: int) -> int:
    """Return the default length of a record in excitation periods.

    ``repeats_after``: mesh periods after which the excitation repeats. With pitch errors of teeth,
    these are hundreds, and fewer excitation periods have to do.
    """
    return int(np.clip(MOST_MESH_PERIODS // repeats_after, FEWEST_RETURNS, LONGEST_RECORD))


def embedded_orbits(system: LaneSystem, section: Floats, period: int, plan: Plan) -> Orbits:
    """Find the periodic orbits that a record comes near.

    Parameters
    ----------
    system : LaneSystem
        The system of the only lane.
    section : array, shape (points, states)
        Section of the record, one point for each excitation period.
    period : int
        Period in excitation periods.
    plan : Plan
        Method and steps per period, as for `polish`.

    Returns
    -------
    Orbits
        Each orbit once, the one with the smallest largest multiplier first.

    Notes
    -----
    A section point that returns after the period to within `CLOSE` of the scales of the states,
    and closer than its neighbours in time, is a guess for Newton's method (Auerbach et al.
    1987). Newton's method keeps an orbit only if it lies near the guess.
    """
    scale = coordinate_scale(section[np.newaxis])[0]
    returns = np.max(np.abs(section[period:] - section[:-period]) / scale, axis=1)
    before, after = np.roll(returns, 1), np.roll(returns, -1)
    (close,) = np.nonzero((returns < CLOSE) & (returns <= before) & (returns <= after))
    close = close[np.argsort(returns[close], kind="stable")]
    # A motion that has settled returns to the same place all the time.
    _, first = np.unique(np.rint(section[close] / (SAME_ORBIT * scale)), axis=0, return_index=True)
    close = close[np.sort(first)][:MOST_GUESSES]
    lanes = system.of(np.zeros(close.size, dtype=np.intp))
    periods = np.full(close.size, period, np.int32)
    found = polish(lanes, section[close], periods, plan, scale)
    closed = np.flatnonzero(found.converged)
    once = plan.over(period * system.repeats_after)
    closed = closed[_first_of_each(system, found.points[closed], scale, once)]
    order = np.argsort(np.abs(found.multipliers[closed, 0]), kind="stable")
    return found.of(closed[order])


def _first_of_each(system: LaneSystem, points: Floats, scale: Floats, once: Plan) -> list[int]:
    """Return the numbers of the points (lanes, states) that are the first of their orbits.

    ``once``: plan of an integration over the period of the orbits.
    """
    lanes = system.of(np.zeros(len(points), dtype=np.intp))
    sections = integrate(lanes, points, once).every(system.repeats_after).section
    kept: list[int] = []
    for number, point in enumerate(points):
        distances = np.max(np.abs(sections[kept] - point) / scale, axis=-1)
        if not (distances < SAME_ORBIT).any():
            kept.append(number)
    return kept
