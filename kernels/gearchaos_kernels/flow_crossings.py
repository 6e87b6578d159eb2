"""Crossings within a step that is a map.

Where a gap leaves its branch at the moment s, the motion after it is one on the next branch b that
began the step elsewhere:

    x_b = x - int_{-1}^{s} [force on b - force on a, along a] K(r) Phi_b(r -> -1) u / 2 dr.

Everything then repeats itself: the gaps of that motion, the next crossing after s, and its end by
the map of b. The tangent vector goes the same way, its moments of crossing those of the motion: the
field is continuous, so that no other term comes from them.
"""

from gearchaos_kernels import contact, rows
from gearchaos_kernels import flow_vectors as vectors
from gearchaos_kernels.block_memory import read_branches, read_lane, store, write_branches
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.equations import Gap
from gearchaos_kernels.flow_layout import (
    AFTER,
    AXIALLY,
    CROSSED,
    FACTOR,
    GAP,
    GAPS,
    MOMENT,
    Crossing,
    layout,
)
from gearchaos_kernels.flow_moments import find_moments
from gearchaos_kernels.flow_steps import gaps_at_ends, store_offsets
from gearchaos_kernels.flow_vectors import VECTOR
from gearchaos_kernels.rows import STRIDE, Branch, Lane
from gearchaos_kernels.splitting import MOST_SPLITS

_HALF_BACKLASH, _ERROR, _PHASE = (
    rows.COEFFICIENTS + Lane._fields.index(name)
    for name in ("half_backlash", "error_mean", "cos_phase")
)
_BRANCH = len(Branch._fields)


@scalar
def cross(memory, lanes, table, row, work, number, recorded, present):
    """Take the step of the lanes that may have left a branch, eight at a time."""
    slots = work.slots
    suspects = 0
    for slot in range(lanes):
        slots[suspects] = slot
        suspects += 1 if memory[rows.SUSPECT * STRIDE + slot] != 0.0 else 0
    for first in range(0, suspects, VECTOR):
        some = slots[first : min(first + VECTOR, suspects)]
        cross_together(memory, some, work.aside, table, row, number, recorded, present)


@scalar
def cross_together(memory, slots, aside, table, row, number, recorded, present):
    """Take the step of up to eight lanes from crossing to crossing."""
    place, lanes = layout(present), slots.shape[0]
    for n in range(lanes):
        take_aside(memory, slots[n], aside, n, present)
    crossings, left = 0, lanes
    while left > 0 and crossings < MOST_SPLITS:
        crossings += 1
        vectors.look_along(aside, 0, table, row, present)
        for way in range(place.ways):
            find_moments(aside, way, lanes, present)
        cross_over(aside, present)
        for n in range(lanes):
            tell_crossing(memory, slots[n], aside, n, number, recorded, present)
        vectors.sum_along(aside, present)
        vectors.add_switch(aside, 0, table, row, present)
        vectors.bound_bends(aside, 0, table, row, present)
        vectors.move(aside, 0, table, row, present)
        left = count_left(aside, lanes, table, row, present)
    for n in range(lanes):
        copy_rows(aside, n, memory, slots[n], rows.STATE, place.states)
        if present.tangent is not None:
            copy_rows(aside, n, memory, slots[n], rows.TANGENT, place.states)
        if aside[rows.SUSPECT * STRIDE + n] != 0.0:
            give_up(memory, slots[n], table, row, present)


@scalar
def take_aside(memory, slot, aside, n, present):
    """Copy what a lane that crosses needs of itself."""
    place = layout(present)
    axial = 0 if present.axial is None else 1
    copy_rows(memory, slot, aside, n, rows.STATE_BEFORE, place.states)
    if present.tangent is not None:
        copy_rows(memory, slot, aside, n, rows.TANGENT_BEFORE, place.states)
    if place.states > 2:
        copy_rows(memory, slot, aside, n, rows.COEFFICIENTS, 2)
    copy_rows(memory, slot, aside, n, _HALF_BACKLASH, 1)
    if present.pitch_error is not None:
        copy_rows(memory, slot, aside, n, _ERROR, 3 + 3 * axial)
    if present.phase is not None:
        copy_rows(memory, slot, aside, n, _PHASE, 2)
    copy_rows(memory, slot, aside, n, rows.TANGENTIAL_BRANCH, _BRANCH * place.ways)
    copy_rows(memory, slot, aside, n, rows.SUSPECT, 1)
    copy_rows(memory, slot, aside, n, rows.FORCES, place.columns - place.states)
    aside[AFTER * STRIDE + n] = -1.0


