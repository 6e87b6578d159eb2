"""One block of lanes through all its mesh periods, on one thread.

The inner loop runs over lanes and its body is a whole step in plain local numbers: this is what
the compiler turns into vector instructions. Everything done once per mesh period (section,
renormalisation, check for divergence) stands outside it.
"""

from __future__ import annotations

import math

import numpy as np

from gearchaos_kernels.compilation import CACHE_LINE, align_stack, block, scalar
from gearchaos_kernels.lane import (
    COEFFICIENT,
    LANES,
    POSITION,
    RATE,
    ROWS,
    STATES,
    STRIDE,
    TANGENT_POSITION,
    TANGENT_RATE,
    read,
    read_lane,
    write,
)
from gearchaos_kernels.motion import forcing_at
from gearchaos_kernels.rk4 import step, tangent_step
from gearchaos_kernels.status import Status

LARGEST_STATE = 1e100
"""A state beyond this has left every length scale: the lane is stopped as diverged."""

_OK = int(Status.OK)
_DIVERGED = int(Status.DIVERGED)
_ITEM = 8


@scalar
def aligned_memory():
    """Return memory for one block that starts on a cache line."""
    memory = np.empty(ROWS * STRIDE + CACHE_LINE // _ITEM)
    misfit = (CACHE_LINE - memory.ctypes.data % CACHE_LINE) % CACHE_LINE // _ITEM
    return memory[misfit : misfit + ROWS * STRIDE]


@block
def integrate_block(
    first,
    coefficients,
    scales,
    start,
    tangent_start,
    phase_table,
    transient_periods,
    recorded_periods,
    section_states,
    pitch_error,
    phase,
    stiffness_variation,
    backlash,
    transverse,
    axial,
    section,
    growth,
    end_state,
    status,
    diverged_period,
):
    """Integrate lanes ``first`` to ``first + LANES``; see `batch.integrate` for the arrays."""
    align_stack()
    memory = aligned_memory()
    last = status.shape[0] - 1
    steps = (phase_table.shape[1] - 1) // 2
    points = section.shape[1]
    periods = transient_periods + recorded_periods

    for slot in range(LANES):
        # A block that is not full repeats the last lane, and nothing of it is stored.
        lane = min(first + slot, last)
        for row in range(STATES):
            memory[row * STRIDE + slot] = start[lane, row] / scales[lane, row]
            if growth is not None:
                memory[(STATES + row) * STRIDE + slot] = tangent_start[row] / scales[lane, row]
        for row in range(coefficients.shape[1]):
            memory[(COEFFICIENT + row) * STRIDE + slot] = coefficients[lane, row]

    for period in range(periods):
        for number in range(steps):
            column = 2 * number
            variation0 = phase_table[0, column]
            variation1 = phase_table[0, column + 1]
            variation2 = phase_table[0, column + 2]
            sine0 = phase_table[1, column]
            sine1 = phase_table[1, column + 1]
            sine2 = phase_table[1, column + 2]
            cosine0 = phase_table[2, column]
            cosine1 = phase_table[2, column + 1]
            cosine2 = phase_table[2, column + 2]
            for slot in range(LANES):
                lane = read_lane(memory, slot)
                y = read(memory, POSITION, slot, transverse, axial)
                w = read(memory, RATE, slot, transverse, axial)
                begin = forcing_at(
                    lane, variation0, sine0, cosine0, pitch_error, phase, stiffness_variation, axial
                )
                middle = forcing_at(
                    lane, variation1, sine1, cosine1, pitch_error, phase, stiffness_variation, axial
                )
                end = forcing_at(
                    lane, variation2, sine2, cosine2, pitch_error, phase, stiffness_variation, axial
                )
                y, w, slopes = step(y, w, lane, begin, middle, end, backlash, transverse, axial)
                write(memory, POSITION, slot, y, transverse, axial)
                write(memory, RATE, slot, w, transverse, axial)
                if growth is not None:
                    dy = read(memory, TANGENT_POSITION, slot, transverse, axial)
                    dw = read(memory, TANGENT_RATE, slot, transverse, axial)
                    dy, dw = tangent_step(dy, dw, lane, slopes, transverse, axial)
                    write(memory, TANGENT_POSITION, slot, dy, transverse, axial)
                    write(memory, TANGENT_RATE, slot, dw, transverse, axial)

        point = period + 1 - (periods - points) - 1
        for slot in range(min(LANES, last + 1 - first)):
            lane = first + slot
            if status[lane] != _OK:
                continue
            if not within_range(memory, slot, scales[lane]):
                status[lane] = _DIVERGED
                diverged_period[lane] = period
                for row in range(2 * STATES):
                    memory[row * STRIDE + slot] = math.nan
                continue
            if point >= 0:
                for variable in range(section_states.shape[0]):
                    row = section_states[variable]
                    section[lane, point, variable] = memory[row * STRIDE + slot] * scales[lane, row]
            if growth is not None:
                logarithm = renormalise(memory, slot, scales[lane])
                if period >= transient_periods:
                    growth[lane, period - transient_periods] = logarithm

    for slot in range(min(LANES, last + 1 - first)):
        lane = first + slot
        for row in range(STATES):
            end_state[lane, row] = memory[row * STRIDE + slot] * scales[lane, row]


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
        square += (memory[(STATES + row) * STRIDE + slot] * scale[row]) ** 2
    length = math.sqrt(square)
    for row in range(STATES):
        memory[(STATES + row) * STRIDE + slot] /= length
    return math.log(length)
