"""Steps of a block of lanes by the maps of `flow_map`, and the crossings within them.

Lanes move by the map of the branches on which they begin the step. Where a gap leaves its branch at
the moment s, the motion after it is one on the next branch b that began the step elsewhere:

    x_b = x - int_{-1}^{s} [force on b - force on a, along a] K(r) Phi_b(r -> -1) u / 2 dr.

Everything then repeats itself: the gaps of that motion as polynomials, the next crossing after s,
and at last its end by the map of b. The tangent vector goes the same way, its moments of crossing
those of the motion: the field is continuous, so that no other term comes from them.
"""

import math

from gearchaos_kernels.block_memory import (
    BEFORE,
    COEFFICIENTS,
    FORCES,
    LANES,
    MARGINS,
    STATE,
    STRIDE,
    SUSPECT,
    TANGENT,
    Branch,
    Branches,
    Lane,
    load,
    read_branches,
    read_state,
    write_branches,
)
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact import (
    NEVER,
    branches_at,
    first_fall,
    may_leave,
    next_branch,
    tell_crossing,
)
from gearchaos_kernels.equations import gaps_at
from gearchaos_kernels.flow_layout import BOUND_Y, BOUND_Z, HEADER, TERMS, layout
from gearchaos_kernels.flow_vectors import (
    GAP_Y,
    GAP_Z,
    INPUTS,
    RESULT,
    TANGENT_GAP,
    TANGENT_INPUTS,
    VECTOR,
    add_switch,
    end_of,
    gap_along,
    keep_before,
    move,
    tangent_end_of,
    tangent_gap_along,
    value_and_slope,
)
from gearchaos_kernels.forcing import Phase, forcing_at
from gearchaos_kernels.splitting import MOST_SPLITS

ALWAYS = Branch(1.0, 0.0, -math.inf, math.inf)
"""The branch of a mesh without clearance."""

_THIRD = 1.0 / 3.0
_LOOKS = 300
_NARROW = 1e-9
"""In so short a piece of a step a gap that turns around goes as far as rounding does."""
_LAST_CORRECTION = 1e-8
_ITERATIONS = 60


@scalar
def phases_of(table, row):
    """Return the mesh phase at the beginning and at the end of a step."""
    begin = Phase(0.0, table[row], table[row + 1], -table[row])
    return begin, Phase(0.0, table[row + 2], table[row + 3], -table[row + 2])


@scalar
def begin_forces(memory, slot, lane, present):
    """Store what forces a lane, in the order of columns; without clearance no flank has offsets."""
    amplitude = 0.5 * lane.axial_error_amplitude
    error = FORCES + 1 + layout(present).ways
    memory[FORCES * STRIDE + slot] = lane.load
    memory[error * STRIDE + slot] = amplitude * lane.cos_phase
    memory[(error + 1) * STRIDE + slot] = amplitude * lane.sin_phase
    branches = Branches(ALWAYS, ALWAYS)
    if present.resolved is not None:
        branches = read_branches(memory, slot, present)
    store_offsets(memory, slot, lane, branches, present)


@scalar
def store_offsets(memory, slot, lane, branches, present):
    """Store by how much each gap exceeds the deflection on its branch."""
    y, z = offsets_of(lane, branches, present)
    memory[(FORCES + 1) * STRIDE + slot] = y
    if present.axial is not None:
        memory[(FORCES + 2) * STRIDE + slot] = z


@scalar
def offsets_of(lane, branches, present):
    """Return the offsets of both branches, with the mean error, which no column of a map has."""
    y, z = branches
    error_y, error_z = mean_errors(lane, present)
    return y.offset + y.engaged * error_y, z.offset + z.engaged * error_z


@scalar
def mean_errors(lane, present):
    """Return what the mean pitch error takes from the gaps."""
    if present.pitch_error is None:
        return 0.0, 0.0
    return lane.error_mean, lane.axial_error_mean - lane.error_mean


@scalar
def pair_of(branches, present):
    """Return the number of a pair of branches among the maps of a step."""
    pair = 0 if branches.tangential.engaged != 0.0 else 1
    if present.axial is not None:
        pair += 0 if branches.axial.engaged != 0.0 else 2
    return pair


