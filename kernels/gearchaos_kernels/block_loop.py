"""One block of lanes through all its mesh periods, on one thread.

The inner loop runs over lanes and its body is a whole step in plain local numbers: this is what
the compiler turns into vector instructions. What is done once per mesh period (section,
renormalisation, check for divergence) stands outside it, and so does the splitting of the few
steps that cross a clearance boundary.
"""

from __future__ import annotations

import math

import numpy as np

from gearchaos_kernels.compilation import CACHE_LINE, align_stack, block, scalar
from gearchaos_kernels.contact import (
    branches_at,
    may_leave,
    read_branches,
    write_branches,
)
from gearchaos_kernels.forcing import forcing_at, phase_on_grid
from gearchaos_kernels.lane import (
    BEFORE,
    COEFFICIENT,
    COORDINATES,
    GROWTH,
    LANES,
    POSITION,
    RATE,
    ROWS,
    STATES,
    STRIDE,
    SUSPECT,
    TANGENT,
    TANGENT_POSITION,
    TANGENT_RATE,
    read,
    read_lane,
    write,
)
from gearchaos_kernels.motion import (
    axial_gap,
    axial_gap_rate,
    tangential_gap,
    tangential_gap_rate,
)
from gearchaos_kernels.rk4 import step, tangent_step
from gearchaos_kernels.splitting import split_step
from gearchaos_kernels.status import Status

LARGEST_STATE = 1e100
"""A state beyond this has left every length scale: the lane is stopped as diverged."""

_OK = int(Status.OK)
_DIVERGED = int(Status.DIVERGED)
_ITEM = 8


@block
def integrate_block(
    first,
    coefficients,
    scales,
    start,
    tangent_start,
    table,
    transient_periods,
    recorded_periods,
    steps_between_scalings,
    section_states,
    pitch_error,
    phase,
    stiffness_variation,
    backlash,
    resolved,
    transverse,
    axial,
    section,
    growth,
    end_state,
    end_tangent,
    status,
    diverged_period,
    crossings,
    slowest_crossing,
    overflows,
    history,
):
    """Integrate lanes ``first`` to ``first + LANES``; see `batch.integrate` for the arrays."""
    align_stack()
    memory = aligned_memory()
    last = status.shape[0] - 1
    lanes = min(LANES, last + 1 - first)
    steps = (table.shape[0] - 1) // 2
    periods = transient_periods + recorded_periods
    first_point = periods - section.shape[1]
    first_sample = 0
    if history is not None:
        first_sample = history.shape[1] - 1 - periods * steps

    for slot in range(LANES):
        # A block that is not full repeats the last lane, and nothing of that is stored.
        lane = min(first + slot, last)
        for row in range(STATES):
            memory[row * STRIDE + slot] = start[lane, row] / scales[lane, row]
            memory[(TANGENT + row) * STRIDE + slot] = tangent_start[lane, row] / scales[lane, row]
        for row in range(coefficients.shape[1]):
            memory[(COEFFICIENT + row) * STRIDE + slot] = coefficients[lane, row]
        memory[GROWTH * STRIDE + slot] = 0.0
        if resolved is not None:
            lane = read_lane(memory, slot)
            y = read(memory, POSITION, slot, transverse, axial)
            begin = forcing_at(
                lane, phase_on_grid(table, 0), pitch_error, phase, stiffness_variation, axial
            )
            branches = branches_at(y, lane, begin, transverse, axial)
            write_branches(memory, slot, branches)

    # A scaling interval belongs to a lane, whatever its neighbours need.
    shortest_interval = steps_between_scalings[first]
    for slot in range(1, lanes):
        shortest_interval = min(shortest_interval, steps_between_scalings[first + slot])

    for period in range(periods):
        for number in range(steps):
            if history is not None:
                sample = first_sample + period * steps + number
                for slot in range(lanes if sample >= 0 else 0):
                    copy_state(memory, slot, scales[first + slot], history[first + slot, sample])
            # Not in the loop over lanes: nobody tells the compiler that its stores spare the table.
            begin_phase = phase_on_grid(table, 2 * number)
            middle_phase = phase_on_grid(table, 2 * number + 1)
            end_phase = phase_on_grid(table, 2 * number + 2)
            suspects = False
            for slot in range(LANES):
                lane = read_lane(memory, slot)
                y = read(memory, POSITION, slot, transverse, axial)
                w = read(memory, RATE, slot, transverse, axial)
                begin = forcing_at(
                    lane, begin_phase, pitch_error, phase, stiffness_variation, axial
                )
                middle = forcing_at(
                    lane, middle_phase, pitch_error, phase, stiffness_variation, axial
                )
                end = forcing_at(lane, end_phase, pitch_error, phase, stiffness_variation, axial)
                if resolved is None:
                    y_end, w_end, slopes = step(
                        y,
                        w,
                        1.0,
                        lane,
                        begin,
                        middle,
                        end,
                        None,
                        backlash,
                        transverse,
                        axial,
                    )
                else:
                    branches = read_branches(memory, slot, axial)
                    y_end, w_end, slopes, suspect = step_on_branches(
                        y, w, lane, begin, middle, end, branches, transverse, axial
                    )
                    suspects |= suspect
                    memory[SUSPECT * STRIDE + slot] = 1.0 if suspect else 0.0
                    write(memory, BEFORE + POSITION, slot, y, transverse, axial)
                    write(memory, BEFORE + RATE, slot, w, transverse, axial)
                write(memory, POSITION, slot, y_end, transverse, axial)
                write(memory, RATE, slot, w_end, transverse, axial)
                if growth is not None:
                    dy = read(memory, TANGENT_POSITION, slot, transverse, axial)
                    dw = read(memory, TANGENT_RATE, slot, transverse, axial)
                    if resolved is not None:
                        write(
                            memory,
                            BEFORE + TANGENT_POSITION,
                            slot,
                            dy,
                            transverse,
                            axial,
                        )
                        write(memory, BEFORE + TANGENT_RATE, slot, dw, transverse, axial)
                    dy, dw = tangent_step(dy, dw, 1.0, lane, slopes, transverse, axial)
                    write(memory, TANGENT_POSITION, slot, dy, transverse, axial)
                    write(memory, TANGENT_RATE, slot, dw, transverse, axial)
            if resolved is not None:
                if suspects:
                    for slot in range(lanes):
                        if memory[SUSPECT * STRIDE + slot] == 0.0:
                            continue
                        lane = first + slot
                        # The rates of the gaps are those of delta_5 and (delta_3 - delta_4).
                        count, slowest, overflow = split_step(
                            memory,
                            slot,
                            table,
                            number,
                            scales[lane, COORDINATES],
                            axial_speed(scales[lane], coefficients[lane]),
                            pitch_error,
                            phase,
                            stiffness_variation,
                            transverse,
                            axial,
                            growth,
                        )
                        overflows[lane] += overflow
                        if period >= transient_periods:
                            crossings[lane] += count
                            slowest_crossing[lane] = min(slowest_crossing[lane], slowest)

            if growth is not None:
                if (number + 1) % shortest_interval == 0 or number == steps - 1:
                    for slot in range(lanes):
                        interval = steps_between_scalings[first + slot]
                        if (number + 1) % interval == 0 or number == steps - 1:
                            logarithm = renormalise(memory, slot, scales[first + slot])
                            memory[GROWTH * STRIDE + slot] += logarithm

        for slot in range(lanes):
            lane = first + slot
            if status[lane] != _OK:
                continue
            sound = within_range(memory, slot, scales[lane])
            if growth is not None:
                sound = sound and math.isfinite(memory[GROWTH * STRIDE + slot])
            if not sound:
                status[lane] = _DIVERGED
                diverged_period[lane] = period
                for row in range(COEFFICIENT):
                    memory[row * STRIDE + slot] = math.nan
                continue
            if period >= first_point:
                for variable in range(section_states.shape[0]):
                    row = section_states[variable]
                    section[lane, period - first_point, variable] = (
                        memory[row * STRIDE + slot] * scales[lane, row]
                    )
            if growth is not None:
                if period >= transient_periods:
                    growth[lane, period - transient_periods] = memory[GROWTH * STRIDE + slot]
                memory[GROWTH * STRIDE + slot] = 0.0

    for slot in range(lanes):
        lane = first + slot
        copy_state(memory, slot, scales[lane], end_state[lane])
        if history is not None:
            copy_state(memory, slot, scales[lane], history[lane, history.shape[1] - 1])
        for row in range(STATES):
            end_tangent[lane, row] = memory[(TANGENT + row) * STRIDE + slot] * scales[lane, row]


