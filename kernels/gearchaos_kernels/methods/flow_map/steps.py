"""Steps of a block of lanes by flow maps.

Lanes move by the map of the branches on which they begin the step. Those whose gaps may have left
them are suspects, which `crossings` takes up.
"""

import math

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.branches import suspects_of
from gearchaos_kernels.memory.block_memory import read_branches, read_lane, state_before, state_of
from gearchaos_kernels.memory.rows import LANES, STATE, STRIDE, VECTOR, Branch, rows
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.methods.flow_map import vectors
from gearchaos_kernels.methods.flow_map.layout import layout, method_rows, waves_at
from gearchaos_kernels.models.interfaces import (
    forcing_at,
    gaps_at,
    half_clearances,
    inputs_of,
    mean_gaps,
    point_of_waves,
)


@scalar
def points_of(table, row, scene):
    """Return the mesh phase at the beginning and at the end of a step."""
    return (
        point_of_waves(waves_at(table, row, scene), scene),
        point_of_waves(waves_at(table, row + layout(scene).waves, scene), scene),
    )


@scalar
def begin_lane(memory, slot, lane, scene):
    """Store what forces a lane, in the order of columns; without clearance no flank has offsets."""
    place, first = layout(scene), method_rows(scene).inputs
    inputs = inputs_of(lane, scene)
    memory[first * STRIDE + slot] = inputs[0]
    for number in range(1, place.inputs):
        memory[(first + place.elements + number) * STRIDE + slot] = inputs[number]
    if scene.resolved is None:
        branches = each(always_engaged, half_clearances(lane, scene))
        store_offsets(memory, slot, lane, branches, scene)
    else:
        store_offsets(memory, slot, lane, read_branches(memory, slot, scene), scene)


@scalar
def always_engaged(_half_clearance):
    """Return the branch of an element without clearance."""
    return Branch(1.0, 0.0, -math.inf, math.inf)


@scalar
def store_offsets(memory, slot, lane, branches, scene):
    """Store by how much each gap exceeds the deflection on its branch."""
    means = mean_gaps(lane, scene)
    first = method_rows(scene).inputs + 1
    for element in range(layout(scene).elements):
        branch = branches[element]
        # With the mean error, which no column of a map has.
        offset = branch.offset + branch.engaged * means[element]
        memory[(first + element) * STRIDE + slot] = offset


@scalar
def maps_on(branches, row, scene):
    """Return where in their table the maps of a step on a set of branches begin."""
    number = 0
    for element in range(layout(scene).elements):
        number += 0 if branches[element].engaged != 0.0 else 1 << element
    return row + layout(scene).header + number * layout(scene).size


@scalar
def move_block(memory, table, row, slots, numbers, scene):
    """Take one step in so many slots; return how many may have left a contact branch."""
    if slots == 1:
        return move_lane(memory, table, row, numbers, scene)
    for slot in range(0, slots, VECTOR):
        vectors.keep_before(memory, slot, scene)
        vectors.bound_bends(memory, slot, table, row, scene)
        vectors.move(memory, slot, table, row, scene)
    # A constant number of slots, which the compiler vectorises.
    if slots == VECTOR:
        return count_suspects(memory, VECTOR, table, row, scene)
    return count_suspects(memory, LANES, table, row, scene)


@scalar
def move_lane(memory, table, row, numbers, scene):
    """Take one step of the only lane, along its state; bit for bit the one that vectors take."""
    place, at = layout(scene), rows(scene)
    # Number by number: a vector would have to wait for the single numbers stored before it.
    for line in range(place.states):
        memory[(at.state_before + line) * STRIDE] = memory[(STATE + line) * STRIDE]
        if scene.tangent is not None:
            memory[(at.tangent_before + line) * STRIDE] = memory[(at.tangent + line) * STRIDE]
    gather(memory, numbers, scene)
    vectors.bound_bends(memory, 0, table, row, scene)
    maps = row + place.header
    if scene.resolved is not None:
        maps = maps_on(read_branches(memory, 0, scene), row, scene)
    scatter(memory, table, maps, numbers, scene)
    return count_suspects(memory, 1, table, row, scene)


@scalar
def gather(memory, numbers, scene):
    """Read what is to be multiplied with a map: state before the step, forces, tangent vector."""
    place, at = layout(scene), rows(scene)
    for line in range(place.states):
        numbers[line] = memory[(at.state_before + line) * STRIDE]
        if scene.tangent is not None:
            numbers[place.tangent_inputs + line] = memory[(at.tangent_before + line) * STRIDE]
    for number in range(place.columns - place.states):
        row = method_rows(scene).inputs + number
        numbers[place.states + number] = memory[row * STRIDE]


@scalar
def scatter(memory, table, maps, numbers, scene):
    """Write where a map leads what was read, state and tangent vector."""
    place = layout(scene)
    vectors.end_of(numbers, place.result, 0, table, maps, scene)
    for line in range(place.states):
        memory[(STATE + line) * STRIDE] = numbers[place.result + line]
    if scene.tangent is not None:
        vectors.tangent_end_of(numbers, place.result, place.tangent_inputs, table, maps, scene)
        for line in range(place.states):
            memory[(rows(scene).tangent + line) * STRIDE] = numbers[place.result + line]


@scalar
def count_suspects(memory, slots, table, row, scene):
    """Mark the lanes whose gaps may have left their branches since the step began."""
    if scene.resolved is None:
        return 0
    suspects = 0
    for slot in range(slots):
        lane = read_lane(memory, slot, scene)
        branches = read_branches(memory, slot, scene)
        gaps, gaps_after = gaps_at_ends(memory, slot, lane, table, row, scene)
        margins = vectors.margins_of(memory, slot, scene)
        elements = suspects_of(gaps, gaps_after, branches, margins, scene)
        suspects += 1 if elements != 0.0 else 0
        memory[rows(scene).suspect * STRIDE + slot] = elements
    return suspects


@scalar
def gaps_at_ends(memory, slot, lane, table, row, scene):
    """Return the gaps of a lane at the beginning and at the end of a step."""
    begin, end = points_of(table, row, scene)
    before = state_before(memory, slot, scene)
    after = state_of(memory, slot, scene)
    gaps = gaps_at(before, lane, forcing_at(lane, begin, scene), scene)
    return gaps, gaps_at(after, lane, forcing_at(lane, end, scene), scene)
