"""Where numbers are stored: those of flow maps in tables, those of lanes that cross in memory."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import CACHE_LINE
from gearchaos_kernels.memory.block_memory import numbers_of
from gearchaos_kernels.memory.rows import constants, rows_of
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import Scene, provider_of

TERMS = 16
"""Terms of the polynomials along a step."""

_VECTOR = CACHE_LINE // np.dtype(np.float64).itemsize
"""Numbers of a vector register, and of a cache line."""


def fourth_derivative(power: Floats) -> Floats:
    """Return the largest fourth derivative of powers of s from -1 to 1."""
    return power * (power - 1.0) * (power - 2.0) * (power - 3.0)


class Work(NamedTuple):
    """Memory of the lanes of a block that cross, eight at a time.

    ``aside``: as that of a block; ``slots``: of all that cross, unsigned: a signed index is tested
    for one that counts from the end; ``numbers``: of a block's only lane.
    """

    aside: Floats
    slots: NDArray[np.uint32]
    numbers: Floats


class Layout(NamedTuple):
    """Where the parts of the maps of one step and one set of branches begin, in numbers.

    Attributes
    ----------
    states, inputs, columns : int
        Number of states x, of inputs of a lane, and of columns of a map: x, then the first input,
        the offset of each element's flank, the other inputs.
    width : int
        Length of a column of the state, such that it fills vector registers.
    elements, branches : int
        Number of elements, and of sets of branches that differ in which elements are engaged.
    gap, switch : int
        Where the gaps of all elements and the `SWITCH` terms of all elements begin within the maps
        of a set of branches, whose map of the state comes first.
    size, step_size : int
        Numbers of the maps of one set of branches, and of all maps of a step.
    waves, bounds, header : int
        Numbers of a step before its maps: the waves at its beginning and at its end, from the
        start; for each element from ``bounds`` on, ``bound_size`` numbers each, by how much each
        column may bend its gap beyond a cubic; ``header``: all of them.
    bound_size : int
        Numbers of one element among the bounds.
    tangent_inputs, result, own : int
        In the workspace of a block's only lane, which begins with its state and inputs: where its
        tangent vector and the result begin, and its size.
    """

    states: int
    inputs: int
    columns: int
    width: int
    elements: int
    branches: int
    gap: int
    switch: int
    size: int
    step_size: int
    waves: int
    bounds: int
    bound_size: int
    header: int
    tangent_inputs: int
    result: int
    own: int


def _padded(count: int) -> int:
    """Return the length of a column: a power of two that fills part of a register, or registers."""
    if count >= _VECTOR:
        return -(-count // _VECTOR) * _VECTOR
    return 1 << (count - 1).bit_length()


@cache
def layout_of(scene: Scene) -> Layout:
    """Return the layout of the maps of a scene."""
    model = provider_of(scene.model)
    states = model.states(scene.model)
    elements = model.elements(scene.model)
    inputs = len(model.maps.inputs(scene.model))
    waves = len(model.maps.waves)
    columns = states + inputs + elements
    width = _padded(states)
    gap = columns * width
    switch = gap + elements * columns * TERMS
    size = switch + elements * TERMS * width
    branches = 2**elements if scene.resolved else 1
    bounds = -(-2 * waves // _VECTOR) * _VECTOR
    bound_size = -(-columns // _VECTOR) * _VECTOR
    header = bounds + elements * bound_size
    tangent_inputs = -(-columns // _VECTOR) * _VECTOR
    result = tangent_inputs + -(-states // _VECTOR) * _VECTOR
    return Layout(
        states=states,
        inputs=inputs,
        columns=columns,
        width=width,
        elements=elements,
        branches=branches,
        gap=gap,
        switch=switch,
        size=size,
        step_size=header + branches * size,
        waves=waves,
        bounds=bounds,
        bound_size=bound_size,
        header=header,
        tangent_inputs=tangent_inputs,
        result=result,
        own=result + -(-width // _VECTOR) * _VECTOR,
    )


layout = constants(layout_of)
"""The layout of a scene, as constants of compiled code."""

waves_at = numbers_of(lambda scene: layout_of(scene).waves)
"""The values of the waves from a place of an array on: array, place, scene."""


class Crossing(NamedTuple):
    """The last crossing of a lane that has been taken aside, in rows behind those of its gaps.

    ``after``: its moment; ``element``: the element that crosses. A deflection begins or ends to act
    there: ``factor`` is its sign, ``edge`` the gap from which it is measured.
    """

    after: float
    factor: float
    edge: float
    element: float


class GapSearch(NamedTuple):
    """Where a gap crosses, and how it is searched, in rows behind those of its terms.

    Attributes
    ----------
    crossed, slope : float
        The gap where it crosses, and its slope there.
    side : float
        The side from which the gap is seen: 1 or -1.
    distance : float
        By how much the gap, seen from there, is raised: it then falls below zero at the crossing.
    bend : float
        A bound on its fourth derivative along the step.
    """

    crossed: float
    slope: float
    side: float
    distance: float
    bend: float


class Aside(NamedTuple):
    """First rows of a lane that has been taken aside, behind those of a block.

    Attributes
    ----------
    gaps : int
        The polynomials of the gaps along the step, ``gap_rows`` for each element: `TERMS` rows of
        the motion, from ``tangent_terms`` on those of the tangent vector, then the next crossing
        (``moment``), value and slope there (``crossed``), the side from which the gap is seen
        (``side``), by what it is raised (``distance``), and more than its fourth derivative
        (``bend``).
    crossing : int
        The `Crossing`; ``after``, ``factor``, ``edge``, ``element``: its rows.
    sums, tangent_sums : int
        What carries state and tangent vector over a crossing; see `vectors.sum_along`.
    total : int
        Number of rows.
    """

    gaps: int
    gap_rows: int
    tangent_terms: int
    moment: int
    crossed: int
    side: int
    distance: int
    bend: int
    after: int
    factor: int
    edge: int
    element: int
    sums: int
    tangent_sums: int
    total: int


@cache
def aside_of(scene: Scene) -> Aside:
    """Return the rows of a lane that has been taken aside."""
    gaps, elements = rows_of(scene).total, layout_of(scene).elements
    moment = 2 * TERMS
    gap_rows = -(-(moment + 6) // _VECTOR) * _VECTOR
    after = gaps + elements * gap_rows
    sums = after + len(Crossing._fields)
    return Aside(
        gaps=gaps,
        gap_rows=gap_rows,
        tangent_terms=TERMS,
        moment=moment,
        crossed=moment + 1,
        side=moment + 3,
        distance=moment + 4,
        bend=moment + 5,
        after=after,
        factor=after + 1,
        edge=after + 2,
        element=after + 3,
        sums=sums,
        tangent_sums=sums + TERMS,
        total=sums + 2 * TERMS,
    )


aside_rows = constants(aside_of)
"""The rows of a lane that has been taken aside, as constants of compiled code."""


class MethodRows(NamedTuple):
    """First rows of what flow maps keep of every lane: what forces it, and the margins of gaps.

    ``inputs``: the columns of a map behind the state; ``margins``: how far each gap may stray from
    its cubic in a step.
    """

    inputs: int
    margins: int


def method_rows_of(scene: Scene) -> MethodRows:
    """Return the rows that flow maps keep of every lane."""
    place, first = layout_of(scene), rows_of(scene).method
    return MethodRows(first, first + place.columns - place.states)


def rows_needed(scene: Scene) -> int:
    """Return how many rows that are."""
    place = layout_of(scene)
    return place.columns - place.states + place.elements


method_rows = constants(method_rows_of)
"""The rows that flow maps keep of every lane, as constants of compiled code."""
