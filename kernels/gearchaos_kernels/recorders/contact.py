"""Contact of every element: time on either flank, impacts, and their speeds.

Of each element six rows: time on the driving flank in steps and impacts there, the same of the
back flank, then the sum and the largest of the speeds of impact.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import read_branches
from gearchaos_kernels.memory.rows import STRIDE
from gearchaos_kernels.recorders.protocol import Recorder
from gearchaos_kernels.scene import Scene, provider_of

ROWS, SPEEDS = 6, 4
"""Rows of one element, and the first of those of the speeds."""


def rows(scene: Scene) -> int:
    """Return the number of rows of a scene."""
    elements: int = provider_of(scene.model).elements(scene.model)
    return ROWS * elements


@scalar
def crossing(memory, at, slot, crossing, lane, scene):
    """Count a crossing: an impact where a flank is met, and the time of contact."""
    first = at + ROWS * crossing.element
    flank = (first + row_of_flank(crossing.offset)) * STRIDE + slot
    # Time on a flank is the sum of all moments of leaving it less those of meeting it.
    memory[flank] += crossing.moment * (1.0 - 2.0 * crossing.meets)
    memory[flank + STRIDE] += crossing.meets
    speeds = (first + SPEEDS) * STRIDE + slot
    memory[speeds] += crossing.meets * crossing.speed
    memory[speeds + STRIDE] = max(memory[speeds + STRIDE], crossing.meets * crossing.speed)


@scalar
def end_period(memory, at, place, clock, given, scene):
    """Count the flank on which a recorded period ends until its end."""
    if clock.recorded >= 0:
        branches = read_branches(memory, place.slot, scene)
        for element in range(len(branches)):
            branch = branches[element]
            row = at + ROWS * element + row_of_flank(branch.offset)
            memory[row * STRIDE + place.slot] += clock.steps * branch.engaged


@scalar
def row_of_flank(offset):
    """Return the row of the driving flank, and where there is no clearance, or the back flank."""
    return 0 if offset >= 0.0 else SPEEDS // 2


@scalar
def finish(memory, at, place, clock, given, scene):
    """Write all numbers of a lane, times in mesh periods."""
    contact = given.outcome.contact
    for element in range(contact.shape[1]):
        for number in range(ROWS):
            unit = clock.steps if number in (0, SPEEDS // 2) else 1
            row = at + ROWS * element + number
            contact[place.lane, element, number] = memory[row * STRIDE + place.slot] / unit


CONTACT = Recorder(
    name="contact",
    wanted=lambda plan, resolved: plan.contact and resolved,
    rows=rows,
    crossing=crossing,
    end_period=end_period,
    finish=finish,
)
