"""Shares of lanes whose maps are made on demand: for the sets of branches that lanes enter.

Every lane begins with the maps of the set on which all elements are engaged. Where a lane enters a
set without maps, its block stops (`sets`); the maps are made, and the block continues from the
beginning of that mesh period. If the series of a set do not converge, the lanes that enter it begin
anew with twice as many steps, and the others of their block with as many as before. Steps and
result of a lane therefore depend neither on other lanes nor on the order in which maps are made.
"""

from collections import deque
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.memory.rows import STRIDE, rows_of
from gearchaos_kernels.methods.flow_map.layout import layout_of
from gearchaos_kernels.methods.flow_map.making import MOST_MAP_STEPS, make_tables
from gearchaos_kernels.methods.flow_map.sets import KNOWN
from gearchaos_kernels.methods.flow_map.store import (
    SETS_VISITED,
    fewest_steps,
    sharing,
    which_maps,
)
from gearchaos_kernels.methods.protocol import Integers, Share, cut, whole_groups
from gearchaos_kernels.plan import MAP_BYTES, Floats, Plan
from gearchaos_kernels.scene import Scene
from gearchaos_kernels.turns import in_turn

MOST_BLOCKS = 64
"""Largest number of blocks of a group, whose memory is kept when they stop."""

_ENGAGED = (0,)
"""The set of branches on which all elements are engaged: the first one that has maps."""

_DIVERGES = -1
"""Place of maps whose series do not converge."""

Places = dict[int, int]
"""Where the maps of each set of branches begin, or `_DIVERGES`."""


