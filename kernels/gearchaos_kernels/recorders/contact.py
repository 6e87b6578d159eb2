"""Contact of every element: time on either flank, impacts, and impact speeds.

Each element has six rows: time on the driving flank in steps, number of impacts there, both for the
back flank, then the sum and the maximum of the impact speeds.

Every loop that resolves crossings contains it. Where contact is not requested, a comparison leaves
out what is done once in a mesh period; that saves the compilation of a second loop.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import read_branches
from gearchaos_kernels.memory.rows import STRIDE
from gearchaos_kernels.recorders.protocol import Recorder
from gearchaos_kernels.scene import Scene, provider_of

ROWS, SPEEDS = 6, 4
"""Number of rows of an element, and the first one of the speeds."""


def rows(scene: Scene) -> int:
    """Return the number of rows of a scene."""
    elements: int = provider_of(scene.model).elements(scene.model)
    return ROWS * elements


@scalar
def crossing(memory, first_row, slot, crossing, lane, scene):
    """Record a crossing: the contact time, and an impact if a contact begins."""
    first = first_row + ROWS * crossing.element
    flank = (first + row_of_flank(crossing.offset)) * STRIDE + slot
    # The contact time is the sum of the moments of separation less those of impact.
    memory[flank] += crossing.moment * (1.0 - 2.0 * crossing.meets)
    memory[flank + STRIDE] += crossing.meets
    speeds = (first + SPEEDS) * STRIDE + slot
    memory[speeds] += crossing.meets * crossing.speed
    memory[speeds + STRIDE] = max(memory[speeds + STRIDE], crossing.meets * crossing.speed)


@scalar
def end_period(memory, first_row, lane_at, clock, records, scene):
    """Add the end of the period as a moment of separation for every element in contact."""
    if clock.recorded >= 0 and records.outcome.contact.shape[1] > 0:
        branches = read_branches(memory, lane_at.slot, scene)
        for element in range(len(branches)):
            branch = branches[element]
            row = first_row + ROWS * element + row_of_flank(branch.offset)
            memory[row * STRIDE + lane_at.slot] += clock.steps * branch.engaged


@scalar
def row_of_flank(offset):
    """Return the row of the driving flank (or of an element without clearance) or back flank."""
    return 0 if offset >= 0.0 else SPEEDS // 2


@scalar
def finish(memory, first_row, lane_at, clock, records, scene):
    """Write the record of a lane, with times in mesh periods."""
    contact = records.outcome.contact
    for element in range(contact.shape[1]):
        for number in range(ROWS):
            unit = clock.steps if number in (0, SPEEDS // 2) else 1
            row = first_row + ROWS * element + number
            contact[lane_at.number, element, number] = memory[row * STRIDE + lane_at.slot] / unit


CONTACT = Recorder(
    name="contact",
    wanted=lambda _plan, resolved: resolved,
    rows=rows,
    arrays=("contact",),
    crossing=crossing,
    end_period=end_period,
    finish=finish,
)
