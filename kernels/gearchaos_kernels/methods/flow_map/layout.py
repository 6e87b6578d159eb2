"""Where numbers are stored: flow maps in their table, lanes that cross in memory aside."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import CACHE_LINE
from gearchaos_kernels.memory.block_memory import numbers_of
from gearchaos_kernels.memory.rows import constants, rows_of
from gearchaos_kernels.memory.tuples import zeros_of
from gearchaos_kernels.methods.flow_map.quadrature import POINTS
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.recorders.loads import signals_of
from gearchaos_kernels.scene import Scene, provider_of

TERMS = 16
"""Number of terms of the polynomials along a step."""

MOST_SETS_IN_ADVANCE = 4
"""Largest number of sets of branches whose maps are all made in advance, for two elements.

Lanes on any of them find their maps side by side. Of more sets, a motion visits few: their maps are
made when a lane enters them.
"""

_VECTOR = CACHE_LINE // np.dtype(np.float64).itemsize
"""Numbers of a vector register, and of a cache line."""


class Work(NamedTuple):
    """Workspace of a block.

    Attributes
    ----------
    aside : array
        Memory of eight lanes that cross, with the rows of a block and those of `Aside`. It is the
        memory of the block from slot ``LANES`` on.
    slots : array of int, shape (LANES,)
        Slots of all lanes that cross. Unsigned, because a signed index is checked for its sign.
    numbers : array
        Factors and result of a map for the only lane of a block; see `Layout`.
    """

    aside: Floats
    slots: NDArray[np.uint32]
    numbers: Floats


class Layout(NamedTuple):
    """Where the parts of the maps of one step begin, in numbers.

    The numbers of a step are a header, then the maps of each set of branches. If the maps of sets
    are made on demand, each set has all steps to itself, with a header of its own.

    Attributes
    ----------
    states, inputs, columns : int
        Number of states x, of inputs of a lane, and of columns of a map. The columns are x, the
        first input, the offset of each element's flank, and the other inputs.
    width : int
        Length of a column of the state, padded to fill vector registers.
    elements, branches : int
        Number of elements, and of sets of branches in a step. Sets differ in which elements are
        engaged.
    on_demand : int
        1 if the maps of a set are made when a lane enters it, 0 if those of all are there.
    gap, switch, damper : int
        Where the gaps, the switch terms of springs, and those of dampers that act in contact only
        begin within the maps of a set of branches; the map of the state comes first. Without such
        dampers, ``damper`` equals ``signal``.
    signal, signals : int
        Where the polynomials of the signals begin within the maps of a set of branches, and their
        number: forces and observed signals in a scene that traces them, otherwise 0.
    values : int
        Where the values of the signals at the `POINTS` points of a whole step begin.
    size, step_size : int
        Size of the maps of one set of branches, and of all numbers of a step.
    waves, bounds, bound_size, header : int
        The header begins with the ``waves`` at the beginning and at the end of the step. From
        ``bounds`` on it has ``bound_size`` numbers for each element: by how much each column may
        bend the gap beyond a cubic. ``header`` is its size.
    tangent_inputs, result, workspace : int
        In `Work.numbers`, which begins with state and inputs: where the tangent vector and the
        result begin, and the size.
    """

    states: int
    inputs: int
    columns: int
    width: int
    elements: int
    branches: int
    on_demand: int
    gap: int
    switch: int
    damper: int
    signal: int
    signals: int
    values: int
    size: int
    step_size: int
    waves: int
    bounds: int
    bound_size: int
    header: int
    tangent_inputs: int
    result: int
    workspace: int


def _padded(count: int) -> int:
    """Return the padded length of a column: a power of two below a register, or whole registers."""
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
    damper = switch + elements * TERMS * width
    signal = damper + (elements * TERMS * width if scene.jumps else 0)
    signals = signals_of(scene) if scene.traced else 0
    values = signal + signals * columns * TERMS
    size = values + signals * columns * POINTS
    sets = 2**elements if scene.resolved else 1
    on_demand = int(sets > MOST_SETS_IN_ADVANCE)
    branches = 1 if on_demand else sets
    bounds = -(-2 * waves // _VECTOR) * _VECTOR
    bound_size = -(-columns // _VECTOR) * _VECTOR
    header = bounds + elements * bound_size
    tangent_inputs = -(-columns // _VECTOR) * _VECTOR
    # One more for the variation of the steady input.
    result = tangent_inputs + -(-(states + 1) // _VECTOR) * _VECTOR
    return Layout(
        states=states,
        inputs=inputs,
        columns=columns,
        width=width,
        elements=elements,
        branches=branches,
        on_demand=on_demand,
        gap=gap,
        switch=switch,
        damper=damper,
        signal=signal,
        signals=signals,
        values=values,
        size=size,
        step_size=header + branches * size,
        waves=waves,
        bounds=bounds,
        bound_size=bound_size,
        header=header,
        tangent_inputs=tangent_inputs,
        result=result,
        workspace=result + -(-width // _VECTOR) * _VECTOR,
    )


layout = constants(layout_of)
"""`Layout` of a scene, as constants of compiled code."""

waves_at = numbers_of(lambda scene: layout_of(scene).waves)
"""Read the values of the waves; arguments: array, place of the first one, scene."""


no_waves = zeros_of(lambda scene: layout_of(scene).waves)
"""Return values of 0 for all waves, a tuple; argument: scene."""


class LastCrossing(NamedTuple):
    """The last crossing of a lane aside, in rows after those of its gaps.

    Attributes
    ----------
    after : float
        Its moment s, -1 before the first crossing.
    factor : float
        1 where a deflection ends, -1 where one begins, 0 without a crossing.
    edge : float
        The gap from which that deflection is measured.
    element : float
        Number of the element that crosses.
    """

    after: float
    factor: float
    edge: float
    element: float


class GapSearch(NamedTuple):
    """Where a gap crosses, and the polynomial in which this is searched, in rows after its terms.

    Attributes
    ----------
    crossed, slope : float
        The gap where it crosses, and its slope there.
    side, distance : float
        side * gap + distance falls below zero at the crossing; ``side`` is 1 or -1.
    bend : float
        A bound on the fourth derivative of the gap along the step.
    """

    crossed: float
    slope: float
    side: float
    distance: float
    bend: float


class Aside(NamedTuple):
    """First rows of a lane aside, after those of a block.

    Attributes
    ----------
    gaps, gap_rows : int
        The gaps along the step, ``gap_rows`` rows for each element: `TERMS` rows of the motion,
        then the following, whose rows are relative to the first one of the element.
    tangent_terms : int
        `TERMS` rows of the tangent vector.
    moment : int
        Moment of the next crossing.
    crossed, side, distance, bend : int
        The `GapSearch`.
    after, factor, edge, element : int
        The `LastCrossing`.
    sums, tangent_sums : int
        Integrals that transfer state and tangent vector to the next branch; see
        `vectors.sum_along`. Those of springs come first, then those of dampers.
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
    """Return the rows of a lane aside."""
    gaps, elements = rows_of(scene).total, layout_of(scene).elements
    moment = 2 * TERMS
    gap_rows = -(-(moment + 6) // _VECTOR) * _VECTOR
    after = gaps + elements * gap_rows
    sums = after + len(LastCrossing._fields)
    count = 2 * TERMS if scene.jumps else TERMS
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
        tangent_sums=sums + count,
        total=sums + 2 * count,
    )


