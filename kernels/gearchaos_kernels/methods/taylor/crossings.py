"""Where a piece of a motion ends because a gap leaves its branch, and how the next one begins."""

from gearchaos_kernels.compilation import part, scalar
from gearchaos_kernels.contact.branches import (
    MOST_CROSSINGS,
    Moment,
    branches_at,
    leave,
    suspects_of,
)
from gearchaos_kernels.contact.elements import jumped
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.contact.leaving import LAST_CORRECTION, NEVER
from gearchaos_kernels.contact.searching import first_below
from gearchaos_kernels.memory.block_memory import (
    load,
    load_like,
    read_branches,
    read_lane,
    read_state,
    state_of,
    write_branches,
    write_state,
)
from gearchaos_kernels.memory.rows import STRIDE, VECTOR, rows
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.methods.taylor.layout import TERMS, End, no_waves, series_rows
from gearchaos_kernels.models.interfaces import gaps_at, half_clearances, part_of_forcing
from gearchaos_kernels.models.protocol import Gap
from gearchaos_kernels.recorders.loads import numbered

_STRAY = 1.0 / 288.0
"""A gap's cubic is off its lowest Bezier point by this share of its fourth derivative at most."""


GIVEN_UP = -2.0
"""Marks a lane that has crossed too often to resolve its crossings; see `MOST_CROSSINGS`."""


@scalar
def count_suspects(memory, first, lanes, scene):
    """Mark the gaps that may leave their branches in a piece; return the number of lanes."""
    at, suspects = series_rows(scene), 0
    for slot in range(first, first + VECTOR):
        lane = read_lane(memory, slot, scene)
        branches = read_branches(memory, slot, scene)
        numbers = numbered(half_clearances(lane, scene))
        begins = each(gap_at_begin, memory, slot, numbers, at)
        ends = each(gap_at_end, memory, slot, numbers, at)
        margins = each(margin_of, memory, slot, numbers, at)
        elements = suspects_of(begins, ends, branches, margins, scene)
        memory[rows(scene).suspect * STRIDE + slot] = elements
        suspects += 1 if (elements != 0.0) & (slot < lanes) else 0
    return suspects


@scalar
def gap_at_begin(memory, slot, element, at):
    """Return the gap of an element at the beginning of a piece, with its rate per piece."""
    value = memory[(at.gaps + element) * STRIDE + slot]
    slope = memory[(at.gaps + at.elements + element) * STRIDE + slot]
    rate = slope * memory[at.length * STRIDE + slot]
    return Gap(value, rate, rate)


@scalar
def gap_at_end(memory, slot, element, at):
    """Return the gap of an element at the end of a piece, with its rate per piece."""
    end = load(memory, at.ends + 3 * element, slot, End)
    return Gap(end.value, end.slope, end.slope)


@scalar
def margin_of(memory, slot, element, at):
    """Return by how much the gap of an element may deviate from its cubic in a piece."""
    return _STRAY * load(memory, at.ends + 3 * element, slot, End).bend


@scalar
def find_crossings(memory, first, lanes, scene):
    """End the pieces of the lanes of a vector where a gap first leaves its branch."""
    for slot in range(first, min(first + VECTOR, lanes)):
        if memory[rows(scene).suspect * STRIDE + slot] != 0.0:
            find_crossing(memory, slot, scene)


@part
def find_crossing(memory, slot, scene):
    """End the piece of a lane where a gap first leaves its branch, if one does."""
    at, lane = series_rows(scene), read_lane(memory, slot, scene)
    suspects = int(memory[rows(scene).suspect * STRIDE + slot])
    if memory[at.crossings * STRIDE + slot] >= MOST_CROSSINGS:
        # The lane continues on its branches to the end of this piece.
        memory[at.crossing * STRIDE + slot] = GIVEN_UP
        return
    earliest, element = NEVER, -1
    branches, clearances = read_branches(memory, slot, scene), half_clearances(lane, scene)
    for number in range(at.elements):
        if (suspects >> number) & 1 == 1:
            kind = kinds(scene)[number]
            moment = leaving(memory, slot, number, branches, clearances, kind.one_sided, at)
            element = number if moment < earliest else element
            earliest = min(moment, earliest)
    if earliest <= 1.0:
        memory[at.length * STRIDE + slot] *= earliest
        memory[at.crossing * STRIDE + slot] = element


@part
def leaving(memory, slot, number, branches, clearances, one_sided, at):
    """Return the share of a piece after which the gap of an element leaves its branch."""
    branch, clearance = branches[number], clearances[number]
    end = load(memory, at.ends + 3 * number, slot, End)
    length = memory[at.length * STRIDE + slot]
    series = memory, (at.gaps + number) * STRIDE + slot, at.elements * STRIDE, length
    if branch.engaged != 0.0:
        side = 1.0 if one_sided or branch.offset > 0.0 else -1.0
        return fall_of((series, side, -clearance), end.bend)
    moment = fall_of((series, -1.0, clearance), end.bend)
    return moment if one_sided else min(moment, fall_of((series, 1.0, clearance), end.bend))


@part
def fall_of(given, bend):
    """Return the share of a piece after which side * gap + distance falls below zero."""
    moment = first_below(gap_along, given, bend, 0.0, 1.0)
    if moment > 1.0:
        return moment
    # A piece is long, and the force of a damper may jump: the moment has to be exact to rounding.
    value, slope = gap_along(given, moment)
    correction = value / slope
    exact = abs(correction) < LAST_CORRECTION and 0.0 <= moment - correction <= 1.0
    return moment - correction if exact else moment


@scalar
def gap_along(given, at):
    """Return side * gap + distance at a share of a piece, and its slope."""
    (memory, first, distance_of_terms, length), side, distance = given
    time, value, slope = at * length, 0.0, 0.0
    for term in range(TERMS - 1, -1, -1):
        slope = slope * time + value
        value = value * time + memory[first + term * distance_of_terms]
    return side * value + distance, side * slope * length


@part
def cross(memory, slot, at_step, scene):
    """Put a lane on its branches after a piece that ended at a crossing, and record it."""
    at = series_rows(scene)
    lane = read_lane(memory, slot, scene)
    point = load_like(memory, at.waves, slot, no_waves(scene))
    forcing = part_of_forcing(lane, 1.0, point, scene)
    gaps = gaps_at(state_of(memory, slot, scene), lane, forcing, scene)
    if memory[at.crossing * STRIDE + slot] == GIVEN_UP:
        write_branches(memory, slot, branches_at(gaps, lane, scene), scene)
        memory[(rows(scene).crossings + 2) * STRIDE + slot] += 1.0
        memory[at.crossings * STRIDE + slot] = 0.0
        return
    element = int(memory[at.crossing * STRIDE + slot])
    memory[at.crossings * STRIDE + slot] += 1.0
    branches = read_branches(memory, slot, scene)
    moment = Moment(at_step.number + memory[at.done * STRIDE + slot], at_step.recorded)
    leave(memory, slot, element, gaps[element], branches, lane, moment, scene)
    if scene.jumps is not None:
        if scene.tangent is not None:
            following = read_branches(memory, slot, scene)
            tangent = read_state(memory, rows(scene).tangent, slot, scene)
            tangent = jumped(tangent, element, gaps, branches, following, lane, scene)
            write_state(memory, rows(scene).tangent, slot, tangent, scene)
