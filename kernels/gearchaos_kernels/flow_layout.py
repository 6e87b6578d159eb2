"""Where the numbers of the maps of `flow_map` stand in their tables."""

from __future__ import annotations

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar

TERMS = 16
"""Terms of the polynomials along a step."""

BOUND_Y, BOUND_Z, HEADER = 8, 24, 40
"""What stands before the maps of a step: sine and cosine of the mesh phase at its beginning and at
its end; by how much each column may bend either gap beyond a cubic, on any branch."""


class Layout(NamedTuple):
    """Where the parts of the maps of one step and one pair of branches stand, in numbers.

    ``columns``: those of x and then those of c: load, offset of the tangential and of the axial
    flank, sine and cosine part of the pitch error, as far as the scene has them; ``width``: of a
    state, so that it fills vector registers; ``pairs``: of branches; ``ways``:
    directions of the mesh; ``varies``: whether its stiffness does.
    """

    states: int
    columns: int
    width: int
    end: int
    gap_y: int
    gap_z: int
    switch_y: int
    switch_z: int
    size: int
    pairs: int
    ways: int
    varies: bool


@scalar
def layout(present):
    """Return the layout of the maps of a scene."""
    states = 2
    if present.transverse is not None:
        states += 4
    if present.axial is not None:
        states += 4
    columns = states + 2
    width = 2 if states == 2 else 8 if states == 6 else 16
    if present.pitch_error is not None:
        columns += 1
    if present.phase is not None:
        columns += 1
    pairs = 1
    if present.resolved is not None:
        pairs = 2
    z = 0
    if present.axial is not None:
        columns += 1
        pairs *= pairs
        z = 1
    end = 0
    gap_y = end + columns * width
    gap_z = gap_y + columns * TERMS
    switch_y = gap_z + z * columns * TERMS
    switch_z = switch_y + TERMS * width
    size = switch_z + z * TERMS * width
    return Layout(
        states,
        columns,
        width,
        end,
        gap_y,
        gap_z,
        switch_y,
        switch_z,
        size,
        pairs,
        1 + z,
        present.stiffness_variation is not None,
    )


@scalar
def step_size(present):
    """Return how many numbers the maps of one step take."""
    place = layout(present)
    return HEADER + place.pairs * place.size
