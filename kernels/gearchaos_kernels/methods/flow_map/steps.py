"""Steps of a block of lanes by flow maps.

A lane takes a step by the map of the contact branches on which it begins. Lanes whose gaps may have
left their branches are suspects; `crossings` resolves their step.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.branches import always_engaged, suspects_of
from gearchaos_kernels.memory.block_memory import (
    read_branches,
    read_lane,
    read_varied_input,
    state_before,
    state_of,
    store,
)
from gearchaos_kernels.memory.rows import (
    STATE,
    STRIDE,
    VECTOR,
    State,
    rows,
)
from gearchaos_kernels.memory.tuples import along, each
from gearchaos_kernels.methods.flow_map import vectors
from gearchaos_kernels.methods.flow_map.layout import layout, method_rows, no_waves, waves_at
from gearchaos_kernels.methods.flow_map.sets import enter, number_of
from gearchaos_kernels.models.interfaces import (
    forcing_at,
    gaps_at,
    half_clearances,
    inputs_of,
    mean_gaps,
    observed_at,
    point_of_waves,
)


@scalar
def points_of(maps, maps_at, scene):
    """Return the mesh phase at the beginning and at the end of a step."""
    return (
        point_of_waves(waves_at(maps, maps_at, scene), scene),
        point_of_waves(waves_at(maps, maps_at + layout(scene).waves, scene), scene),
    )


@scalar
def begin_lane(memory, slot, index, lane, given, scene):
    """Store the inputs of a lane and the offsets of its branches, in the order of map columns."""
    place, first = layout(scene), method_rows(scene).inputs
    inputs = inputs_of(lane, scene)
    memory[first * STRIDE + slot] = inputs[0]
    for number in range(1, place.inputs):
        memory[(first + place.elements + number) * STRIDE + slot] = inputs[number]
    if scene.traced is not None:
        store_means(memory, slot, lane, scene)
    if scene.resolved is None:
        branches = each(always_engaged, half_clearances(lane, scene))
        store_offsets(memory, slot, lane, branches, scene)
    else:
        store_offsets(memory, slot, lane, read_branches(memory, slot, scene), scene)
        if scene.stops is not None:
            enter(memory, slot, given, scene)


@scalar
def change_input(memory, slot, lane, scene):
    """Store the steady input of a lane, the first of its inputs, and what follows from it."""
    memory[method_rows(scene).inputs * STRIDE + slot] = inputs_of(lane, scene)[0]
    if scene.traced is not None:
        store_means(memory, slot, lane, scene)


@scalar
def store_means(memory, slot, lane, scene):
    """Store the constant part of each signal; forces have none."""
    state, first = state_of(memory, slot, scene), method_rows(scene).means
    nothing = State(
        along(state.position, -1.0, state.position), along(state.rate, -1.0, state.rate)
    )
    for element in range(layout(scene).elements):
        memory[(first + element) * STRIDE + slot] = 0.0
    constant = observed_at(nothing, lane, point_of_waves(no_waves(scene), scene), scene)
    store(memory, first + layout(scene).elements, slot, constant)


@scalar
def store_offsets(memory, slot, lane, branches, scene):
    """Store by how much each gap exceeds the deflection of its element on these branches."""
    means = mean_gaps(lane, scene)
    first = method_rows(scene).inputs + 1
    for element in range(layout(scene).elements):
        branch = branches[element]
        # Includes the constant part of the gap, which has no column in the maps.
        offset = branch.offset + branch.engaged * means[element]
        memory[(first + element) * STRIDE + slot] = offset


@scalar
def maps_on(memory, slot, maps_at, scene):
    """Return where the maps for the branches of a lane begin, among the maps of a step."""
    if scene.stops is not None:
        offset = int(memory[method_rows(scene).maps * STRIDE + slot])
    else:
        offset = number_of(read_branches(memory, slot, scene), scene) * layout(scene).size
    return maps_at + layout(scene).header + offset


@scalar
def move_block(memory, maps, maps_at, slots, numbers, scene):
    """Take one step in n slots; return how many lanes may have left a contact branch."""
    if slots == 1:
        return move_lane(memory, maps, maps_at, numbers, scene)
    for slot in range(0, slots, VECTOR):
        vectors.keep_before(memory, slot, scene)
        vectors.bound_bends(memory, slot, maps, maps_at, scene)
        vectors.move(memory, slot, maps, maps_at, scene)
    return count_suspects(memory, slots, maps, maps_at, scene)


@scalar
def move_lane(memory, maps, maps_at, numbers, scene):
    """Take one step of the only lane, vectorised along its state.

    The result is bit for bit that of a vector of lanes.
    """
    place, at = layout(scene), rows(scene)
    # Number by number: a vector load would have to wait for the single stores before it.
    for line in range(place.states):
        memory[(at.state_before + line) * STRIDE] = memory[(STATE + line) * STRIDE]
        if scene.tangent is not None:
            memory[(at.tangent_before + line) * STRIDE] = memory[(at.tangent + line) * STRIDE]
    gather(memory, numbers, scene)
    vectors.bound_bends(memory, 0, maps, maps_at, scene)
    branch_maps_at = maps_at + place.header
    if scene.resolved is not None:
        branch_maps_at = maps_on(memory, 0, maps_at, scene)
    scatter(memory, maps, branch_maps_at, numbers, scene)
    return count_suspects(memory, 1, maps, maps_at, scene)


@scalar
def gather(memory, numbers, scene):
    """Collect the factors of a map: state before the step, inputs and offsets, tangent vector."""
    place, at = layout(scene), rows(scene)
    for line in range(place.states):
        numbers[line] = memory[(at.state_before + line) * STRIDE]
        if scene.tangent is not None:
            numbers[place.tangent_inputs + line] = memory[(at.tangent_before + line) * STRIDE]
    if scene.control is not None:
        numbers[place.tangent_inputs + place.states] = read_varied_input(memory, 0, scene)
    for number in range(place.columns - place.states):
        row = method_rows(scene).inputs + number
        numbers[place.states + number] = memory[row * STRIDE]


@scalar
def scatter(memory, maps, branch_maps_at, numbers, scene):
    """Apply a map to the collected factors, and store state and tangent vector."""
    place = layout(scene)
    vectors.end_of(numbers, place.result, 0, maps, branch_maps_at, scene)
    for line in range(place.states):
        memory[(STATE + line) * STRIDE] = numbers[place.result + line]
    if scene.tangent is not None:
        vectors.tangent_end_of(
            numbers, place.result, place.tangent_inputs, maps, branch_maps_at, scene
        )
        for line in range(place.states):
            memory[(rows(scene).tangent + line) * STRIDE] = numbers[place.result + line]


@scalar
def count_suspects(memory, slots, maps, maps_at, scene):
    """Mark the lanes whose gaps may have left their branches in the step; return their number."""
    if scene.resolved is None:
        return 0
    suspects = 0
    for slot in range(slots):
        lane = read_lane(memory, slot, scene)
        branches = read_branches(memory, slot, scene)
        gaps, gaps_after = gaps_at_ends(memory, slot, lane, maps, maps_at, scene)
        margins = vectors.margins_of(memory, slot, scene)
        elements = suspects_of(gaps, gaps_after, branches, margins, scene)
        suspects += 1 if elements != 0.0 else 0
        memory[rows(scene).suspect * STRIDE + slot] = elements
    return suspects


@scalar
def gaps_at_ends(memory, slot, lane, maps, maps_at, scene):
    """Return the gaps of a lane at the beginning and at the end of a step."""
    begin, end = points_of(maps, maps_at, scene)
    before = state_before(memory, slot, scene)
    after = state_of(memory, slot, scene)
    gaps = gaps_at(before, lane, forcing_at(lane, begin, scene), scene)
    return gaps, gaps_at(after, lane, forcing_at(lane, end, scene), scene)
