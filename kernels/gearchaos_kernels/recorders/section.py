"""The stroboscopic section: the state at the end of the last mesh periods."""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import take
from gearchaos_kernels.memory.rows import STATE
from gearchaos_kernels.recorders.protocol import Recorder


@scalar
def end_period(memory, first_row, lane_at, clock, records, scene):
    """Write the state of a lane as a section point, if the period is one of the last."""
    section = records.outcome.section
    point = section.shape[1] - 1 - clock.left
    if point >= 0:
        scale = records.batch.scales[lane_at.number]
        take(memory, STATE, lane_at.slot, scale, section[lane_at.number, point])


@scalar
def stop(memory, first_row, lane_at, clock, records, scene):
    """Write the state at which a lane is stopped as all remaining section points."""
    section = records.outcome.section
    # In a loop, because a slice takes longer to compile.
    for later in range(max(section.shape[1] - 1 - clock.left, 0), section.shape[1]):
        scale = records.batch.scales[lane_at.number]
        take(memory, STATE, lane_at.slot, scale, section[lane_at.number, later])


SECTION = Recorder(
    name="section",
    wanted=lambda _plan, _resolved: True,
    rows=lambda _scene: 0,
    arrays=("section",),
    end_period=end_period,
    stop=stop,
)
