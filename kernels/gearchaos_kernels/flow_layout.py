"""Where the numbers of the maps of `flow_map` stand in their tables."""

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar

TERMS = 16
"""Terms of the polynomials along a step."""

BOUNDS, HEADER = (8, 24), 40
"""What stands before the maps of a step: sine and cosine of the mesh phase at its beginning and at
its end; by how much each column may bend either gap beyond a cubic, on any branch."""


class Layout(NamedTuple):
    """Where the parts of the maps of one step and one pair of branches stand, in numbers.

    ``columns``: those of x and then those of c: load, offset of the tangential and of the axial
    flank, sine and cosine part of the pitch error, as far as the scene has them; ``width``: of a
    state, so that it fills vector registers; ``size``: of a pair of branches, whose map of the
    state stands first; ``pairs``: of branches; ``ways``: directions of the mesh;
    ``step_size``: of all maps of a step.
    """

    states: int
    columns: int
    width: int
    gaps: tuple[int, int]
    switches: tuple[int, int]
    size: int
    pairs: int
    ways: int
    step_size: int


@scalar
def layout(present):
    """Return the layout of the maps of a scene."""
    transverse = 0 if present.transverse is None else 1
    axial = 0 if present.axial is None else 1
    error = 0 if present.pitch_error is None else 1
    phase = 0 if present.phase is None else 1
    resolved = 0 if present.resolved is None else 1
    states = 2 + 4 * transverse + 4 * axial
    columns = states + 2 + axial + error + phase
    width = 2 if states == 2 else 8 if states == 6 else 16
    gap_y = columns * width
    gap_z = gap_y + columns * TERMS
    switch_y = gap_z + axial * columns * TERMS
    switch_z = switch_y + TERMS * width
    size = switch_z + axial * TERMS * width
    pairs = (1 + resolved) * (1 + resolved * axial)
    places = (gap_y, gap_z), (switch_y, switch_z), size, pairs
    return Layout(states, columns, width, *places, 1 + axial, HEADER + pairs * size)