@dataclass(frozen=True)
class _Group:
    """Lanes with the same maps that have not been integrated to the end.

    Attributes
    ----------
    lanes : array of int, shape (lanes,)
        Their numbers.
    steps : int
        Steps per period of their maps.
    sets : tuple of int
        Sets of branches whose maps they need, as far as known.
    lacked : array of int, shape (lanes,)
        The set for which each lane has stopped, `KNOWN` for none.
    progress : array, shape (blocks, numbers)
        See `Share`.
    full : int
        Number of lanes of a full block.
    """

    lanes: Integers
    steps: int
    sets: tuple[int, ...]
    lacked: Integers
    progress: Floats
    full: int

    @classmethod
    def at_start(cls, lanes: Integers, steps: int, rows: int, full: int) -> "_Group":
        """Return a group of lanes at tau = 0; ``rows``: number of rows of a block."""
        progress = np.zeros((-(-lanes.size // full), 1 + rows * STRIDE))
        return cls(lanes, steps, _ENGAGED, np.full(lanes.size, KNOWN), progress, full)

    def again(self, chosen: NDArray[np.bool_]) -> "_Group":
        """Return the group of some of its lanes at tau = 0, the same group if it is all of them."""
        if chosen.all():
            return self
        rows = self.progress.shape[1] // STRIDE
        some = self.at_start(self.lanes[chosen], self.steps, rows, self.full)
        return replace(some, sets=self.sets)

    def stopped(self, lacked: Integers, progress: Floats) -> "_Group":
        """Return the blocks that have stopped, which need the sets ``lacked`` (lanes,)."""
        sets = sorted({*self.sets, *lacked.tolist()} - {KNOWN})
        block = np.arange(lacked.size) // self.full
        left = np.bincount(block, lacked != KNOWN) > 0
        # All blocks but the last one are full, so those that are left keep their lanes.
        lanes = self.lanes[left[block]]
        kept = lacked[left[block]], progress[left]
        return _Group(lanes, self.steps, tuple(sets), *kept, self.full)

    def size(self, scene: Scene) -> int:
        """Return the size of the maps that its lanes will probably need, in numbers."""
        sets = max(len(self.sets), SETS_VISITED)
        return sets * self.steps * layout_of(scene).step_size


def shares_on_demand(system: Any, plan: Plan, scene: Scene, periods: Integers) -> Iterator[Share]:
    """Yield shares of lanes until none of them has stopped for lack of maps.

    ``periods`` (lanes,): their recorded periods. Lanes of a group have equally many.
    """
    steps, rows = fewest_steps(plan), rows_of(scene).total + plan.more_rows
    full = whole_groups(plan.lanes_together(len(system.states)))
    together = _lanes_together(system, periods, full)
    waiting = deque(_Group.at_start(lanes, steps, rows, full) for lanes in together)
    steps_of = np.full(system.lanes, steps)
    while waiting:
        groups = _as_many_as_fit(waiting, plan.map_bytes, scene)
        table, places = _sets_of(system, groups, steps, scene, plan.map_bytes)
        ready = []
        for group, found in zip(groups, places, strict=True):
            slow, moving = _by_convergence(group, found)
            if slow.size:
                if 2 * group.steps <= max(steps, MOST_MAP_STEPS):
                    waiting.appendleft(_Group.at_start(slow, 2 * group.steps, rows, full))
                else:
                    yield _without_maps(slow, steps, steps_of, scene)
            if moving.lanes.size:
                steps_of[moving.lanes] = group.steps
                ready.append((moving, found))
        if ready:
            share = _share_of(ready, table, steps_of)
            yield share
            waiting.extendleft(_stopped([group for group, _ in ready], share))


def _lanes_together(system: Any, periods: Integers, full: int) -> list[Integers]:
    """Return the numbers of lanes with the same maps and periods, up to `MOST_BLOCKS` full blocks.

    ``periods`` (lanes,): recorded periods; ``full``: number of lanes of a full block.
    """
    pairs = np.stack([sharing(system), periods], axis=1)
    numbers = np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1)
    in_groups = np.argsort(numbers, kind="stable")
    _, first = np.unique(numbers[in_groups], return_index=True)
    most = MOST_BLOCKS * full
    return [
        lanes[at : at + most]
        for lanes in np.split(in_groups, first[1:])
        for at in range(0, lanes.size, most)
    ]


def _stopped(groups: list[_Group], share: Share) -> Iterator[_Group]:
    """Yield the blocks of each group that have stopped in a share."""
    lane = block = 0
    for group in groups:
        lanes = slice(lane, lane + group.lanes.size)
        blocks = slice(block, block + len(group.progress))
        stopped = group.stopped(share.lacked[lanes], share.progress[blocks])
        if stopped.lanes.size:
            yield stopped
        lane, block = lanes.stop, blocks.stop


def _as_many_as_fit(waiting: deque[_Group], map_bytes: int, scene: Scene) -> list[_Group]:
    """Remove and return the first groups, as many as have maps that fit; at least one."""
    groups, size = [waiting.popleft()], 0
    size = groups[0].size(scene)
    while waiting and 8 * (size + waiting[0].size(scene)) <= map_bytes:
        groups.append(waiting.popleft())
        size += groups[-1].size(scene)
    return groups


def _by_convergence(group: _Group, found: Places) -> tuple[Integers, _Group]:
    """Return the lanes that need a set whose series do not converge, and a group of the others."""
    slow = np.full(group.lanes.size, found[0] == _DIVERGES)
    for number, place in found.items():
        if place == _DIVERGES:
            slow |= group.lacked == number
    return group.lanes[slow], group.again(~slow)


def _share_of(ready: list[tuple[_Group, Places]], table: Floats, steps_of: Integers) -> Share:
    """Return the share of some groups; each of their blocks knows where the maps of sets begin."""
    counts = np.array([group.lanes.size for group, _ in ready])
    steps = np.array([group.steps for group, _ in ready])
    places = np.array([found[0] for _, found in ready])
    blocks = cut(counts, steps, places, ready[0][0].full)
    of_block = np.searchsorted(np.cumsum(counts), blocks[:, 0], side="right")
    known = np.full((len(ready), 2 * max(len(found) for _, found in ready)), KNOWN)
    for row, (_, found) in zip(known, ready, strict=True):
        sets = [(number, place - found[0]) for number, place in found.items() if place >= 0]
        row[: 2 * len(sets)] = np.ravel(sets)
    order = np.concatenate([group.lanes for group, _ in ready])
    about = np.ascontiguousarray(np.hstack([blocks, known[of_block]]))
    progress = np.concatenate([group.progress for group, _ in ready])
    return Share(order, about, table, steps_of, np.full(order.size, KNOWN), progress)


def _without_maps(lanes: Integers, steps: int, steps_of: Integers, scene: Scene) -> Share:
    """Return the share of lanes for which no number of steps suffices: their maps are NaN."""
    blocks = cut(np.array([lanes.size]), np.array([steps]), np.array([0]))
    steps_of[lanes] = steps
    maps = np.full(steps * layout_of(scene).step_size, np.nan)
    return Share(lanes, blocks, maps, steps_of)


class _Kept:
    """Maps of single sets of branches in one table, one after the other, until no more fit.

    ``places``: of the maps of each set, by scene, parameters and steps.
    """

    def __init__(self, size: int) -> None:
        self.table = np.empty(max(size, MAP_BYTES // 8))
        self.used = 0
        self.places: dict[Hashable, Places] = {}

    def keep(self, name: Hashable, number: int, maps: Floats | None) -> None:
        """Store the maps of a set; None if they do not converge."""
        places = self.places.setdefault(name, {})
        if maps is None:
            places[number] = _DIVERGES
            return
        flat = maps.reshape(-1)
        self.table[self.used : self.used + flat.size] = flat
        place, self.used = self.used, self.used + flat.size
        # Last, so that a process forked meanwhile finds no name without its maps.
        places[number] = place


_kept = _Kept(0)


@in_turn
def _sets_of(
    system: Any, groups: list[_Group], steps: int, scene: Scene, map_bytes: int
) -> tuple[Floats, list[Places]]:
    """Return a table with the maps of all sets that groups of lanes need, and of further sets.

    Also returns the places in it, for each group. The maps are kept for later calls. ``steps``: the
    steps per period that were requested.
    """
    global _kept
    scene, place = scene.bare(), layout_of(scene)
    rows = system.of([group.lanes[0] for group in groups]).map_parameters()
    model = type(scene.model), scene.model
    scene_name = *model, *which_maps(scene), steps, system.map_constants()
    names = [(scene_name, row.tobytes(), g.steps) for row, g in zip(rows, groups, strict=True)]
    needed = [(name, g, number) for name, g in zip(names, groups, strict=True) for number in g.sets]
    new = [one for one in needed if one[2] not in _kept.places.get(one[0], {})]
    size = sum(group.steps for _, group, _ in new) * place.step_size
    if _kept.used + size > min(_kept.table.size, map_bytes // 8):
        # Not reused: another call may still be reading the old table.
        old, _kept = _kept, _Kept(sum(group.steps for _, group, _ in needed) * place.step_size)
        for name, group, number in needed:
            at = old.places.get(name, {}).get(number)
            if at is not None:
                length = group.steps * place.step_size
                maps = None if at == _DIVERGES else old.table[at : at + length]
                _kept.keep(name, number, maps)
    for count in sorted({group.steps for _, group, _ in new}):
        some = [one for one in new if one[1].steps == count]
        sets = np.array([[number] for _, _, number in some])
        lanes = [group.lanes[0] for _, group, _ in some]
        tables, converged, _ = make_tables(system.of(lanes), sets, count, scene)
        for (name, _, number), maps, converges in zip(some, tables, converged, strict=True):
            _kept.keep(name, number, maps if converges else None)
    return _kept.table, [dict(_kept.places[name]) for name in names]
