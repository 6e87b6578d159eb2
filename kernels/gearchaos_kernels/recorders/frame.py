"""Frames of tangent vectors, made orthonormal at the end of every mesh period.

Lanes that follow each other, as many as there are states, have the same motion and carry the
vectors of one frame. Growth of a lane is then the stretch of its direction in the frame. Lengths
and angles are Euclidean in the units of the equations.
"""

import math

from gearchaos_kernels.compilation import part, scalar
from gearchaos_kernels.memory.rows import STRIDE, rows
from gearchaos_kernels.recorders.protocol import Recorder

SMALLEST_RESOLVED = 1e-8
"""Smallest share of a tangent vector that must remain after orthogonalisation."""

ENOUGH = 0.1
"""Share of a vector that must remain for one pass to make it orthogonal to rounding."""

MOST_PASSES = 3
"""Largest number of passes; a third one serves vectors that consist of rounding errors."""


@part
def orthonormalise(memory, first_row, lane_at, clock, records, scene):
    """Orthonormalise a frame when the growth of its last lane in a period has been written."""
    batch, growth = records.batch, records.outcome.growth
    scale = batch.scales[lane_at.number]
    size = scale.shape[0]
    if (lane_at.slot + 1) % size != 0:
        return
    begin, recorded = lane_at.slot + 1 - size, clock.recorded
    resolved = True
    for number in range(size):
        left = orthogonalise(memory, begin, number, scale, scene)
        resolved = resolved and left > SMALLEST_RESOLVED
        if not left > SMALLEST_RESOLVED:
            replace_direction(memory, begin, number, scale, scene)
        if recorded >= 0:
            lane = lane_at.number + 1 - size + number
            growth[lane, recorded] += math.log(left) if resolved else math.nan


@part
def orthogonalise(memory, begin, number, scale, scene):
    """Make a vector orthogonal to those before it, of length 1; return the length that remained."""
    first = rows(scene).tangent
    left = 1.0
    # A pass leaves rounding errors, which count where little remains: then a second one follows.
    for _ in range(MOST_PASSES):
        for other in range(number):
            product = 0.0
            for column in range(scale.shape[0]):
                at = (first + column) * STRIDE + begin
                product += memory[at + number] * memory[at + other] * scale[column] ** 2
            for column in range(scale.shape[0]):
                at = (first + column) * STRIDE + begin
                memory[at + number] -= product * memory[at + other]
        square = 0.0
        for column in range(scale.shape[0]):
            square += (memory[(first + column) * STRIDE + begin + number] * scale[column]) ** 2
        length = math.sqrt(square)
        left *= length
        if not length > 0.0:
            return 0.0
        inverse = 1.0 / length
        for column in range(scale.shape[0]):
            memory[(first + column) * STRIDE + begin + number] *= inverse
        if length >= ENOUGH:
            break
    return left


@scalar
def replace_direction(memory, begin, number, scale, scene):
    """Replace a vector that consists of rounding errors by one orthogonal to those before.

    Of the axes, one at least has a share of 1 / states that is orthogonal to fewer vectors.
    """
    first = rows(scene).tangent
    for axis in range(scale.shape[0]):
        for column in range(scale.shape[0]):
            at = (first + column) * STRIDE + begin + number
            memory[at] = 1.0 / scale[column] if column == axis else 0.0
        if orthogonalise(memory, begin, number, scale, scene) ** 2 * scale.shape[0] > 0.5:
            return


FRAME = Recorder(
    name="frame",
    wanted=lambda plan, _resolved: plan.frame,
    rows=lambda _scene: 0,
    end_period=orthonormalise,
)
