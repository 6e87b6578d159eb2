"""Steps of a method that takes several of them for each step of the plan."""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.models.interfaces import grid_within

FEWEST_RECORDED = 240
"""Fewest steps per period if recorders read the end of every step: they interpolate."""


def multiple_of(steps: int, recorded: bool) -> int:
    """Return the fewest steps per period, a multiple of those requested.

    ``recorded``: whether recorders read the end of every step.
    """
    least = FEWEST_RECORDED if recorded else 1
    return steps * -(-least // steps)


@scalar
def grids(clock, given, scene):
    """Return what all lanes share at the beginning, in the middle and at the end of a step."""
    requested, substep = clock.number // clock.substeps, clock.number % clock.substeps
    begin = grid_within(given.tables, requested, substep / clock.substeps, scene)
    middle = grid_within(given.tables, requested, (substep + 0.5) / clock.substeps, scene)
    end = grid_within(given.tables, requested, (substep + 1.0) / clock.substeps, scene)
    return begin, middle, end
