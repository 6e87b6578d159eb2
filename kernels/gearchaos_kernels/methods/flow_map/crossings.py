"""Crossings of clearance boundaries within a step by flow maps.

A gap leaves its branch a at the moment s. The motion after it is identical to a motion on the next
branch b that began the step at another state:

    x_b = x - int_{-1}^{s} [force on b - force on a, along a] K(r) Phi_b(r -> -1) u / 2 dr.

The same procedure then repeats with x_b: compute its gaps, find the next crossing after s, and
compute the end of the step by the map of b. The tangent vector is transferred in the same way, at
the moments of the motion. The field is continuous, so a crossing adds no further term.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.branches import (
    MOST_CROSSINGS,
    Moment,
    branches_at,
    leave,
    next_branch_of,
)
from gearchaos_kernels.contact.leaving import NEVER, may_leave
from gearchaos_kernels.memory.block_memory import read_branches, read_lane, store, write_branches
from gearchaos_kernels.memory.rows import BRANCH, STATE, STRIDE, VECTOR, ContactBranch, rows
from gearchaos_kernels.methods.flow_map import vectors
from gearchaos_kernels.methods.flow_map.layout import LastCrossing, aside_rows, layout, method_rows
from gearchaos_kernels.methods.flow_map.moments import find_moments
from gearchaos_kernels.methods.flow_map.sets import KNOWN, enter, find_maps, report
from gearchaos_kernels.methods.flow_map.steps import gaps_at_ends, store_offsets
from gearchaos_kernels.methods.flow_map.tracing import accumulated_rows, trace_piece
from gearchaos_kernels.models.protocol import Gap


@scalar
def resolve(memory, lanes, at, given, scene):
    """Repeat the step of the lanes that may have left a branch, eight at a time."""
    slots = given.work.slots
    suspects = 0
    for slot in range(lanes):
        slots[suspects] = slot
        suspects += 1 if memory[rows(scene).suspect * STRIDE + slot] != 0.0 else 0
    for first in range(0, suspects, VECTOR):
        some = slots[first : min(first + VECTOR, suspects)]
        cross_together(memory, some, at, given, scene)


@scalar
def cross_together(memory, slots, at, given, scene):
    """Repeat the step of up to eight lanes from crossing to crossing, in memory aside."""
    place, lanes, aside = layout(scene), slots.shape[0], given.work.aside
    maps, maps_at = given.maps, at.maps_at
    for n in range(lanes):
        vectors.copy_lane(memory, slots[n], aside, n, scene)
        aside[aside_rows(scene).after * STRIDE + n] = -1.0
    if scene.stops is not None:
        share_maps(aside, lanes, scene)
    crossings, left = 0, lanes
    while left > 0 and crossings < MOST_CROSSINGS:
        crossings += 1
        vectors.compute_gaps(aside, 0, maps, maps_at, scene)
        for element in range(place.elements):
            find_moments(aside, element, lanes, scene)
        if scene.traced is not None:
            if at.recorded:
                trace_to_crossing(aside, maps, maps_at, scene)
        cross_over(aside, scene)
        if scene.stops is not None:
            find_maps_of(aside, slots, given, scene)
        for n in range(lanes):
            record_crossing_of(memory, slots[n], aside, n, at, scene)
        vectors.sum_along(aside, scene)
        vectors.add_switch(aside, 0, maps, maps_at, scene)
        vectors.bound_bends(aside, 0, maps, maps_at, scene)
        vectors.move(aside, 0, maps, maps_at, scene)
        left = count_left(aside, lanes, maps, maps_at, scene)
    if scene.traced is not None:
        if at.recorded:
            trace_to_end(memory, slots, aside, maps, maps_at, scene)
    for n in range(lanes):
        copy_rows(aside, n, memory, slots[n], STATE, place.states)
        if scene.tangent is not None:
            copy_rows(aside, n, memory, slots[n], rows(scene).tangent, place.states)
        if aside[rows(scene).suspect * STRIDE + n] != 0.0:
            give_up(memory, slots[n], maps, maps_at, scene)
        if scene.stops is not None:
            enter(memory, slots[n], given, scene)


@scalar
def find_maps_of(aside, slots, given, scene):
    """Find the maps of the branches of up to eight lanes aside; report the sets that lack them."""
    for n in range(slots.shape[0]):
        number = find_maps(aside, n, given, scene)
        if number != KNOWN:
            report(slots[n], number, given)
    share_maps(aside, slots.shape[0], scene)


@scalar
def share_maps(aside, lanes, scene):
    """Let slots without a lane take the maps of the first lane, so that they take no time."""
    first = method_rows(scene).maps * STRIDE
    for n in range(lanes, VECTOR):
        aside[first + n] = aside[first]


@scalar
def trace_to_crossing(aside, maps, maps_at, scene):
    """Accumulate the signals of eight lanes from the last crossing of each to the next one."""
    place, at_rows, first = layout(scene), aside_rows(scene), method_rows(scene).piece
    crosses = False
    for n in range(VECTOR):
        after, moment = aside[at_rows.after * STRIDE + n], NEVER
        for element in range(place.elements):
            row = at_rows.gaps + element * at_rows.gap_rows + at_rows.moment
            moment = min(moment, aside[row * STRIDE + n])
        aside[first * STRIDE + n] = after
        aside[(first + 1) * STRIDE + n] = moment if moment <= 1.0 else after
        crosses |= moment <= 1.0
    if crosses:
        trace_piece(aside, 0, maps, maps_at, scene)


@scalar
def trace_to_end(memory, slots, aside, maps, maps_at, scene):
    """Accumulate the signals from the last crossing to the end of the step; store all of them."""
    first, accumulated = method_rows(scene).piece, accumulated_rows(scene)
    for n in range(VECTOR):
        aside[first * STRIDE + n] = aside[aside_rows(scene).after * STRIDE + n]
        aside[(first + 1) * STRIDE + n] = 1.0
    trace_piece(aside, 0, maps, maps_at, scene)
    for n in range(slots.shape[0]):
        copy_rows(aside, n, memory, slots[n], accumulated.first, accumulated.size)


@scalar
def copy_rows(memory, slot, other, place, first, count):
    """Copy consecutive rows of a slot to a slot of another memory; ``place``: the latter."""
    for row in range(first, first + count):
        other[row * STRIDE + place] = memory[row * STRIDE + slot]


@scalar
def cross_over(aside, scene):
    """Choose the next crossing of eight lanes, and put them on the branches after it."""
    place, at_rows = layout(scene), aside_rows(scene)
    for n in range(VECTOR):
        lane = read_lane(aside, n, scene)
        moment, first = aside[(at_rows.gaps + at_rows.moment) * STRIDE + n], 0.0
        for element in range(1, place.elements):
            other = aside[(at_rows.gaps + element * at_rows.gap_rows + at_rows.moment) * STRIDE + n]
            first = first if moment <= other else float(element)
            moment = min(moment, other)
        # False as well if the moment is not a number.
        crosses = moment <= 1.0
        factor, edge = 0.0, 0.0
        for element in range(place.elements):
            branch = read_branches(aside, n, scene)[element]
            gap = crossed_at(aside, n, element, scene)
            following = next_branch_of(branch, gap.value, element, lane, scene)
            here = crosses & (first == element)
            factor = branch.engaged - following.engaged if here else factor
            # One of the two offsets is that of the flank, the other is 0.
            edge = branch.offset + following.offset if here else edge
            after = ContactBranch(
                following.engaged if here else branch.engaged,
                following.offset if here else branch.offset,
                following.floor if here else branch.floor,
                following.ceiling if here else branch.ceiling,
            )
            store(aside, rows(scene).branches + BRANCH * element, n, after)
        store_offsets(aside, n, lane, read_branches(aside, n, scene), scene)
        moment = moment if crosses else aside[at_rows.after * STRIDE + n]
        store(aside, at_rows.after, n, LastCrossing(moment, factor, edge, first))


@scalar
def record_crossing_of(memory, slot, aside, n, at, scene):
    """Put a lane on the branch after its crossing, if it has one, and record the crossing."""
    at_rows = aside_rows(scene)
    if aside[at_rows.factor * STRIDE + n] == 0.0:
        return
    element = int(aside[at_rows.element * STRIDE + n])
    lane = read_lane(memory, slot, scene)
    steps = at.number + 0.5 * (1.0 + aside[at_rows.after * STRIDE + n])
    moment = Moment(steps, at.recorded)
    crossed = crossed_at(aside, n, element, scene)
    branches = read_branches(memory, slot, scene)
    leave(memory, slot, element, crossed, branches, lane, moment, scene)
    store_offsets(memory, slot, lane, read_branches(memory, slot, scene), scene)


@scalar
def crossed_at(aside, n, element, scene):
    """Return a gap at its crossing, with its rate per step."""
    at_rows = aside_rows(scene)
    first = (at_rows.gaps + element * at_rows.gap_rows + at_rows.crossed) * STRIDE + n
    # Slopes are by s, and a step has length 2 in s.
    rate = 2.0 * aside[first + STRIDE]
    return Gap(aside[first], rate, rate)


@scalar
def count_left(aside, lanes, maps, maps_at, scene):
    """Mark the gaps that may cross again in the rest of the step; return the number of lanes."""
    place, at_rows = layout(scene), aside_rows(scene)
    left = 0
    for n in range(VECTOR):
        lane = read_lane(aside, n, scene)
        branches = read_branches(aside, n, scene)
        gaps, gaps_after = gaps_at_ends(aside, n, lane, maps, maps_at, scene)
        elements = 0.0
        for element in range(place.elements):
            crosses = aside[at_rows.element * STRIDE + n] == element if place.elements > 1 else True
            crossed = crossed_at(aside, n, element, scene)
            # For the gap that has crossed, only the rest of the step counts.
            rest = 0.5 * (1.0 - aside[at_rows.after * STRIDE + n]) if crosses else 1.0
            value = crossed.value if crosses else gaps[element].value
            rate = rest * crossed.rate if crosses else gaps[element].rate
            first = Gap(value, rate, rate)
            rate = rest * gaps_after[element].rate
            last = Gap(gaps_after[element].value, rate, rate)
            margin = aside[(method_rows(scene).margins + element) * STRIDE + n] * rest**4
            leaves = may_leave(first, last, branches[element], margin)
            elements += float(1 << element) if leaves else 0.0
        elements = elements if aside[at_rows.factor * STRIDE + n] != 0.0 else 0.0
        aside[rows(scene).suspect * STRIDE + n] = elements
        left += 1 if (elements != 0.0) & (n < lanes) else 0
    return left


@scalar
def give_up(memory, slot, maps, maps_at, scene):
    """Continue from the end of a step with more than `MOST_CROSSINGS`, and count the step."""
    lane = read_lane(memory, slot, scene)
    _, gaps = gaps_at_ends(memory, slot, lane, maps, maps_at, scene)
    branches = branches_at(gaps, lane, scene)
    write_branches(memory, slot, branches, scene)
    store_offsets(memory, slot, lane, branches, scene)
    memory[(rows(scene).crossings + 2) * STRIDE + slot] += 1.0
