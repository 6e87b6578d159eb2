"""Attractors on which lanes have settled, and their numbers along a sweep.

Lanes are integrated for another 2 `LONG` mesh periods: first one lane of each group, motion and
period, then four times as many per round. A periodic attractor is a stable orbit from Newton's
method. Every lane within `REACH` of it, at any phase, belongs to it and is not integrated further.
Other attractors are compared by the mean and the extent of their sections, see `ALIKE`.
"""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Codes, Complex, Counts, Floats, Integers
from gearchaos.dynamics.orbits import polish
from gearchaos.interrupts import check
from gearchaos.records.label import CHAOTIC, PERIODIC, QUASI_PERIODIC
from gearchaos.records.period import POINTS_NEEDED, coordinate_scale

REACH = 1e-3
"""Largest distance between a lane and its periodic orbit, in the scale of each state."""

ALIKE = 0.5
"""Largest difference of averages within one attractor, relative to the extent of a state."""

CONTINUED_CHANGE = 0.3
"""Largest change of averages of one attractor between values, relative to their norm."""

LONG = 1000
"""Mesh periods in which a lane settles, and mesh periods of the section recorded afterwards."""
AT_ONCE = 1 << 20
"""Largest number of section points in memory at a time."""


class Attractor(NamedTuple):
    """An attractor.

    Attributes
    ----------
    lane : int
        Number of the lane from which it was found.
    points : array, shape (points, states)
        Section once per excitation period; of a periodic attractor exactly one period.
    multipliers : array of complex, shape (states,)
        Floquet multipliers, largest modulus first; NaN if it is not periodic.
    """

    lane: int
    points: Floats
    multipliers: Complex

    @property
    def averages(self) -> Floats:
        """Mean and extent (standard deviation) of each state on the section, shape (2, states)."""
        return np.stack([self.points.mean(axis=0), self.points.std(axis=0)])


def find_attractors(
    system: LaneSystem, group: Integers, state: Floats, motion: Codes, period: Counts, plan: Plan
) -> tuple[list[Attractor], Integers]:
    """Find the attractors of lanes, and the attractor of each lane.

    Parameters
    ----------
    system : LaneSystem
        The system of all lanes.
    group : array of int, shape (lanes,)
        Lanes with the same parameters share a number.
    state : array, shape (lanes, states)
        State at tau = 0.
    motion, period : array of int, shape (lanes,)
        Labels; the period in excitation periods.
    plan : Plan
        Method and steps per period, as for `polish`.

    Returns
    -------
    attractors : list of Attractor
        The attractors of all groups.
    place : array of int, shape (lanes,)
        Index of each lane's attractor in the list; -1 if the motion of a lane has none.
    """
    rows = np.stack([group, motion, period], axis=1)
    kind = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    found: list[Attractor] = []
    place = np.full(len(state), -1)
    waiting = np.flatnonzero(np.isin(motion, (PERIODIC, QUASI_PERIODIC, CHAOTIC)))
    waiting, tried = waiting[np.argsort(kind[waiting], kind="stable")], 1
    at_once = max(1, AT_ONCE // _settling_periods(system))
    while waiting.size:
        check()
        _, first, sizes = np.unique(kind[waiting], return_index=True, return_counts=True)
        rank = np.arange(waiting.size) - np.repeat(first, sizes)
        some = waiting[rank < tried][:at_once]
        for one in _attractors_of(system, some, state, period, plan):
            alike = [other for other in found if kind[other.lane] == kind[one.lane]]
            same = [place[other.lane] for other in alike if _is_same(one, other)]
            place[one.lane] = same[0] if same else len(found)
            if not same:
                found.append(one)
                near = np.flatnonzero((kind == kind[one.lane]) & (place < 0) & (period > 0))
                place[near[_distances(state[near], one.points) <= REACH]] = place[one.lane]
        waiting = waiting[(place[waiting] < 0) & ~np.isin(waiting, some)]
        tried *= 4
    return found, place


def _settling_periods(system: LaneSystem) -> int:
    """Return `LONG` in whole excitation periods, at least as many as labels need."""
    return system.repeats_after * max(POINTS_NEEDED, LONG // system.repeats_after)


def _attractors_of(
    system: LaneSystem, lanes: Integers, state: Floats, period: Counts, plan: Plan
) -> list[Attractor]:
    """Integrate some lanes further and return the attractors that are found.

    ``lanes`` (tried,): numbers of the lanes; ``state`` (lanes, states) and ``period`` (lanes,): of
    all lanes.
    """
    long = plan.over(_settling_periods(system))
    part, n = system.of(lanes), period[lanes]
    last = integrate(part, state[lanes], long).end_state
    orbits = polish(part, last, n, plan)
    start = np.where(orbits.stable[:, np.newaxis], orbits.points, last)
    section = integrate(part, start, long).every(system.repeats_after).section
    there = np.isfinite(section).all(axis=(1, 2)) & (orbits.stable | (n < 1))
    return [
        Attractor(lane, section[at, -n[at] :], orbits.multipliers[at])
        for at, lane in zip(np.flatnonzero(there).tolist(), lanes[there].tolist(), strict=True)
    ]


def numbers_along(value: Integers, sizes: Integers, averages: Floats) -> Integers:
    """Number attractors such that an attractor keeps its number along a sweep.

    Parameters
    ----------
    value : array of int, shape (attractors,)
        Index of the value of the swept parameter.
    sizes : array of int, shape (attractors,)
        Number of lanes in the basin.
    averages : array, shape (attractors, 2, states)
        See `Attractor.averages`.

    Returns
    -------
    array of int, shape (attractors,)
        Numbers from 1 on.

    Notes
    -----
    At each value, its attractors are compared with the latest attractor of every number. The pair
    with the smallest change of averages is matched first, up to `CONTINUED_CHANGE`. An attractor
    that is absent at some values therefore returns with its number. The remaining attractors get
    new numbers, the largest basin first.
    """
    size = np.linalg.norm(averages, axis=(1, 2))
    numbers = np.zeros(len(value), dtype=np.intp)
    latest: dict[int, int] = {}
    for at in np.unique(value):
        here = np.flatnonzero(value == at)
        here = here[np.argsort(-sizes[here], kind="stable")]
        pairs = [(i, number) for i in here.tolist() for number in latest]
        changes = [float(np.linalg.norm(averages[i] - averages[latest[k]])) for i, k in pairs]
        for change, (i, number) in sorted(zip(changes, pairs, strict=True)):
            near = change <= CONTINUED_CHANGE * max(size[i], size[latest[number]])
            if near and not numbers[i] and number not in numbers[here]:
                numbers[i] = number
        for i in here.tolist():
            numbers[i] = numbers[i] or len(latest) + 1
            latest[int(numbers[i])] = i
    return numbers


def _distances(points: Floats, orbit: Floats) -> Floats:
    """Return the distance of points (points, states) from an orbit (points, states), (points,)."""
    apart = (points[:, np.newaxis] - orbit) / coordinate_scale(orbit[np.newaxis])
    nearest: Floats = np.abs(apart).max(axis=2).min(axis=1)
    return nearest


def _is_same(one: Attractor, other: Attractor) -> bool:
    """Whether two attractors of the same group, motion and period are the same."""
    if np.isfinite(one.multipliers[0]):
        return bool(_distances(one.points[:1], other.points)[0] <= REACH)
    off = np.abs(one.averages - other.averages)
    return bool(np.all(off <= ALIKE * other.averages[1]))
