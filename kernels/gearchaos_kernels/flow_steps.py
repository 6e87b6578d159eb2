"""Steps of a block of lanes by the maps of `flow_map`, and the crossings within them.

Lanes move by the map of the branches on which they begin the step. Where a gap leaves its branch at
the moment s, the motion after it is one on the next branch b that began the step elsewhere:

    x_b = x - int_{-1}^{s} [force on b - force on a, along a] K(r) Phi_b(r -> -1) u / 2 dr.

Everything then repeats itself: the gaps of that motion as polynomials, the next crossing after s,
and at last its end by the map of b. The tangent vector goes the same way, its moments of crossing
those of the motion: the field is continuous, so that no other term comes from them.
"""

import math

from gearchaos_kernels import contact, rows
from gearchaos_kernels import flow_vectors as vectors
from gearchaos_kernels.block_memory import read_branches, read_lane, read_state, write_branches
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.equations import Gap, gaps_at
from gearchaos_kernels.flow_layout import BOUNDS, HEADER, layout
from gearchaos_kernels.flow_vectors import GAPS, INPUTS, RESULT, TANGENT_GAP, TANGENT_INPUTS, VECTOR
from gearchaos_kernels.forcing import Phase, forcing_at
from gearchaos_kernels.loads import tell_kink
from gearchaos_kernels.rows import LANES, STRIDE, Branch, Branches
from gearchaos_kernels.splitting import MOST_SPLITS

ALWAYS = Branch(1.0, 0.0, -math.inf, math.inf)
"""The branch of a mesh without clearance."""

_THIRD = 1.0 / 3.0
_LOOKS = 300
_NARROW = 1e-9
"""In so short a piece of a step a gap that turns around goes as far as rounding does."""


@scalar
def phases_of(table, row):
    """Return the mesh phase at the beginning and at the end of a step."""
    begin = Phase(0.0, table[row], table[row + 1], -table[row])
    return begin, Phase(0.0, table[row + 2], table[row + 3], -table[row + 2])


@scalar
def begin_forces(memory, slot, lane, present):
    """Store what forces a lane, in the order of columns; without clearance no flank has offsets."""
    amplitude = 0.5 * lane.axial_error_amplitude
    error = rows.FORCES + 1 + layout(present).ways
    memory[rows.FORCES * STRIDE + slot] = lane.load
    memory[error * STRIDE + slot] = amplitude * lane.cos_phase
    memory[(error + 1) * STRIDE + slot] = amplitude * lane.sin_phase
    branches = Branches(ALWAYS, ALWAYS)
    if present.resolved is not None:
        branches = read_branches(memory, slot)
    store_offsets(memory, slot, lane, branches, present)


@scalar
def store_offsets(memory, slot, lane, branches, present):
    """Store by how much each gap exceeds the deflection on its branch."""
    for way in range(layout(present).ways):
        offset = offset_of(way, lane, branches, present)
        memory[(rows.FORCES + 1 + way) * STRIDE + slot] = offset


