"""Crossings within a step that is a map.

Where a gap leaves its branch at the moment s, the motion after it is one on the next branch b that
began the step elsewhere:

    x_b = x - int_{-1}^{s} [force on b - force on a, along a] K(r) Phi_b(r -> -1) u / 2 dr.

Everything then repeats itself: the gaps of that motion, the next crossing after s, and its end by
the map of b. The tangent vector goes the same way, its moments of crossing those of the motion: the
field is continuous, so that no other term comes from them.
"""

import math

from gearchaos_kernels import contact, rows
from gearchaos_kernels import flow_vectors as vectors
from gearchaos_kernels.block_memory import read_branches, read_lane, read_state, write_branches
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.equations import Gap, gaps_at
from gearchaos_kernels.flow_layout import (
    CROSSED,
    DISTANCE,
    DONE,
    GAP,
    GAPS,
    INPUTS,
    MOMENT,
    OWN,
    SIDE,
    TANGENT_GAP,
    TANGENT_INPUTS,
    TERMS,
    layout,
)
from gearchaos_kernels.flow_moments import UNKNOWN, find_moments, put_beside, take_back
from gearchaos_kernels.flow_steps import (
    gather,
    maps_on,
    mean_errors,
    phases_of,
    scatter,
    store_offsets,
)
from gearchaos_kernels.forcing import forcing_at
from gearchaos_kernels.rows import STRIDE
from gearchaos_kernels.splitting import MOST_SPLITS


@scalar
def cross(memory, lanes, table, row, work, number, recorded, present):
    """Take the step of the lanes that may have left a branch, from crossing to crossing.

    All of them go on together, stage by stage, and hardly anything branches: while the numbers of
    one lane are on their way, the processor is at the next.
    """
    numbers, slots = work.numbers, work.slots
    suspects = 0
    for slot in range(lanes):
        slots[suspects] = slot
        suspects += 1 if memory[rows.SUSPECT * STRIDE + slot] != 0.0 else 0
    for crossings in range(MOST_SPLITS):
        looks = 0
        for one in range(suspects):
            slot, own = slots[one], one * OWN
            if crossings == 0:
                gather(memory, slot, numbers, own, present)
                numbers[own + DONE] = -1.0
            ways = int(memory[rows.SUSPECT * STRIDE + slot])
            for way in range(layout(present).ways):
                gap = own + GAPS + way * GAP
                numbers[gap + MOMENT] = contact.NEVER
                if ways >> way & 1 != 0:
                    look_along(memory, slot, numbers, own, way, table, row, present)
                    put_beside(work, gap, looks)
                    looks += 1
        find_moments(work, looks)
        looks = 0
        for one in range(suspects):
            slot, own = slots[one], one * OWN
            ways = int(memory[rows.SUSPECT * STRIDE + slot])
            for way in range(layout(present).ways):
                if ways >> way & 1 != 0:
                    take_back(work, own + GAPS + way * GAP, looks)
                    looks += 1
            cross_over(memory, slot, numbers, own, table, row, number, recorded, present)
        left = 0.0
        for one in range(suspects):
            if memory[rows.SUSPECT * STRIDE + slots[one]] != 0.0:
                arrive(memory, slots[one], numbers, one * OWN, table, row, present)
                left += memory[rows.SUSPECT * STRIDE + slots[one]]
        if left == 0.0:
            return
    for one in range(suspects):
        if memory[rows.SUSPECT * STRIDE + slots[one]] != 0.0:
            give_up(memory, slots[one], table, row, present)


@scalar
def look_along(memory, slot, numbers, own, way, table, row, present):
    """Compute a gap of a lane along the step, and tell what it leaves, if it is a flank."""
    place = layout(present)
    lane = read_lane(memory, slot)
    branches = read_branches(memory, slot)
    gap = own + GAPS + way * GAP
    at = maps_on(branches, row, present) + place.gap + way * place.columns * TERMS
    vectors.gap_along(numbers, gap, own + INPUTS, table, at, present)
    numbers[gap] -= mean_errors(lane, present)[way]
    branch = branches[way]
    # A flank is left towards the middle.
    numbers[gap + SIDE] = math.copysign(branch.engaged, branch.offset)
    numbers[gap + DISTANCE] = lane.half_backlash * (1.0 - 2.0 * branch.engaged)
    numbers[gap + MOMENT] = UNKNOWN if numbers[own + DONE] > -1.0 else contact.NEVER


