"""Steps in which the equations of a lane switch at a known moment: they are taken in two parts.

The loop over slots integrates every step with the coefficients with which it begins, as it does on
contact branches. The few steps and lanes that switch come here one by one. A step that
ends with a switch is right as it is; any other one is repeated up to the switch, and continued with
the coefficients that follow. Each part stays on one side of the switch, so that the method keeps
its order. The state is continuous, and the moment the same for all neighbouring motions: the
tangent vector goes through the same parts.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import (
    read_branches,
    read_lane,
    read_state,
    read_varied_input,
    state_before,
    state_of,
    write_state,
)
from gearchaos_kernels.memory.rows import LANES, STATE, STRIDE, rows
from gearchaos_kernels.methods.rk4 import steps as rk4
from gearchaos_kernels.methods.rk4.splitting import advance_tangent, forcing_within, split_part
from gearchaos_kernels.models.interfaces import from_kept, next_switch, switch, to_kept


@scalar
def switches_in(lane, number, done, scene):
    """Return whether a lane switches in what is left of a step after a fraction of it."""
    moment = next_switch(lane, scene) - number
    return (done < moment) & (moment <= 1.0)


@scalar
def switching_lanes(memory, number, scene):
    """Return how many lanes switch in a step."""
    # A sum of integers, which the compiler vectorises; it does not vectorise a flag.
    switching = 0
    for slot in range(LANES):
        switching += 1 if switches_in(read_lane(memory, slot, scene), number, 0.0, scene) else 0
    return switching


@scalar
def keep_before(memory, scene):
    """Keep states and tangent vectors of all lanes as they are before a step."""
    size = rows(scene).state_before * STRIDE
    for place in range(size):
        memory[size + place] = memory[place]


@scalar
def switch_lanes(memory, lanes, at, tables, scene):
    """Switch the lanes that are due in a step, each at its moment."""
    for slot in range(lanes):
        if switches_in(read_lane(memory, slot, scene), at.number, 0.0, scene):
            switch_step(memory, slot, at, tables, scene)


@scalar
def switch_step(memory, slot, at, tables, scene):
    """Take a step of a lane in parts that end where it switches."""
    began = state_before(memory, slot, scene)
    done = 0.0
    while done < 1.0:
        lane = read_lane(memory, slot, scene)
        due = switches_in(lane, at.number, done, scene)
        until = next_switch(lane, scene) - at.number if due else 1.0
        take_part(memory, slot, at, done, until, tables, scene)
        if due:
            switch(memory, slot, lane, scene)
        done = until
        write_state(memory, rows(scene).state_before, slot, state_of(memory, slot, scene), scene)
        if scene.tangent is not None:
            tangent = read_state(memory, rows(scene).tangent, slot, scene)
            write_state(memory, rows(scene).tangent_before, slot, tangent, scene)
    # Recorders read the state before the whole step.
    write_state(memory, rows(scene).state_before, slot, began, scene)
    # Crossings are resolved part by part.
    memory[rows(scene).suspect * STRIDE + slot] = 0.0


@scalar
def take_part(memory, slot, at, first, last, tables, scene):
    """Take a part of a step, between two fractions of it, and split it where the lane crosses."""
    lane = read_lane(memory, slot, scene)
    length = last - first
    begin = forcing_within(memory, slot, lane, tables, at.number, first, scene)
    end = forcing_within(memory, slot, lane, tables, at.number, last, scene)
    if length < 1.0:
        # A whole step has been taken.
        half = forcing_within(memory, slot, lane, tables, at.number, first + 0.5 * length, scene)
        during = begin, half, half, end
        branches = None
        if scene.resolved is not None:
            branches = read_branches(memory, slot, scene)
        state = from_kept(state_before(memory, slot, scene), begin, scene)
        after, pushes = rk4.advance(rk4.motion_stage, state, length, lane, during, branches, scene)
        write_state(memory, STATE, slot, to_kept(after, end, scene), scene)
        if scene.tangent is not None:
            tangent = read_state(memory, rows(scene).tangent_before, slot, scene)
            varied = read_varied_input(memory, slot, scene)
            tangent = advance_tangent(tangent, length, lane, pushes, varied, scene)
            write_state(memory, rows(scene).tangent, slot, tangent, scene)
    if scene.resolved is not None:
        split_part(memory, slot, at, (first, begin), (last, end), tables, scene)
