"""RK4 as a method: fixed steps, split at crossings if the plan says so."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.branches import suspects_of
from gearchaos_kernels.memory.block_memory import (
    read_branches,
    read_lane,
    read_state,
    read_varied_input,
    slots_of,
    state_of,
    write_state,
)
from gearchaos_kernels.memory.rows import STATE, STRIDE, rows
from gearchaos_kernels.methods.protocol import Integers, Method, Share, cut
from gearchaos_kernels.methods.rk4 import steps as rk4
from gearchaos_kernels.methods.rk4.splitting import split_step
from gearchaos_kernels.methods.rk4.stability import amplification, stable_reach
from gearchaos_kernels.methods.rk4.switching import keep_before, switch_lanes, switching_lanes
from gearchaos_kernels.models.interfaces import (
    first_point,
    forcing_at,
    from_kept,
    gaps_at,
    grid_at,
    keep_point,
    point_at,
    to_kept,
)
from gearchaos_kernels.plan import Plan
from gearchaos_kernels.scene import Scene, implement


@dataclass(frozen=True)
class Rk4:
    """Identifies RK4 in a scene; it has no flags."""


def prepare(system: Any, plan: Plan, _scene: Scene, _periods: Integers) -> Iterator[Share]:
    """Yield all lanes as one share: RK4 prepares nothing for them."""
    lanes, steps = system.lanes, plan.steps_per_period
    blocks = cut(np.array([lanes]), np.array([steps]), np.array([0]))
    yield Share(np.arange(lanes), blocks, np.zeros(0), np.full(lanes, steps))


def work(system: Any, plan: Plan, stable: NDArray[np.int64]) -> float:
    """Return the number of steps of all lanes; lanes take as many as they need to be stable."""
    steps = np.maximum(plan.steps_per_period, np.max(stable))
    return float(system.lanes * steps * (plan.transient_periods + plan.recorded_periods))


@scalar
def maps_per_step(scene):
    """Return 0: RK4 prepares nothing."""
    return 0


@scalar
def room(scene):
    """Return 0: a block has the rows of its scene."""
    return 0


@scalar
def workspace(memory, scene):
    """Return nothing: RK4 needs no workspace."""
    return


@scalar
def begin_lane(memory, slot, index, lane, given, scene):
    """Prepare nothing."""


@scalar
def change_input(memory, slot, lane, scene):
    """Prepare nothing: a step reads the input among the coefficients of its lane."""


@scalar
def step(memory, lanes, at, given, scene):
    """Take one step in every slot; return how many lanes may have left a contact branch."""
    # Hoisted out of the loop over slots: the compiler cannot rule out aliasing with the tables.
    start = grid_at(given.tables, 2 * at.number, scene)
    middle = grid_at(given.tables, 2 * at.number + 1, scene)
    final = grid_at(given.tables, 2 * at.number + 2, scene)
    # A sum of integers, because the compiler does not vectorise a loop that sets a flag.
    suspects = 0
    if scene.switches is not None:
        switching = switching_lanes(memory, at.number, scene)
        if switching > 0:
            keep_before(memory, scene)
    for slot in range(slots_of(lanes)):
        lane = read_lane(memory, slot, scene)
        state = state_of(memory, slot, scene)
        begin = forcing_at(lane, first_point(memory, slot, start, scene), scene)
        halfway = forcing_at(lane, point_at(memory, slot, middle, scene), scene)
        point = point_at(memory, slot, final, scene)
        end = forcing_at(lane, point, scene)
        keep_point(memory, slot, point, scene)
        during = begin, halfway, halfway, end
        branches = None
        if scene.resolved is not None:
            branches = read_branches(memory, slot, scene)
        moving = from_kept(state, begin, scene)
        after, pushes = rk4.advance(rk4.motion_stage, moving, 1.0, lane, during, branches, scene)
        if scene.resolved is not None:
            gaps = gaps_at(moving, lane, begin, scene)
            gaps_after = gaps_at(after, lane, end, scene)
            elements = suspects_of(gaps, gaps_after, branches, 0.0, scene)
            suspects += 1 if elements != 0.0 else 0
            memory[rows(scene).suspect * STRIDE + slot] = elements
        if scene.before is not None:
            write_state(memory, rows(scene).state_before, slot, state, scene)
        write_state(memory, STATE, slot, to_kept(after, end, scene), scene)
        if scene.tangent is not None:
            tangent = read_state(memory, rows(scene).tangent, slot, scene)
            if scene.resolved is not None:
                write_state(memory, rows(scene).tangent_before, slot, tangent, scene)
            varied = read_varied_input(memory, slot, scene)
            tangent, _ = rk4.advance(rk4.tangent_stage, tangent, 1.0, lane, pushes, varied, scene)
            write_state(memory, rows(scene).tangent, slot, tangent, scene)
    if scene.switches is not None:
        if switching > 0:
            switch_lanes(memory, lanes, at, given.tables, scene)
    return suspects


@scalar
def resolve(memory, lanes, at, given, scene):
    """Split the step of every lane that may have left a contact branch."""
    # No argument is an array of the outcome: its references would be counted at every step.
    for slot in range(lanes):
        if memory[rows(scene).suspect * STRIDE + slot] != 0.0:
            split_step(memory, slot, at, given.tables, scene)


@scalar
def grids(clock, given, scene):
    """Return what all lanes share at the beginning, in the middle and at the end of a step."""
    begin = grid_at(given.tables, 2 * clock.number, scene)
    middle = grid_at(given.tables, 2 * clock.number + 1, scene)
    return begin, middle, grid_at(given.tables, 2 * clock.number + 2, scene)


RK4 = Method(
    name="rk4",
    flags=Rk4,
    always_resolved=False,
    traces=False,
    refuses=lambda _system: "",
    stops=lambda _scene: False,
    rows=lambda _scene: 0,
    prepare=prepare,
    memory=lambda _system, _plan, _scene, _stable: 0,
    sharing=lambda system: np.zeros(system.lanes, dtype=np.intp),
    work=work,
    amplification=amplification,
    stable_reach=stable_reach,
    is_kept=lambda _system, _plan, _scene: True,
    gap_terms=None,
    maps_per_step=maps_per_step,
    room=room,
    workspace=workspace,
    begin_lane=begin_lane,
    change_input=change_input,
    step=step,
    resolve=resolve,
    grids=grids,
)

implement(Rk4, RK4)