@scalar
def next_crossing(numbers, own, present):
    """Return the moment of the next crossing of a lane, or `NEVER`, and if it is an axial one."""
    moment = numbers[own + GAPS + MOMENT]
    if present.axial is None:
        return moment, False
    moment_z = numbers[own + GAPS + GAP + MOMENT]
    return min(moment, moment_z), not moment <= moment_z


@scalar
def crossed_at(numbers, gap):
    """Return a gap where it crosses, with its rate per step."""
    # The step is 2 long in s.
    return Gap(numbers[gap + CROSSED], 2.0 * numbers[gap + CROSSED + 1])


@scalar
def cross_over(memory, slot, numbers, own, table, row, number, recorded, present):
    """Carry a lane over its next boundary; without one it is no suspect any more."""
    place = layout(present)
    moment, axially = next_crossing(numbers, own, present)
    # Also where the lane has left the range of numbers.
    if not moment <= 1.0:
        memory[rows.SUSPECT * STRIDE + slot] = 0.0
        return

    lane = read_lane(memory, slot)
    branches = read_branches(memory, slot)
    way = 1 if axially else 0
    gap = own + GAPS + way * GAP
    crossed = crossed_at(numbers, gap)
    columns = maps_on(branches, row, present) + place.gap + way * place.columns * TERMS
    at_step = number + 0.5 * (1.0 + moment)
    branches, branch, following = contact.leave(
        memory, slot, axially, crossed, branches, lane, at_step, recorded, present
    )
    write_branches(memory, slot, branches)
    store_offsets(memory, slot, lane, branches, present)

    if present.tangent is not None:
        given, target = own + TANGENT_INPUTS, own + TANGENT_GAP
        vectors.tangent_gap_along(numbers, target, given, table, columns, present)
    # One of the two offsets is that of the flank, the other one 0.
    numbers[gap] -= branch.offset + following.offset
    sign = branch.engaged - following.engaged
    switch = maps_on(branches, row, present) + place.switch + way * TERMS * place.width
    vectors.add_switch(numbers, own, gap, moment, sign, table, switch, present)
    offset = memory[(rows.FORCES + 1 + way) * STRIDE + slot]
    numbers[own + INPUTS + place.states + 1 + way] = offset
    numbers[own + DONE] = moment


@scalar
def arrive(memory, slot, numbers, own, table, row, present):
    """Take a lane that has crossed to the end of the step; what may cross on the way is suspect."""
    place = layout(present)
    lane = read_lane(memory, slot)
    branches = read_branches(memory, slot)
    for line in range(place.states):
        memory[(rows.STATE + line) * STRIDE + slot] = numbers[own + INPUTS + line]
    elsewhere = read_state(memory, rows.STATE, slot, present)
    at = maps_on(branches, row, present)
    scatter(memory, slot, table, at, numbers, own, present)
    after = read_state(memory, rows.STATE, slot, present)
    begin, end = phases_of(table, row)
    gaps = gaps_at(elsewhere, lane, forcing_at(lane, begin, present), present)
    gaps_after = gaps_at(after, lane, forcing_at(lane, end, present), present)
    margins = vectors.margins_of(numbers, own + INPUTS, table, row)
    _, axially = next_crossing(numbers, own, present)
    ways = 0.0
    for way in range(place.ways):
        first, last, rest = gaps[way], gaps_after[way], 1.0
        if axially == (way == 1):
            # Of the gap that has crossed only the rest counts.
            rest = 0.5 * (1.0 - numbers[own + DONE])
            crossed = crossed_at(numbers, own + GAPS + way * GAP)
            first = Gap(crossed.value, rest * crossed.rate)
        last = Gap(last.value, rest * last.rate)
        if contact.may_leave(first, last, branches[way], margins[way] * rest**4):
            ways += 1.0 + way
    memory[rows.SUSPECT * STRIDE + slot] = ways


@scalar
def give_up(memory, slot, table, row, present):
    """Go on from the end of a step that is not split any more, and count it."""
    lane = read_lane(memory, slot)
    _, end = phases_of(table, row)
    state = read_state(memory, rows.STATE, slot, present)
    gaps = gaps_at(state, lane, forcing_at(lane, end, present), present)
    branches = contact.branches_at(gaps, lane.half_backlash, present)
    write_branches(memory, slot, branches)
    store_offsets(memory, slot, lane, branches, present)
    memory[rows.OVERFLOWS * STRIDE + slot] += 1.0
