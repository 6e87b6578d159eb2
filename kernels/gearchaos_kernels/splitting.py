"""One step of one lane, split wherever it leaves a contact branch.

The loop over slots integrates every step on the contact branches on which it begins, where the
field is smooth. The few steps and lanes that may have left a branch come here one by one: the step
is repeated up to the crossing, then on the next branch, as often as it crosses.
"""

import math

from gearchaos_kernels import rk4, rows
from gearchaos_kernels.block_memory import (
    read_branches,
    read_lane,
    read_state,
    write_branches,
    write_state,
)
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact import NEVER, branches_at, leave, leaving_fraction
from gearchaos_kernels.equations import flank_rate, from_error, from_rest, gaps_at
from gearchaos_kernels.forcing import forcing_at, phase_within
from gearchaos_kernels.rows import STRIDE
from gearchaos_kernels.teeth import between, point_on_grid

MOST_SPLITS = 16
"""Crossings of one step; a step with more goes on with its last branches and is counted."""


@scalar
def split_step(memory, slot, table, shares, number, recorded, present):
    """Repeat a step of a lane that ignored a crossing in pieces that stay on their branches."""
    lane = read_lane(memory, slot)
    state = read_state(memory, rows.STATE_BEFORE, slot, present)
    after = read_state(memory, rows.STATE, slot, present)
    tangent = state
    if present.tangent is not None:
        tangent = read_state(memory, rows.TANGENT_BEFORE, slot, present)
    point = point_on_grid(memory, slot, table, shares, 2 * number, present)
    begin = forcing_at(lane, point, present)
    point = point_on_grid(memory, slot, table, shares, 2 * number + 2, present)
    end = forcing_at(lane, point, present)
    state, after = from_rest(state, begin, present), from_rest(after, end, present)
    gaps = gaps_at(state, lane, begin, present)
    branches = read_branches(memory, slot)
    done = 0.0
    crossings = 0
    while True:
        left = 1.0 - done
        gaps_after = gaps_at(after, lane, end, present)
        fraction, axially = first_crossing(gaps, gaps_after, left, branches, lane, present)
        # Also where the lane has left the range of numbers, and the fraction is not one.
        if not fraction <= 1.0 or crossings == MOST_SPLITS:
            break

        piece = fraction * left
        middle = forcing_within(
            memory, slot, lane, table, shares, number, done + 0.5 * piece, present
        )
        done += piece
        crossing = forcing_within(memory, slot, lane, table, shares, number, done, present)
        during = begin, middle, middle, crossing
        state, slopes = rk4.advance(rk4.motion, state, piece, lane, during, branches, present)
        if present.tangent is not None:
            tangent, _ = rk4.advance(rk4.tangent, tangent, piece, lane, slopes, None, present)
        begin = crossing
        crossings += 1
        gaps = gaps_at(state, lane, begin, present)
        gap = gaps.axial if axially else gaps.tangential
        speed = flank_rate(gap, begin, present)
        branches = leave(
            memory, slot, axially, gap, speed, branches, lane, number + done, recorded, present
        )

        left = 1.0 - done
        middle = forcing_within(
            memory, slot, lane, table, shares, number, done + 0.5 * left, present
        )
        during = begin, middle, middle, end
        after, slopes = rk4.advance(rk4.motion, state, left, lane, during, branches, present)
        write_state(memory, rows.STATE, slot, from_error(after, end, present), present)
        if present.tangent is not None:
            tangent_after, _ = rk4.advance(rk4.tangent, tangent, left, lane, slopes, None, present)
            write_state(memory, rows.TANGENT, slot, tangent_after, present)
    if crossings > 0:
        write_branches(memory, slot, branches_at(gaps_after, lane.half_backlash, present))
    if fraction <= 1.0:
        memory[rows.OVERFLOWS * STRIDE + slot] += 1.0


@scalar
def forcing_within(memory, slot, lane, table, shares, number, fraction, present):
    """Return what acts on a lane at a fraction of a step."""
    point = phase_within(table, number, fraction)
    if present.teeth is not None:
        half = 0 if fraction < 0.5 else 1
        row = 2 * number + half
        begin = point_on_grid(memory, slot, table, shares, row, present)
        end = point_on_grid(memory, slot, table, shares, row + 1, present)
        width = 2.0 * math.pi / (table.shape[0] - 1)
        point = between(begin, end, 2.0 * fraction - half, width, point)
    return forcing_at(lane, point, present)


@scalar
def first_crossing(begin, end, length, branches, lane, present):
    """Return where in a piece of so many steps a gap leaves its branch, and if the axial one."""
    b = lane.half_backlash
    fraction = leaving_fraction(begin.tangential, end.tangential, length, branches.tangential, b)
    fraction_z = NEVER
    if present.axial is not None:
        fraction_z = leaving_fraction(begin.axial, end.axial, length, branches.axial, b)
    return min(fraction, fraction_z), not fraction <= fraction_z
