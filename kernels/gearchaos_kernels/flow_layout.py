"""Where numbers stand: those of the maps of `flow_map` in tables, those of lanes that cross."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels import rows
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.system import Floats

TERMS = 16
"""Terms of the polynomials along a step."""

BOUNDS, HEADER = (8, 24), 40
"""What stands before the maps of a step: sine and cosine of the mesh phase at its beginning and at
its end; by how much each column may bend either gap beyond a cubic, on any branch."""


INPUTS, TANGENT_INPUTS, RESULT, OWN = 0, 16, 32, 48
"""Where the numbers of a block's only lane stand: state and forces, tangent vector, either of them
at the end of the step; and how many numbers that are."""

GAPS = rows.ROWS
TANGENT_TERMS, MOMENT, CROSSED, SIDE, DISTANCE, BEND, GAP = 16, 32, 33, 35, 36, 37, 40
"""Rows of a lane that has been taken aside, as it crosses: first those of the tangential and of the
axial gap, with the terms along the step, those of what the tangent vector adds, the next crossing,
value and slope there, the side from which the gap is seen, by what it is raised, and more than its
fourth derivative; and how many rows that are."""


class Crossing(NamedTuple):
    """The last crossing of a lane that has been taken aside, in rows behind those of its gaps.

    ``after``: its moment; ``factor``, ``edge``: by what and from which gap on the deflection acts
    that begins or ends there; ``axially``: 1 for that of the axial gap, else 0.
    """

    after: float
    factor: float
    edge: float
    axially: float


AFTER, FACTOR, EDGE, AXIALLY, SUMS = range(GAPS + 2 * GAP, GAPS + 2 * GAP + 5)
TANGENT_SUMS = SUMS + TERMS
ASIDE = TANGENT_SUMS + TERMS - rows.ROWS
"""Behind them: what carries state and tangent vector over it (see `flow_vectors.sum_along`); and
how many rows more than in a block that are."""


def fourth_derivative(power: Floats) -> Floats:
    """Return the largest fourth derivative of powers of s from -1 to 1."""
    return power * (power - 1.0) * (power - 2.0) * (power - 3.0)


class Work(NamedTuple):
    """Memory of the lanes of a block that cross, eight at a time.

    ``aside``: as that of a block; ``slots``: of all that cross, without a sign: else a place is
    tested for one wherever it is used; ``numbers``: of a block's only lane.
    """

    aside: Floats
    slots: NDArray[np.uint32]
    numbers: Floats


class Layout(NamedTuple):
    """Where the parts of the maps of one step and one pair of branches stand, in numbers.

    ``columns``: those of x and then those of c: load, offset of the tangential and of the axial
    flank, sine and cosine part of the pitch error, as far as the scene has them; ``width``: of a
    state, so that it fills vector registers; ``gap``, ``switch``: where those of both directions
    begin, tangential and then axial; ``size``: of a pair of branches, whose map of the state stands
    first; ``pairs``: of branches; ``ways``: directions of the mesh; ``step_size``: of all maps of a
    step.
    """

    states: int
    columns: int
    width: int
    gap: int
    switch: int
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
    ways = 1 + axial
    gap = columns * width
    switch = gap + ways * columns * TERMS
    size = switch + ways * TERMS * width
    pairs = (1 + resolved) * (1 + resolved * axial)
    return Layout(states, columns, width, gap, switch, size, pairs, ways, HEADER + pairs * size)
