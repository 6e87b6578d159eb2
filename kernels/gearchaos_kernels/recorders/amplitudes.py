"""Extremes of chosen states, and amplitudes at chosen mesh orders, while a lane is recorded.

Extremes of a displacement are those of the cubic through its values and rates at both ends of a
step; extremes of a rate are those of the cubic's derivative. An amplitude is a line of the discrete
Fourier transform of the values at the ends of all steps. It is computed as a complex sum that is
rotated in every step by the phase by which its order advances.

The first half of the rows contains maxima and real parts, the second half minima and imaginary
parts. Only then does the compiler recognise that the rows of one loop do not overlap.
"""

import math
from typing import NamedTuple

import numpy as np

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import load, store
from gearchaos_kernels.memory.rows import LANES, STRIDE, rows
from gearchaos_kernels.recorders.protocol import Recorder


class One(NamedTuple):
    """The number of one row."""

    value: float


@scalar
def one(memory, row, slot):
    """Return the number of one row; unlike an index, the row is not checked for its sign."""
    return load(memory, row, slot, One).value


@scalar
def half_of(batch):
    """Return half the number of rows that this recorder uses after those of the scene."""
    return batch.chosen.size - 1 + batch.chosen.size * batch.turns.shape[1]


@scalar
def begin(memory, first_row, block, clock, records, scene):
    """Start the record of every slot with its state, when the recorded periods begin."""
    if clock.recorded == 0:
        batch, total = records.batch, rows(scene).total
        memory[total * STRIDE :] = 0.0
        for number, row in enumerate(batch.chosen[:-1]):
            for slot in range(LANES):
                value = (one(memory, row, slot),)
                store(memory, total + number, slot, value)
                store(memory, total + number + half_of(batch), slot, value)


@scalar
def step(memory, first_row, block, clock, records, scene):
    """Update the extremes and sums of every slot after a step."""
    if clock.recorded >= 0:
        batch, total = records.batch, rows(scene).total
        add_extremes(memory, total, rows(scene).state_before, batch)
        add_waves(memory, total + batch.chosen.size - 1, block, batch)


@scalar
def add_extremes(memory, at, before, batch):
    """Update the extremes of the chosen states, in rows from ``at`` on."""
    half = half_of(batch)
    for row in batch.chosen[:-1]:
        position = row - row % 2
        of_rate = np.float64(row % 2)
        for slot in range(LANES):
            first = one(memory, before + position, slot)
            rate = one(memory, before + position + 1, slot)
            last_rate = one(memory, position + 1, slot)
            change = one(memory, position, slot) - first
            bend = 3.0 * change - 2.0 * rate - last_rate
            twist = rate + last_rate - 2.0 * change
            # Branch-free selection of the cubic or its derivative: one loop serves both.
            turn1, turn2 = turns_of(
                first + of_rate * (rate - first),
                rate + of_rate * (2.0 * bend - rate),
                bend + of_rate * (3.0 * twist - bend),
                twist - of_rate * twist,
            )
            largest = max(one(memory, at, slot), one(memory, row, slot))
            smallest = min(one(memory, at + half, slot), one(memory, row, slot))
            store(memory, at, slot, (max(largest, max(turn1, turn2)),))
            store(memory, at + half, slot, (min(smallest, min(turn1, turn2)),))
        at += 1


@scalar
def add_waves(memory, at, block, batch):
    """Add the values at the end of a step to the sums of all orders, in rows from ``at`` on."""
    half = half_of(batch)
    turns = batch.turns[batch.order[block.first]]
    for row in batch.chosen:
        for order in range(turns.shape[0]):
            cosine, sine = turns[order, 0], turns[order, 1]
            for slot in range(LANES):
                real = one(memory, at, slot) + one(memory, row, slot)
                imaginary = one(memory, at + half, slot)
                store(memory, at, slot, (cosine * real - sine * imaginary,))
                store(memory, at + half, slot, (sine * real + cosine * imaginary,))
            at += 1


@scalar
def turns_of(c0, c1, c2, c3):
    """Return the values of a cubic at its turning points, or at an end if they are outside 0..1."""
    # A small error of the place hardly changes the value there: single precision is enough.
    root = math.sqrt(np.float32(max(0.0, c2 * c2 - 3.0 * c3 * c1)))
    both = np.float32(-c2) - math.copysign(root, np.float32(c2))
    at1 = min(1.0, max(0.0, np.float64(both / np.float32(3.0 * c3))))
    at2 = min(1.0, max(0.0, np.float64(np.float32(c1) / both)))
    turn1 = c0 + at1 * (c1 + at1 * (c2 + at1 * c3))
    return turn1, c0 + at2 * (c1 + at2 * (c2 + at2 * c3))


@scalar
def finish(memory, first_row, lane_at, clock, records, scene):
    """Write the extremes of a lane, and the absolute values of its sums."""
    if clock.recorded == 0:
        # Without recorded periods the rows have never been written.
        return
    found = memory[rows(scene).total * STRIDE + lane_at.slot :: STRIDE]
    half = half_of(records.batch)
    states = records.batch.chosen.size - 1
    for number in range(states):
        records.outcome.extremes[lane_at.number, number, 0] = found[number + half]
        records.outcome.extremes[lane_at.number, number, 1] = found[number]
    for number in range(states, half):
        size = math.hypot(found[number], found[number + half])
        records.outcome.amplitudes[lane_at.number, number - states] = size


AMPLITUDES = Recorder(
    name="amplitudes",
    wanted=lambda plan, _resolved: bool(plan.states or plan.orders),
    rows=lambda _scene: 0,
    arrays=("extremes", "amplitudes", "chosen", "turns"),
    reads_before=True,
    begin=begin,
    step=step,
    finish=finish,
)
