"""The growth of the tangent vector over each recorded mesh period."""

import math

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.rows import STRIDE, rows
from gearchaos_kernels.recorders.protocol import Recorder


@scalar
def end_period(memory, first_row, lane_at, clock, records, scene):
    """Write the logarithm of the growth in a recorded period, and reset it."""
    row = rows(scene).growth * STRIDE + lane_at.slot
    if clock.recorded >= 0:
        records.outcome.growth[lane_at.number, clock.recorded] = memory[row]
    memory[row] = 0.0


@scalar
def stop(memory, first_row, lane_at, clock, records, scene):
    """Write NaN for the remaining periods."""
    growth = records.outcome.growth
    for later in range(max(clock.recorded, 0), growth.shape[1]):
        growth[lane_at.number, later] = math.nan


GROWTH = Recorder(
    name="growth",
    wanted=lambda plan, _resolved: plan.tangent,
    rows=lambda _scene: 0,
    arrays=("growth",),
    end_period=end_period,
    stop=stop,
)
