"""Integrate one block of lanes through all mesh periods, on one thread.

The method of the scene takes one step in every slot and counts the lanes that may have left a
contact branch; it then resolves the step of those. Recorders are called at fixed moments. The check
for divergence and the scaling of tangent vectors happen here.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import align_stack, maker, scalar
from gearchaos_kernels.contact.branches import branches_at
from gearchaos_kernels.control import act, scale_variations
from gearchaos_kernels.memory.block_memory import (
    aligned_memory,
    fill,
    fill_lane,
    read_lane,
    slots_of,
    state_of,
    store,
    take,
    write_branches,
)
from gearchaos_kernels.memory.rows import LANES, STATE, STRIDE, rows
from gearchaos_kernels.methods.protocol import (
    StepAt,
    StepInputs,
    begin_lane,
    maps_per_step,
    resolve,
    room,
    take_step,
    workspace,
)
from gearchaos_kernels.models.interfaces import (
    begin_period,
    forcing_at,
    from_kept,
    gaps_at,
    grid_at,
    keep_point,
    point_at,
)
from gearchaos_kernels.plan import Status
from gearchaos_kernels.recorders.protocol import (
    Block,
    Clock,
    LaneAt,
    Records,
    begin_record,
    finish_record,
    record_period,
    record_step,
    record_stop,
)

LARGEST_STATE = 1e100
"""A lane with a larger state is stopped as diverged."""

NEGLIGIBLE = 1e-150
"""Smaller components of a tangent vector of length 1 are set to 0: their squares underflow."""

_OK = int(Status.OK)
_DIVERGED = int(Status.DIVERGED)


class Batch(NamedTuple):
    """Arrays that the blocks read; the first axis is that of all lanes.

    Attributes
    ----------
    coefficients : array, shape (lanes, coefficients)
        The coefficients of each lane, in the order of `Model.lane`.
    scales : array, shape (lanes, states)
        Factors from scaled states to those of the equations.
    start, tangent_start : array, shape (lanes, states)
        State and tangent vector at tau = 0, in the units of the equations.
    steps_between_scalings : array of int, shape (lanes,)
        Steps between two scalings of a tangent vector to length 1.
    order, blocks, maps, lacked, progress : array
        See `methods.protocol.Share` and `methods.protocol.with_periods`.
    chosen : array of int, shape (states + 1,)
        Rows of the states whose extremes are recorded, then the row of the observed signal.
    turns : array, shape (lanes, orders, 2)
        Cosine and sine of the phase by which a mesh order advances in a step.
    """

    coefficients: NDArray[np.float64]
    scales: NDArray[np.float64]
    start: NDArray[np.float64]
    tangent_start: NDArray[np.float64]
    steps_between_scalings: NDArray[np.intp]
    order: NDArray[np.intp]
    blocks: NDArray[np.intp]
    maps: NDArray[np.float64]
    lacked: NDArray[np.intp]
    progress: NDArray[np.float64]
    chosen: NDArray[np.intp]
    turns: NDArray[np.float64]


@maker
def integrate_block(number_of_block, batch, tables, plan, outcome, control, scene):
    """Integrate the lanes of a block, and write what is recorded of them into the outcome.

    ``control``: the `Actuation`, if the scene has a controller.
    """
    align_stack()
    about = batch.blocks[number_of_block]
    first, lanes, steps, maps_at = about[0], about[1], about[2], about[3]
    recorded_periods = about[4]
    memory = aligned_memory(max(rows(scene).total + plan.more_rows, room(scene)))
    lacked, progress = stops_of(number_of_block, batch, scene)
    given = StepInputs(tables, batch.maps, workspace(memory, scene), about[5:], lacked)
    records = Records(given, batch, outcome)
    block = Block(first, lanes)
    substeps = steps // plan.steps_per_period
    interval = begin(memory, block, batch, given, plan.first_period, scene)
    periods = plan.transient_periods + recorded_periods
    if any_stopped(lacked, scene):
        return
    for period in range(resumed(memory, block, progress, batch, given, scene), periods):
        if scene.stops is not None:
            keep_progress(memory, block, progress, period, scene)
        recorded = period - plan.transient_periods
        if scene.control is not None:
            act(memory, block, period, batch, control, scene)
        clock = Clock(period, 0, steps, substeps, recorded, periods - 1 - period)
        begin_record(memory, block, clock, records, scene)
        for number in range(steps):
            at = StepAt(number, maps_at + number * maps_per_step(scene), recorded >= 0)
            suspects = take_step(memory, lanes, at, given, scene)
            if scene.resolved is not None:
                if suspects > 0:
                    resolve(memory, lanes, at, given, scene)
                    if any_stopped(lacked, scene):
                        return
            clock = Clock(period, number, steps, substeps, recorded, periods - 1 - period)
            record_step(memory, block, clock, records, scene)
            if scene.tangent is not None:
                last = number == steps - 1
                if (number + 1) % interval == 0 or last:
                    scale_tangents(memory, block, batch, number + 1, last, scene)
        clock = Clock(period, steps, steps, substeps, recorded, periods - 1 - period)
        end_period(memory, block, clock, records, scene)
        start_period(memory, block, batch, tables, plan.first_period + period + 1, scene)
    clock = Clock(periods, steps, steps, substeps, recorded_periods, 0)
    end(memory, block, clock, records, scene)


@scalar
def stops_of(number, batch, scene):
    """Return the parts of ``lacked`` and ``progress`` of a block, None if its method never stops.

    See `Share`.
    """
    if scene.stops is None:
        return None, None
    first, lanes = batch.blocks[number, 0], batch.blocks[number, 1]
    return batch.lacked[first : first + lanes], batch.progress[number : number + 1]


@scalar
def any_stopped(lacked, scene):
    """Return whether some lane of a block lacks maps."""
    if scene.stops is None:
        return False
    stopped = 0
    for number in lacked:
        stopped += 1 if number >= 0 else 0
    return stopped > 0


@scalar
def resumed(memory, block, progress, batch, given, scene):
    """Restore the memory of a block that was stopped; return the period in which it continues.

    ``progress``, shape (1 or 0, numbers): its row of `Share.progress`, if there is one.
    """
    if scene.stops is None:
        return 0
    if progress.shape[0] == 0:
        return 0
    period = int(progress[0, 0])
    if period > 0:
        copy_progress(progress[0, 1:], memory, block, scene)
        for slot in range(LANES):
            # Its maps may have moved.
            index = batch.order[block.first + min(slot, block.lanes - 1)]
            begin_lane(memory, slot, index, read_lane(memory, slot, scene), given, scene)
    return period


@scalar
def keep_progress(memory, block, progress, period, scene):
    """Keep the memory of a block at the beginning of a period, if its method may stop it."""
    if progress.shape[0] > 0:
        progress[0, 0] = period
        copy_progress(memory, progress[0, 1:], block, scene)


@scalar
def copy_progress(source, target, block, scene):
    """Copy the memory of a block, except for coefficients, which are constant."""
    for row in range(min(source.shape[0], target.shape[0]) // STRIDE):
        if rows(scene).coefficients <= row < rows(scene).branches:
            continue
        # Estimates of a controller are side by side.
        slots = STRIDE if row >= rows(scene).control else slots_of(block.lanes)
        for slot in range(slots):
            target[row * STRIDE + slot] = source[row * STRIDE + slot]


@scalar
def start_period(memory, block, batch, tables, period, scene):
    """Prepare the slots of all lanes for a mesh period."""
    for slot in range(slots_of(block.lanes)):
        index = batch.order[block.first + min(slot, block.lanes - 1)]
        begin_period(memory, slot, index, period, tables, scene)


@scalar
def begin(memory, block, batch, given, period, scene):
    """Fill the memory of a block; return the shortest interval between scalings of a tangent."""
    # Scaling at the shortest interval of the block is only a check: each lane keeps its own one.
    interval = batch.steps_between_scalings[batch.order[block.first]]
    row_of, tables = rows(scene), given.tables
    for slot in range(LANES):
        # Empty slots repeat the last lane. Nothing of theirs is stored.
        index = batch.order[block.first + min(slot, block.lanes - 1)]
        interval = min(interval, batch.steps_between_scalings[index])
        lane = fill_lane(memory, slot, batch.coefficients[index], scene)
        scale = batch.scales[index]
        fill(memory, STATE, slot, scale, batch.start[index])
        # Methods leave empty slots out; uninitialised memory there may hold slow denormal numbers.
        fill(memory, row_of.state_before, slot, scale, batch.start[index])
        fill(memory, row_of.tangent, slot, scale, batch.tangent_start[index])
        memory[row_of.growth * STRIDE + slot] = 0.0
        store(memory, row_of.crossings, slot, (0.0, math.inf, 0.0))
        for row in range(row_of.recorders, row_of.total):
            memory[row * STRIDE + slot] = 0.0
        begin_period(memory, slot, index, period, tables, scene)
        point = point_at(memory, slot, grid_at(tables, 0, scene), scene)
        keep_point(memory, slot, point, scene)
        if scene.resolved is not None:
            forcing = forcing_at(lane, point, scene)
            state = from_kept(state_of(memory, slot, scene), forcing, scene)
            gaps = gaps_at(state, lane, forcing, scene)
            write_branches(memory, slot, branches_at(gaps, lane, scene), scene)
        begin_lane(memory, slot, index, lane, given, scene)
    return interval


@scalar
def scale_tangents(memory, block, batch, steps_done, last, scene):
    """Scale the tangent vectors that are due to length 1, and add the logarithm of their growth."""
    # In empty slots of a vector as well: denormal numbers there would slow down the whole vector.
    first = rows(scene).tangent
    for slot in range(slots_of(block.lanes)):
        index = batch.order[block.first + min(slot, block.lanes - 1)]
        if steps_done % batch.steps_between_scalings[index] != 0 and not last:
            continue
        scale = batch.scales[index]
        square = 0.0
        for column in range(scale.shape[0]):
            square += (memory[(first + column) * STRIDE + slot] * scale[column]) ** 2
        length = math.sqrt(square)
        if scene.control is not None:
            scale_variations(memory, slot, 1.0 / length, scene)
        for column in range(scale.shape[0]):
            part = memory[(first + column) * STRIDE + slot] / length
            # Flush tiny components before they become denormal.
            memory[(first + column) * STRIDE + slot] = part if abs(part) > NEGLIGIBLE else 0.0
        if slot < block.lanes:
            memory[rows(scene).growth * STRIDE + slot] += math.log(length)


@scalar
def end_period(memory, block, clock, records, scene):
    """Record the mesh period of every lane, and stop the lanes that have diverged."""
    batch, outcome = records.batch, records.outcome
    for slot in range(block.lanes):
        index = batch.order[block.first + slot]
        if outcome.status[index] != _OK:
            continue
        lane_at = LaneAt(slot, index)
        sound = within_range(memory, slot, batch.scales[index])
        if scene.tangent is not None:
            sound = sound and math.isfinite(memory[rows(scene).growth * STRIDE + slot])
        if not sound:
            outcome.status[index] = _DIVERGED
            outcome.diverged_period[index] = clock.period
            for row in range(rows(scene).coefficients):
                memory[row * STRIDE + slot] = math.nan
            record_stop(memory, lane_at, clock, records, scene)
            continue
        record_period(memory, lane_at, clock, records, scene)


@scalar
def end(memory, block, clock, records, scene):
    """Write the last state and tangent vector of every lane, and what recorders accumulated."""
    batch, outcome = records.batch, records.outcome
    for slot in range(block.lanes):
        index = batch.order[block.first + slot]
        scale = batch.scales[index]
        take(memory, STATE, slot, scale, outcome.end_state[index])
        take(memory, rows(scene).tangent, slot, scale, outcome.end_tangent[index])
        crossings = rows(scene).crossings * STRIDE + slot
        outcome.crossings[index] = int(memory[crossings])
        outcome.slowest_crossing[index] = memory[crossings + STRIDE]
        outcome.overflows[index] = int(memory[crossings + 2 * STRIDE])
        finish_record(memory, LaneAt(slot, index), clock, records, scene)


@scalar
def within_range(memory, slot, scale):
    """Return whether every state of a lane is a number and below `LARGEST_STATE`."""
    for column in range(scale.shape[0]):
        if not abs(memory[(STATE + column) * STRIDE + slot] * scale[column]) < LARGEST_STATE:
            return False
    return True