@scalar
def copy_rows(memory, slot, other, place, first, count):
    """Copy so many rows of a lane to a place in another memory."""
    for row in range(first, first + count):
        other[row * STRIDE + place] = memory[row * STRIDE + slot]


@scalar
def cross_over(aside, present):
    """Choose the next crossing of lanes side by side, and put them on the branches that follow."""
    place = layout(present)
    for n in range(VECTOR):
        lane = read_lane(aside, n)
        moment, axially = aside[(GAPS + MOMENT) * STRIDE + n], 0.0
        if present.axial is not None:
            moment_z = aside[(GAPS + GAP + MOMENT) * STRIDE + n]
            axially = 0.0 if moment <= moment_z else 1.0
            moment = min(moment, moment_z)
        # None also where the lane has left the range of numbers.
        crosses = moment <= 1.0
        factor, edge = 0.0, 0.0
        for way in range(place.ways):
            branch = read_branches(aside, n)[way]
            gap = crossed_at(aside, n, way)
            following = contact.next_branch(branch, gap.value, lane.half_backlash)
            here = crosses & (axially == way)
            factor = branch.engaged - following.engaged if here else factor
            # One of the two offsets is that of the flank, the other one 0.
            edge = branch.offset + following.offset if here else edge
            after = Branch(
                following.engaged if here else branch.engaged,
                following.offset if here else branch.offset,
                following.floor if here else branch.floor,
                following.ceiling if here else branch.ceiling,
            )
            store(aside, rows.TANGENTIAL_BRANCH + _BRANCH * way, n, after)
        store_offsets(aside, n, lane, read_branches(aside, n), present)
        moment = moment if crosses else aside[AFTER * STRIDE + n]
        store(aside, AFTER, n, Crossing(moment, factor, edge, axially))


@scalar
def tell_crossing(memory, slot, aside, n, number, recorded, present):
    """Tell of the crossing of a lane, if there is one, where it came from."""
    if aside[FACTOR * STRIDE + n] == 0.0:
        return
    axially = aside[AXIALLY * STRIDE + n] != 0.0
    lane = read_lane(memory, slot)
    at_step = number + 0.5 * (1.0 + aside[AFTER * STRIDE + n])
    crossed = crossed_at(aside, n, 1 if axially else 0)
    branches = read_branches(memory, slot)
    branches = contact.leave(
        memory, slot, axially, crossed, crossed.rate, branches, lane, at_step, recorded, present
    )
    write_branches(memory, slot, branches)
    store_offsets(memory, slot, lane, branches, present)


@scalar
def crossed_at(aside, n, way):
    """Return a gap where it crosses, with its rate per step."""
    at = (GAPS + way * GAP + CROSSED) * STRIDE + n
    # The step is 2 long in s.
    return Gap(aside[at], 2.0 * aside[at + STRIDE])


@scalar
def count_left(aside, lanes, table, row, present):
    """Tell which gaps may cross once more on the rest of the step; return of how many lanes."""
    place = layout(present)
    left = 0
    for n in range(VECTOR):
        lane = read_lane(aside, n)
        branches = read_branches(aside, n)
        gaps, gaps_after = gaps_at_ends(aside, n, lane, table, row, present)
        ways = 0.0
        for way in range(place.ways):
            crosses = aside[AXIALLY * STRIDE + n] == way if place.ways > 1 else True
            crossed = crossed_at(aside, n, way)
            # Of the gap that has crossed only the rest counts.
            rest = 0.5 * (1.0 - aside[AFTER * STRIDE + n]) if crosses else 1.0
            first = Gap(
                crossed.value if crosses else gaps[way].value,
                rest * crossed.rate if crosses else gaps[way].rate,
            )
            last = Gap(gaps_after[way].value, rest * gaps_after[way].rate)
            margin = aside[(rows.MARGINS + way) * STRIDE + n] * rest**4
            ways += 1.0 + way if contact.may_leave(first, last, branches[way], margin) else 0.0
        ways = ways if aside[FACTOR * STRIDE + n] != 0.0 else 0.0
        aside[rows.SUSPECT * STRIDE + n] = ways
        left += 1 if (ways != 0.0) & (n < lanes) else 0
    return left


@scalar
def give_up(memory, slot, table, row, present):
    """Go on from the end of a step that is not split any more, and count it."""
    lane = read_lane(memory, slot)
    _, gaps = gaps_at_ends(memory, slot, lane, table, row, present)
    branches = contact.branches_at(gaps, lane.half_backlash, present)
    write_branches(memory, slot, branches)
    store_offsets(memory, slot, lane, branches, present)
    memory[rows.OVERFLOWS * STRIDE + slot] += 1.0
