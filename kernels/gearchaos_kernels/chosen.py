"""Extremes of chosen states, and amplitudes at chosen mesh orders, while a lane is recorded.

Extremes are those of the cubic through a state and its rate at both ends of a step, and for a rate
of its derivative. An amplitude is a line of the discrete Fourier transform of the values at the
ends of all steps: a sum that turns with every step by the phase by which its order advances.
Largest values and real parts are the first half of the rows, the others the second half: only so
does the compiler see that those of one loop are apart.
"""

import math
from typing import NamedTuple

import numpy as np

from gearchaos_kernels import rows
from gearchaos_kernels.block_memory import load, store
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.rows import LANES, STRIDE


class One(NamedTuple):
    """The number of one row."""

    value: float


@scalar
def one(memory, row, slot):
    """Return the number of one row: an index may count from the end, for all the compiler knows."""
    return load(memory, row, slot, One).value


@scalar
def half_of(batch):
    """Return half the number of rows behind those of every block."""
    return batch.chosen.size - 1 + batch.chosen.size * batch.turns.shape[1]


@scalar
def begin_chosen(memory, batch):
    """Begin the record of every slot with its state."""
    memory[rows.ROWS * STRIDE :] = 0.0
    for number, row in enumerate(batch.chosen[:-1]):
        for slot in range(LANES):
            value = (one(memory, row, slot),)
            store(memory, rows.ROWS + number, slot, value)
            store(memory, rows.ROWS + number + half_of(batch), slot, value)


@scalar
def tell_chosen(memory, batch, turns):
    """Add a step to the extremes and sums of every slot."""
    half = half_of(batch)
    at = rows.ROWS
    for row in batch.chosen[:-1]:
        position = row - row % 2
        of_rate = np.float64(row % 2)
        for slot in range(LANES):
            first = one(memory, rows.BEFORE + position, slot)
            rate = one(memory, rows.BEFORE + position + 1, slot)
            last_rate = one(memory, position + 1, slot)
            change = one(memory, position, slot) - first
            bend = 3.0 * change - 2.0 * rate - last_rate
            twist = rate + last_rate - 2.0 * change
            # Without a branch, so that one loop serves both.
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
    """Return the values where a cubic turns between 0 and 1, or at an end in place of them."""
    # Next to a turn the cubic is as high: single precision is enough.
    root = math.sqrt(np.float32(max(0.0, c2 * c2 - 3.0 * c3 * c1)))
    both = np.float32(-c2) - math.copysign(root, np.float32(c2))
    at1 = min(1.0, max(0.0, np.float64(both / np.float32(3.0 * c3))))
    at2 = min(1.0, max(0.0, np.float64(np.float32(c1) / both)))
    turn1 = c0 + at1 * (c1 + at1 * (c2 + at1 * c3))
    return turn1, c0 + at2 * (c1 + at2 * (c2 + at2 * c3))


@scalar
def end_chosen(memory, slot, index, batch, outcome):
    """Write extremes and the sizes of the sums of a lane."""
    told = memory[rows.ROWS * STRIDE + slot :: STRIDE]
    half = half_of(batch)
    states = batch.chosen.size - 1
    for number in range(states):
        outcome.extremes[index, number, 0] = told[number + half]
        outcome.extremes[index, number, 1] = told[number]
    for number in range(states, half):
        size = math.hypot(told[number], told[number + half])
        outcome.amplitudes[index, number - states] = size
