"""One step of one lane, split at every crossing of a clearance boundary.

The loop over slots integrates every step on the contact branches on which it begins, where the
field is smooth. The few lanes that may have left a branch are treated here one by one: the step is
repeated up to the crossing, then continued on the next branch, until it crosses no more.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.branches import MOST_CROSSINGS, Moment, branches_at, leave
from gearchaos_kernels.contact.elements import jumped
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.contact.leaving import NEVER, leaving_fraction
from gearchaos_kernels.memory.block_memory import (
    read_branches,
    read_lane,
    read_state,
    read_varied_input,
    state_before,
    state_of,
    write_branches,
    write_state,
)
from gearchaos_kernels.memory.rows import STATE, STRIDE, rows
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.methods.rk4 import steps as rk4
from gearchaos_kernels.models.interfaces import (
    forcing_at,
    from_kept,
    gaps_at,
    grid_at,
    half_clearances,
    point_at,
    point_within,
    to_kept,
)


@scalar
def split_step(memory, slot, at, tables, scene):
    """Repeat a step of a lane in pieces; each piece stays on its contact branches."""
    lane = read_lane(memory, slot, scene)
    begin = forcing_on_grid(memory, slot, lane, tables, 2 * at.number, scene)
    end = forcing_on_grid(memory, slot, lane, tables, 2 * at.number + 2, scene)
    split_part(memory, slot, at, (0.0, begin), (1.0, end), tables, scene)


@scalar
def split_part(memory, slot, at, first, last, tables, scene):
    """Repeat a part of a step of a lane, in which it may cross, in pieces.

    ``first``, ``last``: where the part begins and ends, as fractions of the step, and what acts on
    the lane there.
    """
    lane = read_lane(memory, slot, scene)
    state = state_before(memory, slot, scene)
    after = state_of(memory, slot, scene)
    tangent = tangent_before(memory, slot, state, scene)
    number, (done, begin), (until, end) = at.number, first, last
    state, after = from_kept(state, begin, scene), from_kept(after, end, scene)
    gaps = gaps_at(state, lane, begin, scene)
    branches = read_branches(memory, slot, scene)
    varied = read_varied_input(memory, slot, scene)
    crossings = 0
    while True:
        left = until - done
        gaps_after = gaps_at(after, lane, end, scene)
        fraction, element = first_crossing(gaps, gaps_after, left, branches, lane, scene)
        # The negated comparison also ends the loop if the fraction is not a number.
        if not fraction <= 1.0 or crossings == MOST_CROSSINGS:
            break
        piece = fraction * left
        middle = forcing_within(memory, slot, lane, tables, number, done + 0.5 * piece, scene)
        done += piece
        crossing = forcing_within(memory, slot, lane, tables, number, done, scene)
        during = begin, middle, middle, crossing
        state, pushes = rk4.advance(rk4.motion_stage, state, piece, lane, during, branches, scene)
        tangent = advance_tangent(tangent, piece, lane, pushes, varied, scene)
        begin = crossing
        crossings += 1
        gaps = gaps_at(state, lane, begin, scene)
        moment = Moment(number + done, at.recorded)
        tangent = pass_crossing(memory, slot, element, gaps, tangent, branches, moment, scene)
        branches = read_branches(memory, slot, scene)

        left = until - done
        middle = forcing_within(memory, slot, lane, tables, number, done + 0.5 * left, scene)
        during = begin, middle, middle, end
        after, pushes = rk4.advance(rk4.motion_stage, state, left, lane, during, branches, scene)
        write_state(memory, STATE, slot, to_kept(after, end, scene), scene)
        if scene.tangent is not None:
            tangent_after = advance_tangent(tangent, left, lane, pushes, varied, scene)
            write_state(memory, rows(scene).tangent, slot, tangent_after, scene)
    if crossings > 0:
        write_branches(memory, slot, branches_at(gaps_after, lane, scene), scene)
    if fraction <= 1.0:
        memory[(rows(scene).crossings + 2) * STRIDE + slot] += 1.0


@scalar
def tangent_before(memory, slot, state, scene):
    """Return the tangent vector before the step, or a state that is not read if there is none."""
    if scene.tangent is None:
        return state
    return read_state(memory, rows(scene).tangent_before, slot, scene)


@scalar
def pass_crossing(memory, slot, element, gaps, tangent, branches, moment, scene):
    """Put a lane on the branch after a crossing; return its tangent vector there."""
    lane = read_lane(memory, slot, scene)
    leave(memory, slot, element, gaps[element], branches, lane, moment, scene)
    following = read_branches(memory, slot, scene)
    return jumped(tangent, element, gaps, branches, following, lane, scene)


@scalar
def advance_tangent(tangent, fraction, lane, pushes, varied, scene):
    """Return a tangent vector a fraction of a step later, unchanged if the scene has none."""
    if scene.tangent is None:
        return tangent
    after, _ = rk4.advance(rk4.tangent_stage, tangent, fraction, lane, pushes, varied, scene)
    return after


@scalar
def forcing_on_grid(memory, slot, lane, tables, row, scene):
    """Return what acts on a lane at a row of the grid of half steps."""
    point = point_at(memory, slot, grid_at(tables, row, scene), scene)
    return forcing_at(lane, point, scene)


@scalar
def forcing_within(memory, slot, lane, tables, number, fraction, scene):
    """Return what acts on a lane at a fraction of a step."""
    point = point_within(memory, slot, tables, number, fraction, scene)
    return forcing_at(lane, point, scene)


@scalar
def first_crossing(begin, end, length, branches, lane, scene):
    """Return at which fraction of a piece, ``length`` steps long, which element leaves first."""
    clearances = half_clearances(lane, scene)
    fractions = each(leaving_fraction, begin, end, length, branches, clearances, kinds(scene))
    first = NEVER
    element = 0
    for number in range(len(fractions)):
        # Of elements that leave at the same moment, the one with the lowest number is first.
        earlier = number > 0 and not first <= fractions[number]
        element = number if earlier else element
        first = fractions[number] if number == 0 else min(first, fractions[number])
    return first, element