aside_rows = constants(aside_of)
"""`Aside` of a scene, as constants of compiled code."""


class MethodRows(NamedTuple):
    """First rows of what flow maps store of every lane.

    Attributes
    ----------
    inputs : int
        The factors of the map columns after the state: inputs and offsets.
    margins : int
        By how much each gap may deviate from its cubic in a step.
    maps : int
        Where the maps of the lane's branches begin, relative to the first ones of its block; only
        if maps are made on demand.
    means : int
        Constant parts of the signals, which have no column in the maps.
    terms : int
        `TERMS` rows of a signal along the step.
    values : int
        `POINTS` rows of the values of a signal along a piece, without its constant part.
    piece : int
        The moments at which a smooth piece of the signals begins and ends.
    total : int
        Number of rows, counted from ``inputs``.
    """

    inputs: int
    margins: int
    maps: int
    means: int
    terms: int
    values: int
    piece: int
    total: int


def method_rows_of(scene: Scene) -> MethodRows:
    """Return the rows that flow maps use in a block."""
    return _method_rows(layout_of(scene), rows_of(scene).method)


def _method_rows(place: Layout, first: int) -> MethodRows:
    """Return the rows that flow maps use, from a first one on."""
    margins = first + place.columns - place.states
    maps = margins + place.elements
    means = maps + place.on_demand
    terms = means + place.signals
    values = terms + (TERMS if place.signals else 0)
    piece = values + (POINTS if place.signals else 0)
    end = piece + (2 if place.signals else 0)
    return MethodRows(first, margins, maps, means, terms, values, piece, end - first)


def rows_needed(scene: Scene) -> int:
    """Return the number of rows that flow maps use in a block."""
    return _method_rows(layout_of(scene), 0).total


method_rows = constants(method_rows_of)
"""`MethodRows` of a scene, as constants of compiled code."""