@scalar
def offset_of(way, lane, branches, present):
    """Return the offset of a branch, with the mean error, which no column of a map has."""
    branch = branches[way]
    return branch.offset + branch.engaged * mean_errors(lane, present)[way]


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
        vectors.keep_before(memory, slot, table, row, present)
    for pair in range(place.pairs):
        at = row + HEADER + pair * place.size
        for slot in range(0, slots, VECTOR):
            vectors.move(memory, slot, table, at, 1.0 - pair % 2, 1.0 - pair // 2, present)
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
        memory[(rows.STATE_BEFORE + line) * STRIDE] = memory[(rows.STATE + line) * STRIDE]
        if present.tangent is not None:
            memory[(rows.TANGENT_BEFORE + line) * STRIDE] = memory[(rows.TANGENT + line) * STRIDE]
    gather(memory, 0, work, present)
    for way in range(place.ways):
        margin = 0.0
        for column in range(place.columns):
            margin += table[row + BOUNDS[way] + column] * abs(work[INPUTS + column])
        memory[(rows.MARGINS + way) * STRIDE] = margin
    at = row + HEADER
    if present.resolved is not None:
        at += pair_of(read_branches(memory, 0), present) * place.size
    scatter(memory, 0, table, at, work, present)
    return count_suspects(memory, 1, table, row, present)


@scalar
def gather(memory, slot, work, present):
    """Read what is to be multiplied with a map: state before the step, forces, tangent vector."""
    place = layout(present)
    for line in range(place.states):
        work[INPUTS + line] = memory[(rows.STATE_BEFORE + line) * STRIDE + slot]
        if present.tangent is not None:
            work[TANGENT_INPUTS + line] = memory[(rows.TANGENT_BEFORE + line) * STRIDE + slot]
    for number in range(place.columns - place.states):
        work[INPUTS + place.states + number] = memory[(rows.FORCES + number) * STRIDE + slot]


@scalar
def scatter(memory, slot, table, at, work, present):
    """Write where a map leads what was read, state and tangent vector."""
    place = layout(present)
    vectors.end_of(work, RESULT, INPUTS, table, at, present)
    for line in range(place.states):
        memory[(rows.STATE + line) * STRIDE + slot] = work[RESULT + line]
    if present.tangent is not None:
        vectors.tangent_end_of(work, RESULT, TANGENT_INPUTS, table, at, present)
        for line in range(place.states):
            memory[(rows.TANGENT + line) * STRIDE + slot] = work[RESULT + line]


@scalar
def count_suspects(memory, slots, table, row, present):
    """Mark the lanes whose gaps may have left their branches since the step began."""
    if present.resolved is None:
        return 0
    begin, end = phases_of(table, row)
    suspects = 0
    for slot in range(slots):
        lane = read_lane(memory, slot)
        branches = read_branches(memory, slot)
        before = read_state(memory, rows.STATE_BEFORE, slot, present)
        after = read_state(memory, rows.STATE, slot, present)
        gaps = gaps_at(before, lane, forcing_at(lane, begin, present), present)
        gaps_after = gaps_at(after, lane, forcing_at(lane, end, present), present)
        at = rows.MARGINS * STRIDE + slot
        margins = memory[at], memory[at + STRIDE]
        suspect = contact.step_may_leave(gaps, gaps_after, branches, margins, present)
        suspects += 1 if suspect else 0
        memory[rows.SUSPECT * STRIDE + slot] = 1.0 if suspect else 0.0
    return suspects


@scalar
def cross(memory, slot, table, row, work, number, recorded, present):
    """Take the step of one lane from crossing to crossing."""
    place = layout(present)
    lane = read_lane(memory, slot)
    branches = read_branches(memory, slot)
    gather(memory, slot, work, present)
    done = -1.0
    crossings = 0
    while True:
        at = row + HEADER + pair_of(branches, present) * place.size
        moment = leaving(0, work, done, lane, branches, table, at, present)
        axially = False
        if present.axial is not None:
            moment_z = leaving(1, work, done, lane, branches, table, at, present)
            axially = not moment <= moment_z
            moment = min(moment, moment_z)
        # Also where the lane has left the range of numbers.
        if not moment <= 1.0 or crossings == MOST_SPLITS:
            break

        crossings += 1
        done = moment
        way = 1 if axially else 0
        gap = GAPS[way]
        value, slope = vectors.value_and_slope(work, gap, moment)
        # The step is 2 long in s.
        crossed = Gap(value, 2.0 * slope)
        at_step = number + 0.5 * (1.0 + moment)
        branches, branch, following = contact.leave(
            memory, slot, axially, crossed, branches, lane, at_step, recorded, present
        )
        if present.loads is not None:
            if recorded:
                tell_kink(memory, slot, axially, lane, crossed)
        if present.tangent is not None:
            columns = at + place.gaps[way]
            vectors.tangent_gap_along(work, TANGENT_GAP, TANGENT_INPUTS, table, columns, present)
        # One of the two offsets is that of the flank, the other one 0.
        work[gap] -= branch.offset + following.offset
        sign = branch.engaged - following.engaged
        at = row + HEADER + pair_of(branches, present) * place.size
        vectors.add_switch(work, gap, moment, sign, table, at + place.switches[way], present)

    if crossings > 0:
        scatter(memory, slot, table, at, work, present)
        if moment <= 1.0:
            memory[rows.OVERFLOWS * STRIDE + slot] += 1.0
            _, end = phases_of(table, row)
            state = read_state(memory, rows.STATE, slot, present)
            gaps = gaps_at(state, lane, forcing_at(lane, end, present), present)
            branches = contact.branches_at(gaps, lane.half_backlash, present)
        write_branches(memory, slot, branches)
        store_offsets(memory, slot, lane, branches, present)


@scalar
def leaving(way, work, done, lane, branches, table, at, present):
    """Return the moment after ``done`` at which a gap leaves its branch, or `NEVER`."""
    place = layout(present)
    gap = GAPS[way]
    branch = branches[way]
    half_backlash = lane.half_backlash
    work[INPUTS + place.states + 1 + way] = offset_of(way, lane, branches, present)
    vectors.gap_along(work, gap, INPUTS, table, at + place.gaps[way], present)
    work[gap] -= mean_errors(lane, present)[way]
    if half_backlash == 0.0:
        return contact.NEVER
    bend = 0.0
    for term in range(4, 8):
        # Terms 4 to 15, in sums that do not wait for each other.
        near = fourth(work, gap, term) + fourth(work, gap, term + 4)
        bend += near + fourth(work, gap, term + 8)
    begin = vectors.value_and_slope(work, gap, done)
    end = vectors.value_and_slope(work, gap, 1.0)
    if branch.engaged != 0.0:
        side = math.copysign(1.0, branch.offset)
        return first_below((work, gap, side, -half_backlash), done, begin, end, bend)
    return min(
        first_below((work, gap, -1.0, half_backlash), done, begin, end, bend),
        first_below((work, gap, 1.0, half_backlash), done, begin, end, bend),
    )


@scalar
def fourth(work, gap, term):
    """Return how much a term of a polynomial adds to its fourth derivative, at most."""
    return term * (term - 1.0) * (term - 2.0) * (term - 3.0) * abs(work[gap + term])


@scalar
def first_below(given, left, begin, end, bend):
    """Return where a gap, as it is given to `gap_at`, first falls below zero after a moment.

    ``begin``, ``end``: value and slope at that moment and at the end of the step; ``bend``: more
    than its fourth derivative. Piece by piece: one whose Bezier points with their margins are not
    below zero has no such place, in one that only falls it is found by Newton's method, others are
    halved.
    """
    value_left, slope_left = seen(given, begin)
    # A step that begins where the last one ended at the boundary begins on the right side of it.
    value_left = max(value_left, 0.0)
    right = 1.0
    value_right, slope_right = seen(given, end)
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
                # The cubic of the place over the value, as that falls.
                fallen = value_left - value_right
                done = value_left / fallen
                early = (1.0 - done) * (-fallen / slope_left - width)
                late = done * (-fallen / slope_right - width)
                guess = left + width * done + done * (1.0 - done) * (early - late)
                guess = min(max(guess, left), right)
                return contact.falling_root(gap_at, given, left, right, guess)
            clear = steepest < -stray * 0.2
            if not clear and width < _NARROW:
                if value_right < 0.0:
                    return right
                clear = True
        if clear:
            if right >= 1.0:
                return contact.NEVER
            left = right
            value_left = max(value_right, 0.0)
            slope_left = slope_right
            right = min(1.0, left + 2.0 * width)
        else:
            right = left + 0.5 * width
        value_right, slope_right = gap_at(given, right)
    return contact.NEVER


@scalar
def gap_at(given, at):
    """Return a gap, seen from one side and raised by a distance, and its slope."""
    return seen(given, vectors.value_and_slope(given[0], given[1], at))


@scalar
def seen(given, motion):
    """Return value and slope of a gap from one side and raised by a distance."""
    _, _, side, distance = given
    return side * motion[0] + distance, side * motion[1]