@scalar
def aligned_memory():
    """Return memory for one block that starts on a cache line."""
    memory = np.empty(ROWS * STRIDE + CACHE_LINE // _ITEM)
    misfit = (CACHE_LINE - memory.ctypes.data % CACHE_LINE) % CACHE_LINE // _ITEM
    return memory[misfit : misfit + ROWS * STRIDE]


@scalar
def step_on_branches(y, w, lane, begin, middle, end, branches, transverse, axial):
    """Advance one lane on the contact branches on which it is, and tell if it may leave them."""
    y_end, w_end, slopes = step(
        y, w, 1.0, lane, begin, middle, end, branches, None, transverse, axial
    )
    gap0 = tangential_gap(y, lane, begin, transverse)
    gap1 = tangential_gap(y_end, lane, end, transverse)
    rate0 = tangential_gap_rate(w, lane, begin, transverse)
    rate1 = tangential_gap_rate(w_end, lane, end, transverse)
    suspect = may_leave(gap0, rate0, gap1, rate1, branches.tangential)
    if axial is not None:
        gap0_z = axial_gap(y, gap0, lane, begin)
        gap1_z = axial_gap(y_end, gap1, lane, end)
        rate0_z = axial_gap_rate(w, rate0, 1.0, lane, begin)
        rate1_z = axial_gap_rate(w_end, rate1, 1.0, lane, end)
        suspect = suspect | may_leave(gap0_z, rate0_z, gap1_z, rate1_z, branches.axial)
    return y_end, w_end, slopes, suspect


@scalar
def axial_speed(scale, coefficients):
    """Return what turns the rate of the axial gap into that of y_2."""
    # scale is sin(beta_b) mu_p over the step; mu_p is the first coefficient of a lane.
    return scale[COORDINATES + 3] / coefficients[0]


@scalar
def copy_state(memory, slot, scale, target):
    """Write the state of a lane in the units of eq. 13."""
    for row in range(STATES):
        target[row] = memory[row * STRIDE + slot] * scale[row]


@scalar
def within_range(memory, slot, scale):
    """Tell whether every state of a lane is a number of sensible size."""
    for row in range(STATES):
        if not abs(memory[row * STRIDE + slot] * scale[row]) < LARGEST_STATE:
            return False
    return True


@scalar
def renormalise(memory, slot, scale):
    """Scale the tangent vector to length 1 and return the logarithm of its length before."""
    square = 0.0
    for row in range(STATES):
        square += (memory[(TANGENT + row) * STRIDE + slot] * scale[row]) ** 2
    length = math.sqrt(square)
    for row in range(STATES):
        memory[(TANGENT + row) * STRIDE + slot] /= length
    return math.log(length)
