"""Steps of a block of lanes by the maps of `flow_map`.

Lanes move by the map of the branches on which they begin the step. Those whose gaps may have left
them are suspects, and go on to `flow_crossings`.
"""

import math

from gearchaos_kernels import contact, rows
from gearchaos_kernels import flow_vectors as vectors
from gearchaos_kernels.block_memory import read_branches, read_lane, read_state
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.equations import gaps_at
from gearchaos_kernels.flow_layout import HEADER, INPUTS, RESULT, TANGENT_INPUTS, layout
from gearchaos_kernels.flow_vectors import VECTOR
from gearchaos_kernels.forcing import Phase, forcing_at
from gearchaos_kernels.rows import LANES, STRIDE, Branch, Directions

ALWAYS = Branch(1.0, 0.0, -math.inf, math.inf)
"""The branch of a mesh without clearance."""


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
    branches = Directions(ALWAYS, ALWAYS)
    if present.resolved is not None:
        branches = read_branches(memory, slot)
    store_offsets(memory, slot, lane, branches, present)


@scalar
def store_offsets(memory, slot, lane, branches, present):
    """Store by how much each gap exceeds the deflection on its branch."""
    for way in range(layout(present).ways):
        branch = branches[way]
        # With the mean error, which no column of a map has.
        offset = branch.offset + branch.engaged * mean_errors(lane, present)[way]
        memory[(rows.FORCES + 1 + way) * STRIDE + slot] = offset


@scalar
def mean_errors(lane, present):
    """Return what the mean pitch error takes from the gaps."""
    if present.pitch_error is None:
        return 0.0, 0.0
    return lane.error_mean, lane.axial_error_mean - lane.error_mean


@scalar
def maps_on(branches, row, present):
    """Return where in their table the maps of a step on a pair of branches begin."""
    pair = 0 if branches.tangential.engaged != 0.0 else 1
    if present.axial is not None:
        pair += 0 if branches.axial.engaged != 0.0 else 2
    return row + HEADER + pair * layout(present).size


@scalar
def move_block(memory, table, row, slots, numbers, present):
    """Take one step in so many slots; return how many may have left a contact branch."""
    if slots == 1:
        return move_lane(memory, table, row, numbers, present)
    for slot in range(0, slots, VECTOR):
        vectors.keep_before(memory, slot, present)
        vectors.bound_bends(memory, slot, table, row, present)
        vectors.move(memory, slot, table, row, present)
    # A known number of slots is what the compiler makes vector instructions of.
    if slots == VECTOR:
        return count_suspects(memory, VECTOR, table, row, present)
    return count_suspects(memory, LANES, table, row, present)


@scalar
def move_lane(memory, table, row, numbers, present):
    """Take one step of the only lane, along its state; bit for bit the one that vectors take."""
    place = layout(present)
    # Number by number: a vector would have to wait for the single numbers stored before it.
    for line in range(place.states):
        memory[(rows.STATE_BEFORE + line) * STRIDE] = memory[(rows.STATE + line) * STRIDE]
        if present.tangent is not None:
            memory[(rows.TANGENT_BEFORE + line) * STRIDE] = memory[(rows.TANGENT + line) * STRIDE]
    gather(memory, numbers, present)
    vectors.bound_bends(memory, 0, table, row, present)
    at = row + HEADER
    if present.resolved is not None:
        at = maps_on(read_branches(memory, 0), row, present)
    scatter(memory, table, at, numbers, present)
    return count_suspects(memory, 1, table, row, present)


@scalar
def gather(memory, numbers, present):
    """Read what is to be multiplied with a map: state before the step, forces, tangent vector."""
    place = layout(present)
    for line in range(place.states):
        numbers[INPUTS + line] = memory[(rows.STATE_BEFORE + line) * STRIDE]
        if present.tangent is not None:
            numbers[TANGENT_INPUTS + line] = memory[(rows.TANGENT_BEFORE + line) * STRIDE]
    for number in range(place.columns - place.states):
        numbers[INPUTS + place.states + number] = memory[(rows.FORCES + number) * STRIDE]


@scalar
def scatter(memory, table, at, numbers, present):
    """Write where a map leads what was read, state and tangent vector."""
    place = layout(present)
    vectors.end_of(numbers, RESULT, INPUTS, table, at, present)
    for line in range(place.states):
        memory[(rows.STATE + line) * STRIDE] = numbers[RESULT + line]
    if present.tangent is not None:
        vectors.tangent_end_of(numbers, RESULT, TANGENT_INPUTS, table, at, present)
        for line in range(place.states):
            memory[(rows.TANGENT + line) * STRIDE] = numbers[RESULT + line]


@scalar
def count_suspects(memory, slots, table, row, present):
    """Mark the lanes whose gaps may have left their branches since the step began."""
    if present.resolved is None:
        return 0
    suspects = 0
    for slot in range(slots):
        lane = read_lane(memory, slot)
        branches = read_branches(memory, slot)
        gaps, gaps_after = gaps_at_ends(memory, slot, lane, table, row, present)
        at = rows.MARGINS * STRIDE + slot
        margins = memory[at], memory[at + STRIDE]
        ways = contact.ways_that_may_leave(gaps, gaps_after, branches, margins, present)
        suspects += 1 if ways != 0.0 else 0
        memory[rows.SUSPECT * STRIDE + slot] = ways
    return suspects


@scalar
def gaps_at_ends(memory, slot, lane, table, row, present):
    """Return both gaps of a lane at the beginning and at the end of a step."""
    begin, end = phases_of(table, row)
    before = read_state(memory, rows.STATE_BEFORE, slot, present)
    after = read_state(memory, rows.STATE, slot, present)
    gaps = gaps_at(before, lane, forcing_at(lane, begin, present), present)
    return gaps, gaps_at(after, lane, forcing_at(lane, end, present), present)
