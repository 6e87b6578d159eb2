"""The history: the state at every step of the last mesh periods.

Every loop contains it. Where no history is requested, no step is a sample of it: that costs one
comparison a step and block, and saves the compilation of a second loop.
"""

import math

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import take
from gearchaos_kernels.memory.rows import STATE
from gearchaos_kernels.recorders.protocol import Recorder


@scalar
def begin(memory, first_row, block, clock, records, scene):
    """Write the state at the beginning of the first period of the history."""
    if sample_of(clock, records.outcome.history, 0) == 0:
        keep(memory, block, records, 0)


@scalar
def step(memory, first_row, block, clock, records, scene):
    """Write the state at the end of a step, if a requested step ends there."""
    done = clock.number + 1
    if done % clock.substeps == 0:
        sample = sample_of(clock, records.outcome.history, done // clock.substeps)
        if sample >= 0:
            keep(memory, block, records, sample)


@scalar
def sample_of(clock, history, done):
    """Return the number of the sample after n requested steps of a period; negative: no sample."""
    return history.shape[1] - 1 - (clock.left + 1) * (clock.steps // clock.substeps) + done


@scalar
def keep(memory, block, records, sample):
    """Write the state of every lane as one sample of its history."""
    history = records.outcome.history
    for slot in range(block.lanes):
        index = records.batch.order[block.first + slot]
        take(memory, STATE, slot, records.batch.scales[index], history[index, sample])


@scalar
def stop(memory, first_row, lane_at, clock, records, scene):
    """Write NaN as the state at the end of the period in which a lane is stopped."""
    history = records.outcome.history
    sample = sample_of(clock, history, clock.steps // clock.substeps)
    if sample >= 0:
        for column in range(history.shape[2]):
            history[lane_at.number, sample, column] = math.nan


HISTORY = Recorder(
    name="history",
    wanted=lambda _plan, _resolved: True,
    rows=lambda _scene: 0,
    arrays=("history",),
    begin=begin,
    step=step,
    stop=stop,
)
