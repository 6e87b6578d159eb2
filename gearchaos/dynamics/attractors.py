"""Attractors found from where lanes have come to, and the numbers that they keep along a sweep."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Codes, Complex, Counts, Floats, Integers
from gearchaos.dynamics.orbits import polish
from gearchaos.interrupts import check
from gearchaos.records.label import CHAOTIC, PERIODIC, QUASI_PERIODIC
from gearchaos.records.period import POINTS_NEEDED, coordinate_scale

REACH = 1e-3
"""Distance from a periodic orbit within which a lane has come to it, in the scale of each state."""

ALIKE = 0.5
"""Difference up to which averages are those of one attractor, in parts of the extent of a state."""

GOES_ON = 0.3
"""Change up to which an attractor is the same at another value, in parts of all its averages."""

LONG = 1000  # Mesh periods in which a lane settles, and then those over which its section is taken.
AT_ONCE = 1 << 20  # Section points that are held at once.


class Attractor(NamedTuple):
    """An attractor, found from ``lane``.

    ``points`` (points, states): its section once an excitation period, of a periodic one all of it;
    ``multipliers`` (states,): Floquet multipliers, largest modulus first, not a number where it is
    not periodic.
    """

    lane: int
    points: Floats
    multipliers: Complex

    @property
    def averages(self) -> Floats:
        """Mean and extent (standard deviation) of each state on the section, (2, states)."""
        return np.stack([self.points.mean(axis=0), self.points.std(axis=0)])


def find_attractors(
    system: LaneSystem, group: Integers, state: Floats, motion: Codes, period: Counts, plan: Plan
) -> tuple[list[Attractor], Integers]:
    """Find the attractors of lanes, and to which of them each has come: its place in the list.

    Lanes go on for twice `LONG` mesh periods, first one of each group, motion and period, then ever
    more. A periodic attractor is the stable orbit polished on the way; every lane whose ``state``
    (lanes, states) at tau = 0 lies within `REACH` of it, whatever its phase, has come to it and
    need not go on. Any other attractor is known by mean and extent of its section, to `ALIKE`. -1
    where a lane has no such motion or no orbit is found.

    ``group`` (lanes,): lanes of the same parameters share a number; ``motion``, ``period``: labels;
    ``plan`` as for `polish`.
    """
    rows = np.stack([group, motion, period], axis=1)
    kind = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    found: list[Attractor] = []
    place = np.full(len(state), -1)
    waiting = np.flatnonzero(np.isin(motion, (PERIODIC, QUASI_PERIODIC, CHAOTIC)))
    waiting, tried = waiting[np.argsort(kind[waiting], kind="stable")], 1
    length = system.repeats_after * max(POINTS_NEEDED, LONG // system.repeats_after)
    long = Plan(plan.steps_per_period, 0, length, length, tangent=True, method=plan.method)
    while waiting.size:
        check()
        _, first, sizes = np.unique(kind[waiting], return_index=True, return_counts=True)
        rank = np.arange(waiting.size) - np.repeat(first, sizes)
        some = waiting[rank < tried][: max(1, AT_ONCE // length)]
        part, n = system.of(some), period[some]
        last = integrate(part, state[some], long).end_state
        orbits = polish(part, last, n, plan)
        start = np.where(orbits.stable[:, np.newaxis], orbits.points, last)
        section = integrate(part, start, long).every(system.repeats_after).section
        there = np.isfinite(section).all(axis=(1, 2)) & (orbits.stable | (n < 1))
        for at, lane in zip(np.flatnonzero(there).tolist(), some[there].tolist(), strict=True):
            one = Attractor(lane, section[at, -n[at] :], orbits.multipliers[at])
            alike = [other for other in found if kind[other.lane] == kind[lane]]
            same = [place[other.lane] for other in alike if _is_same(one, other)]
            place[lane] = same[0] if same else len(found)
            if not same:
                found.append(one)
                near = np.flatnonzero((kind == kind[lane]) & (place < 0) & (period > 0))
                place[near[_distances(state[near], one.points) <= REACH]] = place[lane]
        waiting = waiting[(place[waiting] < 0) & ~np.isin(waiting, some)]
        tried *= 4
    return found, place


def numbers_along(value: Integers, sizes: Integers, averages: Floats) -> Integers:
    """Number attractors such that what goes on along a sweep keeps its number, (attractors,).

    Of those at one value and those seen last under each number, the two whose ``averages``
    (attractors, 2, states) are nearest go together first, to `GOES_ON`; so one that is missing at
    some values returns with its number. What is left is new, the largest first. ``value``
    (attractors,): the place of its value in the sweep; ``sizes`` (attractors,) of its basin.
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
            near = change <= GOES_ON * max(size[i], size[latest[number]])
            if near and not numbers[i] and number not in numbers[here]:
                numbers[i] = number
        for i in here.tolist():
            numbers[i] = numbers[i] or len(latest) + 1
            latest[int(numbers[i])] = i
    return numbers


def _distances(points: Floats, orbit: Floats) -> Floats:
    """Return how far points (points, states) lie from the nearest one of an orbit."""
    apart = (points[:, np.newaxis] - orbit) / coordinate_scale(orbit[np.newaxis])
    nearest: Floats = np.abs(apart).max(axis=2).min(axis=1)
    return nearest


def _is_same(one: Attractor, other: Attractor) -> bool:
    if np.isfinite(one.multipliers[0]):
        return bool(_distances(one.points[:1], other.points)[0] <= REACH)
    off = np.abs(one.averages - other.averages)
    return bool(np.all(off <= ALIKE * other.averages[1]))
