"""One block of lanes through all its mesh periods, on one thread.

A method takes one step in every slot, and says how many lanes may have left a contact branch; those
are looked at again. The loop over slots in `step_block` has a whole Runge-Kutta step in plain
local numbers as its body: this is what the compiler turns into vector instructions. `flow_steps`
takes the other kind. What is done once per mesh period (section, check for divergence) stands
outside, and so does scaling the tangent vectors.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels import rk4, rows
from gearchaos_kernels.block_memory import (
    aligned_memory,
    fill,
    fill_lane,
    load,
    read_branches,
    read_lane,
    read_state,
    store,
    take,
    write_branches,
    write_state,
)
from gearchaos_kernels.chosen import begin_chosen, end_chosen, half_of, tell_chosen
from gearchaos_kernels.compilation import align_stack, part, scalar
from gearchaos_kernels.contact import branches_at, end_contact, ways_that_may_leave
from gearchaos_kernels.equations import from_error, from_rest, gaps_at
from gearchaos_kernels.flow_crossings import cross
from gearchaos_kernels.flow_layout import ASIDE, OWN, Work, layout
from gearchaos_kernels.flow_steps import begin_forces, move_block
from gearchaos_kernels.flow_vectors import VECTOR
from gearchaos_kernels.forcing import Phase, forcing_at, phase_within
from gearchaos_kernels.loads import begin_loads, tell_loads
from gearchaos_kernels.rows import ANYWHERE, LANES, STRIDE
from gearchaos_kernels.splitting import split_step
from gearchaos_kernels.system import Status
from gearchaos_kernels.teeth import engage, on_grid, point_on_grid, with_teeth

LARGEST_STATE = 1e100
"""A state beyond this has left every length scale: the lane is stopped as diverged."""

LOST = 1e-150
"""A part of a tangent vector of length 1 that is smaller is 0: its square is hardly a number."""

_OK = int(Status.OK)
_DIVERGED = int(Status.DIVERGED)


class Batch(NamedTuple):
    """What the blocks read, lanes first; see `coefficients`, and `forcing` for the table.

    ``coefficients`` (lanes, fields of `Lane`), ``scales``, ``start`` and ``tangent_start`` (lanes,
    states), ``steps_between_scalings`` (lanes,). ``blocks`` (blocks, 4): place of the first lane of
    each in ``order`` (lanes,), number of lanes, steps per period and where its maps begin in
    ``maps``, which only a method that has maps looks at. ``table``: see `phase_table`; ``shares``:
    `share_table`; ``driving``, ``driven``, ``profile``: see `Teeth`. ``chosen`` (rows,): of states
    and the transmission error; ``turns`` (lanes, orders, 2): cosine and sine of the phase by
    which an order advances in a step.
    """

    coefficients: NDArray[np.float64]
    scales: NDArray[np.float64]
    start: NDArray[np.float64]
    tangent_start: NDArray[np.float64]
    steps_between_scalings: NDArray[np.intp]
    order: NDArray[np.intp]
    blocks: NDArray[np.intp]
    maps: NDArray[np.float64]
    chosen: NDArray[np.intp]
    turns: NDArray[np.float64]
    table: NDArray[np.float64]
    shares: NDArray[np.float64]
    driving: NDArray[np.float64]
    driven: NDArray[np.float64]
    profile: NDArray[np.intp]


@part
def integrate_block(number_of_block, batch, plan, outcome, present):
    """Integrate the lanes of a block, and write what comes of them."""
    align_stack()
    first, lanes, steps, maps_at = batch.blocks[number_of_block]
    memory = aligned_memory(2 * half_of(batch))
    table = batch.table
    shares = batch.shares
    maps = batch.maps
    # A few lanes need no more than one vector, and one lane with maps of its own not even that.
    slots = 1 if lanes == 1 else VECTOR if lanes <= VECTOR else LANES
    aside = memory
    if present.flow_map is not None:
        aside = aligned_memory(ASIDE)
        for number in range(aside.shape[0]):
            aside[number] = 0.0
    work = Work(aside, np.zeros(LANES, dtype=np.uint32), np.zeros(OWN))
    every = steps // plan.steps_per_period
    turns = batch.turns[batch.order[first]]
    turn(memory, first, lanes, batch, plan.first_period, present)
    interval = begin(memory, first, lanes, batch, present)
    periods = plan.transient_periods + plan.recorded_periods
    for period in range(periods):
        if present.loads is not None:
            if period == plan.transient_periods:
                begin_loads(memory, table, shares, present)
                begin_chosen(memory, batch)
        for number in range(steps):
            if period >= periods - plan.history_periods and number % every == 0:
                sample = (period - periods + plan.history_periods) * plan.steps_per_period
                keep_state(memory, first, lanes, batch, outcome.history, sample + number // every)
            row = maps_at + number * layout(present).step_size
            if present.flow_map is None:
                # Not in the loop over slots: nobody tells the compiler that its stores spare it.
                start = on_grid(table, shares, 2 * number, present)
                middle = on_grid(table, shares, 2 * number + 1, present)
                final = on_grid(table, shares, 2 * number + 2, present)
                suspects = step_block(memory, start, middle, final, present)
            else:
                suspects = move_block(memory, maps, row, slots, work.numbers, present)
            if present.resolved is not None:
                if suspects > 0:
                    recorded = period >= plan.transient_periods
                    if present.flow_map is None:
                        split(memory, lanes, table, shares, number, recorded, present)
                    else:
                        cross(memory, lanes, maps, row, work, number, recorded, present)
            if present.loads is not None:
                if period >= plan.transient_periods:
                    if present.flow_map is not None:
                        asked, of_it = number // every, number % every
                        middle = phase_within(table, asked, (of_it + 0.5) / every), None
                        start = middle  # Errors of teeth alone need it, and have no maps.
                        final = phase_within(table, asked, (of_it + 1.0) / every), None
                    tell_loads(memory, start, middle, final, present)
                    tell_chosen(memory, batch, turns)
            if present.tangent is not None:
                last = number == steps - 1
                if (number + 1) % interval == 0 or last:
                    scale_tangents(memory, first, lanes, batch, number + 1, last)
        end_period(memory, first, lanes, batch, period, steps, plan, outcome, present)
        turn(memory, first, lanes, batch, plan.first_period + period + 1, present)
    end(memory, first, lanes, batch, steps, plan, outcome, present)


@scalar
def turn(memory, first, lanes, batch, period, present):
    """Bring the tooth pairs of a mesh period into mesh."""
    if present.teeth is not None:
        for slot in range(LANES):
            profile = batch.profile[batch.order[first + min(slot, lanes - 1)]]
            engage(memory, slot, batch.driving[profile], batch.driven[profile], period)


@scalar
def begin(memory, first, lanes, batch, present):
    """Fill the memory of a block; return the shortest interval between scalings of a tangent."""
    # A scaling interval belongs to a lane, whatever its neighbours need.
    interval = batch.steps_between_scalings[batch.order[first]]
    for slot in range(LANES):
        # A block that is not full repeats the last lane, and nothing of that is stored.
        index = batch.order[first + min(slot, lanes - 1)]
        interval = min(interval, batch.steps_between_scalings[index])
        lane = fill_lane(memory, slot, batch.coefficients[index])
        fill(memory, rows.STATE, slot, batch.scales[index], batch.start[index])
        # Of a lone lane's neighbours nobody writes this, and what is no proper number takes long.
        fill(memory, rows.STATE_BEFORE, slot, batch.scales[index], batch.start[index])
        fill(memory, rows.TANGENT, slot, batch.scales[index], batch.tangent_start[index])
        memory[rows.GROWTH * STRIDE + slot] = 0.0
        store(memory, rows.CROSSINGS, slot, (0.0, math.inf, 0.0))
        for row in range(rows.CONTACT, rows.CARRIED):
            memory[row * STRIDE + slot] = 0.0
        point = point_on_grid(memory, slot, batch.table, batch.shares, 0, present)
        if present.teeth is not None:
            store(memory, rows.SHARED, slot, point)
        if present.resolved is not None:
            forcing = forcing_at(lane, point, present)
            state = from_rest(read_state(memory, rows.STATE, slot, present), forcing, present)
            gaps = gaps_at(state, lane, forcing, present)
            write_branches(memory, slot, branches_at(gaps, lane.half_backlash, present))
        if present.flow_map is not None:
            begin_forces(memory, slot, lane, present)
    return interval


@scalar
def step_block(memory, start, middle, final, present):
    """Take one step in every slot; return how many may have left a contact branch."""
    # A sum of integers, which the compiler knows how to vectorise; it does not know a flag.
    suspects = 0
    for slot in range(LANES):
        lane = read_lane(memory, slot)
        state = read_state(memory, rows.STATE, slot, present)
        point, _ = start
        if present.teeth is not None:
            # What ended the last step begins this one.
            point = load(memory, rows.SHARED, slot, Phase)
        begin = forcing_at(lane, point, present)
        point = with_teeth(memory, slot, middle, present)
        halfway = forcing_at(lane, point, present)
        point = with_teeth(memory, slot, final, present)
        end = forcing_at(lane, point, present)
        if present.teeth is not None:
            store(memory, rows.SHARED, slot, point)
        during = begin, halfway, halfway, end
        branches = ANYWHERE
        if present.resolved is not None:
            branches = read_branches(memory, slot)
        moving = from_rest(state, begin, present)
        after, slopes = rk4.advance(rk4.motion, moving, 1.0, lane, during, branches, present)
        if present.resolved is not None:
            gaps = gaps_at(moving, lane, begin, present)
            gaps_after = gaps_at(after, lane, end, present)
            ways = ways_that_may_leave(gaps, gaps_after, branches, (0.0, 0.0), present)
            suspects += 1 if ways != 0.0 else 0
            memory[rows.SUSPECT * STRIDE + slot] = ways
        if present.resolved is not None or present.loads is not None:
            write_state(memory, rows.STATE_BEFORE, slot, state, present)
        write_state(memory, rows.STATE, slot, from_error(after, end, present), present)
        if present.tangent is not None:
            tangent = read_state(memory, rows.TANGENT, slot, present)
            if present.resolved is not None:
                write_state(memory, rows.TANGENT_BEFORE, slot, tangent, present)
            tangent, _ = rk4.advance(rk4.tangent, tangent, 1.0, lane, slopes, None, present)
            write_state(memory, rows.TANGENT, slot, tangent, present)
    return suspects


@scalar
def split(memory, lanes, table, shares, number, recorded, present):
    """Split the step of every lane that may have left a contact branch."""
    # No array of the outcome here: passing one means counting references to it at every step.
    for slot in range(lanes):
        if memory[rows.SUSPECT * STRIDE + slot] != 0.0:
            split_step(memory, slot, table, shares, number, recorded, present)


@scalar
def scale_tangents(memory, first, lanes, batch, steps_done, last):
    """Scale tangent vectors whose turn it is to length 1; keep the logarithm of their growth."""
    # Those of repeated lanes, too: they would become denormal, and cost all others their speed.
    for slot in range(LANES):
        index = batch.order[first + min(slot, lanes - 1)]
        if steps_done % batch.steps_between_scalings[index] != 0 and not last:
            continue
        scale = batch.scales[index]
        square = 0.0
        for column in range(scale.shape[0]):
            square += (memory[(rows.TANGENT + column) * STRIDE + slot] * scale[column]) ** 2
        length = math.sqrt(square)
        for column in range(scale.shape[0]):
            part = memory[(rows.TANGENT + column) * STRIDE + slot] / length
            # So would in time what decays faster than the rest.
            memory[(rows.TANGENT + column) * STRIDE + slot] = part if abs(part) > LOST else 0.0
        memory[rows.GROWTH * STRIDE + slot] += math.log(length)


@scalar
def end_period(memory, first, lanes, batch, period, steps, plan, outcome, present):
    """Write section and growth of every lane, and stop those that have diverged."""
    recorded = period - plan.transient_periods
    point = recorded - plan.recorded_periods + plan.section_points
    for slot in range(lanes):
        index = batch.order[first + slot]
        if outcome.status[index] != _OK:
            continue
        sound = within_range(memory, slot, batch.scales[index])
        if present.tangent is not None:
            sound = sound and math.isfinite(memory[rows.GROWTH * STRIDE + slot])
        if not sound:
            outcome.status[index] = _DIVERGED
            outcome.diverged_period[index] = period
            for row in range(rows.COEFFICIENTS):
                memory[row * STRIDE + slot] = math.nan
            # One by one: a slice takes longer to compile.
            for later in range(max(point, 0), outcome.section.shape[1]):
                scale = batch.scales[index]
                take(memory, rows.STATE, slot, scale, outcome.section[index, later])
            for later in range(max(recorded, 0), outcome.growth.shape[1]):
                outcome.growth[index, later] = math.nan
            continue
        if present.contact is not None:
            if recorded >= 0:
                branches = read_branches(memory, slot)
                end_contact(memory, slot, 0, branches.tangential, steps)
                end_contact(memory, slot, 1, branches.axial, steps)
        if point >= 0:
            take(memory, rows.STATE, slot, batch.scales[index], outcome.section[index, point])
        if present.tangent is not None:
            if recorded >= 0:
                outcome.growth[index, recorded] = memory[rows.GROWTH * STRIDE + slot]
            memory[rows.GROWTH * STRIDE + slot] = 0.0


@scalar
def end(memory, first, lanes, batch, steps, plan, outcome, present):
    """Write the last state and tangent vector of every lane, and what it has crossed."""
    for slot in range(lanes):
        index = batch.order[first + slot]
        scale = batch.scales[index]
        take(memory, rows.STATE, slot, scale, outcome.end_state[index])
        take(memory, rows.TANGENT, slot, scale, outcome.end_tangent[index])
        outcome.crossings[index] = int(memory[rows.CROSSINGS * STRIDE + slot])
        outcome.slowest_crossing[index] = memory[rows.SLOWEST * STRIDE + slot]
        outcome.overflows[index] = int(memory[rows.OVERFLOWS * STRIDE + slot])
        if present.contact is not None:
            for row in range(2 * rows.CONTACT_ROWS):
                unit = steps if row % rows.CONTACT_ROWS in (0, rows.SPEEDS // 2) else 1
                outcome.contact[index, row] = memory[(rows.CONTACT + row) * STRIDE + slot] / unit
        if present.loads is not None:
            for row in range(rows.SIGNALS * rows.SIGNAL_ROWS):
                value = memory[(rows.LOADS + row) * STRIDE + slot]
                outcome.loads[index, row // rows.SIGNAL_ROWS, row % rows.SIGNAL_ROWS] = value
            end_chosen(memory, slot, index, batch, outcome)
    if plan.history_periods > 0:
        sample = plan.history_periods * plan.steps_per_period
        keep_state(memory, first, lanes, batch, outcome.history, sample)


@scalar
def keep_state(memory, first, lanes, batch, history, sample):
    """Write the state of every lane into one sample of its history."""
    for slot in range(lanes):
        index = batch.order[first + slot]
        take(memory, rows.STATE, slot, batch.scales[index], history[index, sample])


@scalar
def within_range(memory, slot, scale):
    """Tell whether every state of a lane is a number of sensible size."""
    for column in range(scale.shape[0]):
        if not abs(memory[(rows.STATE + column) * STRIDE + slot] * scale[column]) < LARGEST_STATE:
            return False
    return True
