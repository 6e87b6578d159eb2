"""The history: the state at every step of the last mesh periods."""

import math

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import take
from gearchaos_kernels.memory.rows import STATE
from gearchaos_kernels.recorders.protocol import Recorder


@scalar
def begin(memory, at, block, clock, given, scene):
    """Keep the state with which the first period of the history begins."""
    if sample_of(clock, given.outcome.history, 0) == 0:
        keep(memory, block, given, 0)


@scalar
def step(memory, at, block, clock, given, scene):
    """Keep the state at the end of a step, if it ends one of those requested."""
    done = clock.number + 1
    if done % clock.every == 0:
        sample = sample_of(clock, given.outcome.history, done // clock.every)
        if sample >= 0:
            keep(memory, block, given, sample)


@scalar
def sample_of(clock, history, done):
    """Return the sample after some requested steps of a period, negative before the history."""
    return history.shape[1] - 1 - (clock.left + 1) * (clock.steps // clock.every) + done


@scalar
def keep(memory, block, given, sample):
    """Write the state of every lane into one sample of its history."""
    history = given.outcome.history
    for slot in range(block.lanes):
        index = given.batch.order[block.first + slot]
        take(memory, STATE, slot, given.batch.scales[index], history[index, sample])


@scalar
def stop(memory, at, place, clock, given, scene):
    """Mark the state of a lane at the end of the period in which it was stopped."""
    history = given.outcome.history
    sample = sample_of(clock, history, clock.steps // clock.every)
    if sample >= 0:
        for column in range(history.shape[2]):
            history[place.lane, sample, column] = math.nan


HISTORY = Recorder(
    name="history",
    wanted=lambda plan, _resolved: plan.history_periods > 0,
    rows=lambda _scene: 0,
    begin=begin,
    step=step,
    stop=stop,
)
