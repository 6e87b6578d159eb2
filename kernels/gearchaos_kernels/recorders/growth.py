"""The growth of the tangent vector over each recorded mesh period."""

import math

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.rows import STRIDE, rows
from gearchaos_kernels.recorders.protocol import Recorder


@scalar
def end_period(memory, at, place, clock, given, scene):
    """Write the logarithm of the growth, and begin anew."""
    row = rows(scene).growth * STRIDE + place.slot
    if clock.recorded >= 0:
        given.outcome.growth[place.lane, clock.recorded] = memory[row]
    memory[row] = 0.0


@scalar
def stop(memory, at, place, clock, given, scene):
    """Mark the periods that are left as not a number."""
    growth = given.outcome.growth
    for later in range(max(clock.recorded, 0), growth.shape[1]):
        growth[place.lane, later] = math.nan


GROWTH = Recorder(
    name="growth",
    wanted=lambda plan, _resolved: plan.tangent,
    rows=lambda _scene: 0,
    end_period=end_period,
    stop=stop,
)
