"""Where numbers stand: those of the maps of `flow_map` in tables, those of lanes that cross."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels import rows
from gearchaos_kernels.compilation import CACHE_LINE, scalar
from gearchaos_kernels.system import STATES, Floats

TERMS = 16
"""Terms of the polynomials along a step, an even number: even and odd ones are summed apart."""


def _filled(numbers: int) -> int:
    """Return how many numbers fill whole cache lines, where so many are needed."""
    line = CACHE_LINE // np.dtype(np.float64).itemsize
    return -(-numbers // line) * line


WIDEST = _filled(len(STATES) + rows.MARGINS - rows.FORCES)
"""Numbers set aside for all states and all that forces a lane."""

_BEGIN = _filled(4)
BOUNDS = (_BEGIN, _BEGIN + WIDEST)
HEADER = BOUNDS[-1] + WIDEST
"""Numbers before the maps of a step: sine and cosine of the mesh phase at its beginning and at its
end; from `BOUNDS` on, by how much each column may bend either gap beyond a cubic, on any branch."""


INPUTS, TANGENT_INPUTS, RESULT, OWN = range(0, 4 * WIDEST, WIDEST)
"""Places of the numbers of a block's only lane: state and forces, tangent vector, either of them at
the end of the step; and how many numbers that are."""

GAPS = rows.ROWS
TANGENT_TERMS = TERMS
MOMENT = TANGENT_TERMS + TERMS
CROSSED = MOMENT + 1
SIDE, DISTANCE, BEND = range(CROSSED + 2, CROSSED + 5)
GAP = _filled(BEND + 1)
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


AFTER, FACTOR, EDGE, AXIALLY = range(GAPS + 2 * GAP, GAPS + 2 * GAP + len(Crossing._fields))
SUMS = AXIALLY + 1
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
    width = 2 if states == 2 else 8 if states == 6 else WIDEST
    ways = 1 + axial
    gap = columns * width
    switch = gap + ways * columns * TERMS
    size = switch + ways * TERMS * width
    pairs = (1 + resolved) * (1 + resolved * axial)
    return Layout(states, columns, width, gap, switch, size, pairs, ways, HEADER + pairs * size)
