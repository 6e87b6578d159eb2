"""The stroboscopic section: the state at the end of the last mesh periods."""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import take
from gearchaos_kernels.memory.rows import STATE
from gearchaos_kernels.recorders.protocol import Recorder


@scalar
def end_period(memory, at, place, clock, given, scene):
    """Write the state of a lane, if the period is one of the last."""
    section = given.outcome.section
    point = section.shape[1] - 1 - clock.left
    if point >= 0:
        scale = given.batch.scales[place.lane]
        take(memory, STATE, place.slot, scale, section[place.lane, point])


@scalar
def stop(memory, at, place, clock, given, scene):
    """Write the state at which a lane was stopped into all sections that are left."""
    section = given.outcome.section
    # One by one: a slice takes longer to compile.
    for later in range(max(section.shape[1] - 1 - clock.left, 0), section.shape[1]):
        scale = given.batch.scales[place.lane]
        take(memory, STATE, place.slot, scale, section[place.lane, later])


SECTION = Recorder(
    name="section",
    wanted=lambda _plan, _resolved: True,
    rows=lambda _scene: 0,
    end_period=end_period,
    stop=stop,
)