@scalar
def move_block(memory, table, row, slots, work, present):
    """Take one step in so many slots; return how many may have left a contact branch."""
    place = layout(present)
    if slots == 1:
        return move_lane(memory, table, row, work, present)
    for slot in range(0, slots, VECTOR):
        keep_before(memory, slot, table, row, present)
    for pair in range(place.pairs):
        at = row + HEADER + pair * place.size
        for slot in range(0, slots, VECTOR):
            move(memory, slot, table, at, 1.0 - pair % 2, 1.0 - pair // 2, present)
    # A known number of slots is what the compiler makes vector instructions of.
    if slots == VECTOR:
        return count_suspects(memory, VECTOR, table, row, present)
    return count_suspects(memory, LANES, table, row, present)


@scalar
def move_lane(memory, table, row, work, present):
    """Take one step of the only lane, along its state; bit for bit the one that vectors take."""
    place = layout(present)
    # Number by number: a vector would have to wait for the single numbers stored before it.
    for line in range(place.states):
        memory[(BEFORE + STATE + line) * STRIDE] = memory[(STATE + line) * STRIDE]
        if present.tangent is not None:
            memory[(BEFORE + TANGENT + line) * STRIDE] = memory[(TANGENT + line) * STRIDE]
    gather(memory, 0, work, present)
    margin_y = 0.0
    margin_z = 0.0
    for column in range(place.columns):
        margin_y += table[row + BOUND_Y + column] * abs(work[INPUTS + column])
        margin_z += table[row + BOUND_Z + column] * abs(work[INPUTS + column])
    memory[MARGINS * STRIDE] = margin_y
    memory[(MARGINS + 1) * STRIDE] = margin_z
    at = row + HEADER
    if present.resolved is not None:
        at += pair_of(read_branches(memory, 0, present), present) * place.size
    scatter(memory, 0, table, at, work, present)
    return count_suspects(memory, 1, table, row, present)


@scalar
def gather(memory, slot, work, present):
    """Read what is to be multiplied with a map: state before the step, forces, tangent vector."""
    place = layout(present)
    for line in range(place.states):
        work[INPUTS + line] = memory[(BEFORE + STATE + line) * STRIDE + slot]
        if present.tangent is not None:
            work[TANGENT_INPUTS + line] = memory[(BEFORE + TANGENT + line) * STRIDE + slot]
    for number in range(place.columns - place.states):
        work[INPUTS + place.states + number] = memory[(FORCES + number) * STRIDE + slot]


@scalar
def scatter(memory, slot, table, at, work, present):
    """Write where a map leads what was read, state and tangent vector."""
    place = layout(present)
    end_of(work, RESULT, INPUTS, table, at, present)
    for line in range(place.states):
        memory[(STATE + line) * STRIDE + slot] = work[RESULT + line]
    if present.tangent is not None:
        tangent_end_of(work, RESULT, TANGENT_INPUTS, table, at, present)
        for line in range(place.states):
            memory[(TANGENT + line) * STRIDE + slot] = work[RESULT + line]


@scalar
def count_suspects(memory, slots, table, row, present):
    """Mark the lanes whose gaps may have left their branches since the step began."""
    if present.resolved is None:
        return 0
    begin, end = phases_of(table, row)
    suspects = 0
    for slot in range(slots):
        lane = load(memory, COEFFICIENTS, slot, Lane)
        branches = read_branches(memory, slot, present)
        before = read_state(memory, BEFORE + STATE, slot, present)
        after = read_state(memory, STATE, slot, present)
        gaps = gaps_at(before, lane, forcing_at(lane, begin, present), present)
        gaps_after = gaps_at(after, lane, forcing_at(lane, end, present), present)
        margin = memory[MARGINS * STRIDE + slot]
        suspect = may_leave(gaps.tangential, gaps_after.tangential, branches.tangential, margin)
        if present.axial is not None:
            margin = memory[(MARGINS + 1) * STRIDE + slot]
            suspect |= may_leave(gaps.axial, gaps_after.axial, branches.axial, margin)
        suspects += 1 if suspect else 0
        memory[SUSPECT * STRIDE + slot] = 1.0 if suspect else 0.0
    return suspects


@scalar
def cross(memory, slot, table, row, work, number, recorded, present):
    """Take the step of one lane from crossing to crossing; see `split_step` for what it returns."""
    place = layout(present)
    lane = load(memory, COEFFICIENTS, slot, Lane)
    b = lane.half_backlash
    branches = read_branches(memory, slot, present)
    gather(memory, slot, work, present)
    error_y, error_z = mean_errors(lane, present)
    done = -1.0
    crossings = 0
    slowest = math.inf
    while True:
        at = row + HEADER + pair_of(branches, present) * place.size
        offset_y, offset_z = offsets_of(lane, branches, present)
        work[INPUTS + place.states + 1] = offset_y
        gap_along(work, GAP_Y, INPUTS, table, at + place.gap_y, present)
        work[GAP_Y] -= error_y
        moment = leaving(work, GAP_Y, done, branches.tangential, b)
        axially = False
        if present.axial is not None:
            work[INPUTS + place.states + 2] = offset_z
            gap_along(work, GAP_Z, INPUTS, table, at + place.gap_z, present)
            work[GAP_Z] -= error_z
            moment_z = leaving(work, GAP_Z, done, branches.axial, b)
            axially = not moment <= moment_z
            moment = min(moment, moment_z)
        # Also where the lane has left the range of numbers.
        if not moment <= 1.0 or crossings == MOST_SPLITS:
            break

        crossings += 1
        done = moment
        gap = GAP_Z if axially else GAP_Y
        columns = place.gap_z if axially else place.gap_y
        switch = place.switch_z if axially else place.switch_y
        speed = lane.axial_speed if axially else lane.tangential_speed
        branch = branches.axial if axially else branches.tangential
        value, slope = value_and_slope(work, gap, moment)
        # The step is 2 long in s.
        speed *= 2.0 * abs(slope)
        slowest = min(slowest, speed)
        following = next_branch(branch, value, b)
        if present.contact is not None:
            if recorded:
                at_step = number + 0.5 * (1.0 + moment)
                tell_crossing(memory, slot, axially, branch, following, at_step, speed)
        if present.tangent is not None:
            tangent_gap_along(work, TANGENT_GAP, TANGENT_INPUTS, table, at + columns, present)
        if axially:
            branches = Branches(branches.tangential, following)
        else:
            branches = Branches(following, branches.axial)
        # One of the two offsets is that of the flank, the other one 0.
        work[gap] -= branch.offset + following.offset
        sign = branch.engaged - following.engaged
        at = row + HEADER + pair_of(branches, present) * place.size
        add_switch(work, gap, moment, sign, table, at + switch, present)

    overflow = 1 if moment <= 1.0 else 0
    if crossings > 0:
        scatter(memory, slot, table, at, work, present)
        if overflow > 0:
            _, end = phases_of(table, row)
            state = read_state(memory, STATE, slot, present)
            gaps = gaps_at(state, lane, forcing_at(lane, end, present), present)
            branches = branches_at(gaps, b, present)
        write_branches(memory, slot, branches)
        store_offsets(memory, slot, lane, branches, present)
    return crossings, slowest, overflow


@scalar
def leaving(work, gap, done, branch, half_backlash):
    """Return the moment after ``done`` at which a gap leaves its branch, or `NEVER`."""
    if half_backlash == 0.0:
        return NEVER
    bend = 0.0
    for term in range(TERMS - 1, 3, -1):
        bend += term * (term - 1.0) * (term - 2.0) * (term - 3.0) * abs(work[gap + term])
    begin = value_and_slope(work, gap, done)
    end = value_and_slope(work, gap, 1.0)
    if branch.engaged != 0.0:
        side = math.copysign(1.0, branch.offset)
        return first_below(work, gap, done, begin, end, bend, side, -half_backlash)
    return min(
        first_below(work, gap, done, begin, end, bend, -1.0, half_backlash),
        first_below(work, gap, done, begin, end, bend, 1.0, half_backlash),
    )


@scalar
def first_below(work, gap, done, begin, end, bend, side, distance):
    """Return where a gap, seen from one side and raised by a distance, first falls below zero.

    ``begin``, ``end``: value and slope at ``done`` and at the end of the step; ``bend``: more than
    its fourth derivative. Piece by piece: one whose Bezier points with their margins are not below
    zero has no such place, in one that only falls it is found by Newton's method, others are
    halved.
    """
    left = done
    # A step that begins where the last one ended at the boundary begins on the right side of it.
    value_left = max(side * begin[0] + distance, 0.0)
    slope_left = side * begin[1]
    right = 1.0
    value_right = side * end[0] + distance
    slope_right = side * end[1]
    for _ in range(_LOOKS):
        width = right - left
        # The polynomial and the cubic differ by bend (width^4 / 24) t^2 (1 - t)^2 at most.
        stray = bend * width**4 / 24.0
        point1 = value_left + _THIRD * width * slope_left
        point2 = value_right - _THIRD * width * slope_right
        clear = min(point1, point2) >= stray / 12.0 and value_right >= 0.0
        if not clear:
            # Their slopes differ by less than a fifth of the same number.
            steepest = max(width * slope_left, 3.0 * (point2 - point1), width * slope_right)
            if steepest < -stray * 0.2 and value_right < 0.0:
                slopes = width * slope_left, width * slope_right
                guess = first_fall(value_left, slopes[0], value_right, slopes[1])
                return falling_root(work, gap, side, distance, left, right, guess)
            clear = steepest < -stray * 0.2
            if not clear and width < _NARROW:
                if value_right < 0.0:
                    return right
                clear = True
        if clear:
            if right >= 1.0:
                return NEVER
            left = right
            value_left = max(value_right, 0.0)
            slope_left = slope_right
            right = min(1.0, left + 2.0 * width)
        else:
            right = left + 0.5 * width
        value, slope = value_and_slope(work, gap, right)
        value_right = side * value + distance
        slope_right = side * slope
    return NEVER


@scalar
def falling_root(work, gap, side, distance, left, right, guess):
    """Return where a gap that falls from one end of a piece to the other passes zero."""
    at = left + (right - left) * guess
    for _ in range(_ITERATIONS):
        value, slope = value_and_slope(work, gap, at)
        value = side * value + distance
        if value > 0.0:
            left = at
        else:
            right = at
        following = at - value / (side * slope)
        if not left <= following <= right:
            following = 0.5 * (left + right)
        elif abs(following - at) < _LAST_CORRECTION:
            return following
        at = following
    return at
