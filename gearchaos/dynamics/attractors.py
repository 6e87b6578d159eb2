"""Attractors found from where lanes have come to: polished orbits, and long records of the rest."""

from typing import Any, NamedTuple

import numpy as np
from gearchaos_kernels import Plan, System, integrate
from numpy.typing import NDArray

from gearchaos.dynamics.orbits import polish
from gearchaos.interrupts import check
from gearchaos.records.attractor_sets import ENOUGH, distances
from gearchaos.records.label import CHAOTIC, PERIODIC, QUASI_PERIODIC
from gearchaos.records.period import POINTS_NEEDED

Floats = NDArray[np.float64]
Lanes = NDArray[np.intp]

REACH = 1e-3
"""Distance from a periodic orbit, relative to its size, within which a lane has come to it."""

LONG, SETTLING = 2000, 500
"""Mesh periods by which an attractor that is not periodic is known, and after which a motion has
come to the attractor to which it leads; whole excitation periods, see `_whole`."""

AT_ONCE = 1024
"""Lanes whose attractor is looked for at once: their long records have to be held."""


class Attractor(NamedTuple):
    """An attractor, found from ``lane``.

    ``points`` (points, states): its section once an excitation period, of a periodic one all of it;
    ``reach``: how near, as `distances` has it, lanes on it come to these; ``multipliers``
    (states,): Floquet multipliers, largest modulus first, not a number where it is not periodic.
    """

    lane: int
    points: Floats
    reach: float
    multipliers: NDArray[np.complex128]


def find_attractors(
    system: System,
    group: Lanes,
    state: Floats,
    motion: NDArray[np.uint8],
    period: NDArray[np.int32],
    steps_per_period: int,
    method: str = "rk4",
) -> tuple[list[Attractor], Lanes]:
    """Find the attractors of lanes, and to which of them each has come: its place in the list.

    A lane whose ``state`` (lanes, states) at tau = 0 lies within reach of a known attractor of its
    group, motion and period has come to that, whatever its phase; from others the attractor is
    found anew, first one of each kind, then ever more. A periodic one is a polished stable orbit;
    any other is the section of `LONG` mesh periods, and its reach the largest distance of the
    later half from the earlier one. Two are the same where at least half of the points of one lie
    within reach of the other. -1 where a lane has no such motion or no orbit is found.

    ``group`` (lanes,): lanes of the same parameters share a number; ``motion``, ``period``: labels;
    ``steps_per_period`` and ``method`` as for `polish`.
    """
    rows = np.stack([group, motion, period], axis=1)
    kind = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    known: list[Attractor] = []
    of_kind: dict[int, list[int]] = {}
    number = np.full(len(state), -1)
    waiting = np.flatnonzero(np.isin(motion, (PERIODIC, QUASI_PERIODIC, CHAOTIC)))
    waiting = waiting[np.argsort(kind[waiting], kind="stable")]
    tried, how = 1, (steps_per_period, method)
    while waiting.size:
        check()
        _, first, sizes = np.unique(kind[waiting], return_index=True, return_counts=True)
        rank = np.arange(waiting.size) - np.repeat(first, sizes)
        some = waiting[rank < tried][:AT_ONCE]
        for one in _from(system.of(some), some, state[some], period[some], *how):
            if number[one.lane] >= 0:
                continue
            mine = of_kind.setdefault(int(kind[one.lane]), [])
            same = [at for at in mine if _is_same(one, known[at])]
            if not same:
                mine.append(len(known))
                known.append(one)
            number[one.lane] = place = (same or mine)[-1]
            alike = np.flatnonzero((kind == kind[one.lane]) & (number < 0))
            near = distances(state[alike], one.points) <= one.reach
            number[alike[near]] = place
        waiting = waiting[(number[waiting] < 0) & ~np.isin(waiting, some)]
        tried *= 4
    return known, number


def led_to(
    system: System, start: Floats, steps_per_period: int, method: str = "rk4"
) -> NDArray[np.float64]:
    """Return the section (lanes, points, states) on which lanes move after `SETTLING`.

    Once an excitation period; ``start`` (lanes, states) at tau = 0, the others as for `polish`.
    """
    length = _whole(ENOUGH, system)
    before = _whole(SETTLING, system)
    plan = Plan(steps_per_period, before, length, length, tangent=True, method=method)
    return integrate(system, start, plan).every(system.repeats_after).section


def _whole(periods: int, system: System) -> int:
    """Round mesh periods down to whole excitation periods, enough of them to tell a period."""
    return system.repeats_after * max(POINTS_NEEDED, periods // system.repeats_after)


def _is_same(one: Attractor, other: Attractor) -> bool:
    return bool(np.mean(distances(one.points, other.points) <= other.reach) >= 0.5)


def _from(
    system: System, lanes: Lanes, state: Floats, period: NDArray[np.int32], *how: Any
) -> list[Attractor]:
    """Return the attractors of lanes, where there are some."""
    steps, method = how
    repeats, found = system.repeats_after, []
    orbits = polish(system, state, period, *how)
    late = np.flatnonzero((period > 0) & ~orbits.stable)
    if late.size:
        # Where a longer look told the orbit, the lane may be far from it yet.
        further = Plan(steps, _whole(LONG, system), 0, 0, tangent=True, method=method)
        state[late] = integrate(system.of(late), state[late], further).end_state
        orbits = polish(system, state, period, *how)
    start = np.where(period[:, np.newaxis] > 0, orbits.points, state)
    for n in np.unique(period).tolist():
        some = np.flatnonzero((period == n) & (orbits.stable | (n == 0)))
        length = n * repeats or _whole(LONG, system)
        plan = Plan(steps, 0, length, length, tangent=True, method=method)
        sections = integrate(system.of(some), start[some], plan).every(repeats).section
        for at, points in zip(some.tolist(), sections, strict=True):
            if np.isfinite(points).all():
                half = len(points) // 2
                reach = REACH if n else float(distances(points[half:], points[:half]).max())
                found.append(Attractor(int(lanes[at]), points, reach, orbits.multipliers[at]))
    return sorted(found, key=lambda one: one.lane)
