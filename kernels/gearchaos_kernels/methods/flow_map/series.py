"""Compute the maps of a lane from Taylor series about the middle of every step.

Input are the formulas of the model, applied to unit vectors, and the waves that excite it. The
docstring of `store` has the equations that are solved here.
"""

import math

import numpy as np
from numba import prange
from numpy.polynomial import chebyshev

from gearchaos_kernels.compilation import (
    apart,
    compact,
    driver,
    evaluator,
    maker,
    part,
    scalar,
)
from gearchaos_kernels.contact.elements import Push
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.contact.searching import fourth_derivative
from gearchaos_kernels.memory.block_memory import (
    aligned_memory,
    fill_lane,
    numbers_of_elements,
    state_of,
    write_state,
)
from gearchaos_kernels.memory.rows import STATE, STRIDE, State, rows
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.methods.flow_map.layout import TERMS, layout, waves_at
from gearchaos_kernels.methods.flow_map.signals import (
    add_dampers,
    differentiate_signals,
    observed_series,
    write_signals,
)
from gearchaos_kernels.methods.flow_map.together import TOGETHER, add_products
from gearchaos_kernels.models.interfaces import (
    accelerations,
    elements_at,
    gaps_at,
    mobility_forces,
    unit_forcing,
)
from gearchaos_kernels.plan import Floats

ORDER = 22
"""Number of terms of the Taylor series."""

TAIL = 2e-15
"""Largest truncation error of the series, relative to their largest term."""


def _economy() -> tuple[Floats, Floats]:
    """Return the matrices that cut a Taylor series to `TERMS` terms, and that give what is lost.

    Shapes (TERMS, ORDER) and (ORDER - TERMS, ORDER). The series is cut as a Chebyshev series; the
    second matrix gives the Chebyshev coefficients that are dropped.
    """
    exact = np.stack(
        [np.pad(chebyshev.poly2cheb(unit), (0, ORDER))[:ORDER] for unit in np.eye(ORDER)]
    )
    kept = np.stack([np.pad(chebyshev.cheb2poly(one[:TERMS]), (0, TERMS))[:TERMS] for one in exact])
    return np.ascontiguousarray(kept.T), np.ascontiguousarray(exact.T[TERMS:])


_KEPT, _DROPPED = _economy()


_BENDS = fourth_derivative(np.arange(TERMS, dtype=float)) / 18.0
"""By how much each power of s may lie below its Hermite cubic, as a shift of two Bezier points.

Let t run from 0 to 1 along the step, which has length 2 in s, and let f bound the fourth
derivative. A function differs from its Hermite cubic by at most f t^2 (1 - t)^2 2/3. This is at
most f/6 (t (1 - t)^2 + t^2 (1 - t)), which is the effect of moving both middle Bezier points by
f/18. For a piece of the step the shift is smaller by the fourth power of the piece's share.
"""

_ENDS = np.stack([(-1.0) ** np.arange(ORDER + 1), np.ones(ORDER + 1)])
"""Matrix from the terms of a series to its values at both ends of the step."""


@evaluator
def differentiate(coefficients, matrices, dampers, traced, scene):
    """Apply the formulas of a model to unit vectors, lane by lane, and write the matrices.

    ``matrices`` has the shape (lanes, states + elements, states + 1 + waves + elements). Its rows
    are the rates of the states, without the springs of the elements, and the gaps. Its columns are
    the states, the drive, the waves, and a unit force of each element times its relative stiffness.
    ``dampers`` (lanes, elements, states + 1 + waves + 1) receives the forces of those dampers that
    act in contact only, which are not in the rates, as multiples of the last columns; its own last
    column is their force at unit rate. ``traced``: see `signals.differentiate_signals`.
    """
    memory = aligned_memory(rows(scene).total)
    place = layout(scene)
    states = place.states
    forced = states + 1 + place.waves
    for number in range(matrices.shape[0]):
        lane, matrix = fill_lane(memory, 0, coefficients[number], scene), matrices[number]
        for column in range(forced + place.elements):
            unit = np.zeros(forced + place.elements)
            unit[column] = 1.0
            for line in range(states):
                memory[(STATE + line) * STRIDE] = unit[line]
            state = state_of(memory, 0, scene)
            acting = unit_forcing(lane, unit[states], waves_at(unit, states + 1, scene), scene)
            gaps = gaps_at(state, lane, acting, scene)
            elements, shares = elements_at(lane, acting, scene), mobility_forces(lane, scene)
            units = numbers_of_elements(unit, forced, scene)
            pushes = each(unit_push, gaps, elements, kinds(scene), shares, units)
            if scene.traced is not None:
                waves = waves_at(unit, states + 1, scene)
                of_lane = traced[0][number], traced[1][number]
                differentiate_signals(state, lane, acting, waves, of_lane, column, scene)
            change = accelerations(state, pushes, acting, lane, scene)
            write_state(memory, STATE, 0, State(state.rate, change), scene)
            for line in range(states):
                matrix[line, column] = memory[(STATE + line) * STRIDE]
            for element in range(place.elements):
                matrix[states + element, column] = gaps[element].value
                if kinds(scene)[element].damped_in_contact:
                    damping = elements[element].damping / shares[element]
                    dampers[number, element, forced] = damping
                    if column < forced:
                        dampers[number, element, column] = damping * gaps[element].closing


@scalar
def unit_push(gap, element, kind, share, unit):
    """Return a force times the relative stiffness, plus that of a damper that always acts."""
    if kind.damped_in_contact:
        return Push(share * unit, 0.0, 0.0)
    return Push(element.damping * gap.closing + share * unit, 0.0, element.damping)


@driver
def make_maps(matrices, elements_on, inputs, forcing, tables, tails, place):
    """Compute the maps of lanes and their truncation errors; all scenes share the compiled code.

    ``tables`` (lanes, steps, size of a step) and ``tails`` (lanes,) are written. ``matrices``: see
    `differentiate`; ``elements_on``: the sets of branches, given by whether each element is
    engaged, 1 or 0, shape (lanes, sets in a step, elements); then ``dampers``, the stiffness of the
    elements as `Model.stiffness` returns it, and both arrays of ``traced``; ``inputs``: see
    `MapFormulas`; ``forcing`` (1 + waves, `ORDER`, steps): Taylor coefficients of the stiffness
    variation and of the waves about the middle of every step; ``place``: the `Layout`.
    """
    engaged, dampers, stiffness, observed, forces = elements_on
    for number in prange(tables.shape[0]):
        # The index of a parallel loop has another type; without the cast, two versions of
        # `fill_maps` are compiled.
        lane = np.int64(number)
        of_set = engaged[lane], dampers[lane], stiffness[lane]
        of_lane = *of_set, observed[lane], forces[lane]
        tails[lane] = fill_maps(matrices[lane], of_lane, inputs, forcing, tables[lane], place)


@maker
def fill_maps(matrix, elements_on, inputs, forcing, table, place):
    """Write the maps of a lane, shape (steps, size of a step); return the truncation error."""
    compact()
    sets, dampers, stiffness, observed, forces = elements_on
    tail = 0.0
    for number in range(place.branches):
        engaged = sets[number]
        damped = with_dampers(matrix, engaged, dampers)
        for first in range(0, table.shape[0], TOGETHER):
            some = table[first : first + TOGETHER]
            near = forcing[:, :, first : first + TOGETHER].copy()
            springs = spring_series(stiffness, near)
            on_branches = engaged, springs, dampers[:, -1], observed, forces
            begin = place.header + number * place.size
            lost = fill_steps(damped, on_branches, inputs, near, (some, begin), place)
            tail = np.maximum(tail, lost)
            if not tail < TAIL:
                return tail
    return tail


@maker
def with_dampers(matrix, engaged, dampers):
    """Return a matrix of `differentiate` with the dampers of the engaged elements."""
    compact()
    damped = matrix.copy()
    forced = dampers.shape[1] - 1
    for element in range(engaged.size):
        for line in range(matrix.shape[0] - engaged.size):
            for column in range(forced):
                force = engaged[element] * dampers[element, column]
                damped[line, column] += matrix[line, forced + element] * force
    return damped


@maker
def spring_series(stiffness, forcing):
    """Return the series of the stiffness of every element, shape (elements, ORDER, steps)."""
    compact()
    springs = np.zeros((stiffness.shape[0], forcing.shape[1], forcing.shape[2]))
    for element in range(stiffness.shape[0]):
        for wave in range(forcing.shape[0]):
            part = stiffness[element, 1 + wave]
            if part != 0.0:
                for term in range(forcing.shape[1]):
                    for at in range(forcing.shape[2]):
                        springs[element, term, at] += part * forcing[wave, term, at]
        for at in range(forcing.shape[2]):
            springs[element, 0, at] += stiffness[element, 0]
    return springs


@maker
def fill_steps(matrix, on_branches, inputs, forcing, target, place):
    """Write the maps of some steps on one set of branches; return the truncation error.

    ``on_branches``: for each element whether it is engaged, the series of its stiffness, and its
    damping if that acts in contact only, then both arrays of ``traced``. ``target``: the table of
    the steps, and where the maps begin in each of them. The last axis of every array runs over
    these steps. Arrays are written in loops, because for a slice Numba also compiles a check of the
    shapes.
    """
    compact()
    states, columns, elements = place.states, place.columns, place.elements
    engaged, springs, damping, observed, forces = on_branches
    width = springs.shape[2]
    functions = 1 + place.waves
    rates = piece_of(matrix, (0, states), (0, states + functions))
    gaps = piece_of(matrix, (states, states + elements), (0, states + functions))
    mobility = piece_of(matrix, (0, states), (states + functions, matrix.shape[1]))
    acting = engaged, springs
    psi, gap, pulled = motion_series((rates, mobility, gaps), acting, inputs, forcing, place)
    back_rates, back_gaps = transposed(rates, states), transposed(gaps, states + functions)
    backward = back_rates, back_gaps, transposed(mobility, elements)
    inverse, moved, switch = inverse_series(backward, acting, place)

    # Values at both ends of the step, s = -1 and 1.
    ends = combined(_ENDS, psi).reshape((2, states + functions, columns, width))
    back = combined(_ENDS, inverse).reshape((2, states, states, width))[0]
    from_beginning, first = at_beginning(ends[0], back, place)
    end = multiplied(ends[1, :states], from_beginning)
    along, tail = economised(gap, from_beginning)
    traced, lost = economised(switch, first)
    for left in (lost, largest(psi[ORDER, :states]), largest(inverse[ORDER])):
        tail = np.maximum(tail, left)
    write_maps(end, along, traced, target, place)
    if place.signals > 0:
        kept, _ = economised(pulled, from_beginning)
        add_dampers(kept, along, engaged, forces)
        write_signals(kept, 0, target, place)
        kept, _ = economised(observed_series(psi, observed, ORDER), from_beginning)
        write_signals(kept, elements, target, place)
    if place.damper < place.signal:
        kept, lost = economised(moved, first)
        write_dampers(kept, damping, target, place)
        tail = np.maximum(tail, lost)
    return tail


@maker
def piece_of(matrix, lines, columns):
    """Return a piece of a matrix; ``lines``, ``columns``: the first one, and the one after."""
    compact()
    piece = np.empty((lines[1] - lines[0], columns[1] - columns[0]))
    for line in range(piece.shape[0]):
        for column in range(piece.shape[1]):
            piece[line, column] = matrix[lines[0] + line, columns[0] + column]
    return piece


@maker
def transposed(matrix, columns):
    """Return the transpose of the first columns of a matrix."""
    compact()
    turned = np.empty((columns, matrix.shape[0]))
    for line in range(columns):
        for column in range(matrix.shape[0]):
            turned[line, column] = matrix[column, line]
    return turned


@maker
def motion_series(matrices, acting, inputs, forcing, place):
    """Return the series of the motion and of the gaps about the middle of some steps, by column.

    The third one is K times the deflections. Shapes: (ORDER + 1, states + functions, columns *
    width), where drive and waves follow the states, and twice (ORDER, elements, columns * width).
    """
    compact()
    states, columns, elements = place.states, place.columns, place.elements
    functions = 1 + place.waves
    width = forcing.shape[2]
    psi = np.zeros((ORDER + 1, states + functions, columns * width))
    gap = np.zeros((ORDER, elements, columns * width))
    force = np.zeros((ORDER, elements, columns * width))
    for column in range(states):
        psi[0, column, column * width : (column + 1) * width] = 1.0
    for number in range(place.inputs):
        column = states if number == 0 else states + elements + number
        for function in range(functions):
            steady = inputs[number, function, 0]
            for at in range(width):
                psi[0, states + function, column * width + at] += steady
            for wave in range(1, functions):
                share = inputs[number, function, wave]
                if share != 0.0:
                    for k in range(ORDER):
                        for at in range(width):
                            value = share * forcing[wave, k, at]
                            psi[k, states + function, column * width + at] += value
    # An offset reduces the deflection, but is no part of the gap: it is added for `solve` alone.
    for element in range(elements):
        gap[0, element, (states + 1 + element) * width : (states + 2 + element) * width] = -1.0
    solve(0.5, matrices, acting, psi, gap, force)
    for element in range(elements):
        for at in range((states + 1 + element) * width, (states + 2 + element) * width):
            gap[0, element, at] += 1.0
    return psi, gap, force


@maker
def inverse_series(matrices, acting, place):
    """Return the series of the inverse flow, transposed, of its product with the mobilities, and K.

    The third one is the second one times K. Shapes: (ORDER + 1, states, states * width), and twice
    (ORDER, elements, states * width).
    """
    compact()
    states, width = place.states, acting[1].shape[2]
    inverse = np.zeros((ORDER + 1, states, states * width))
    moved = np.zeros((ORDER, place.elements, states * width))
    switch = np.zeros((ORDER, place.elements, states * width))
    for line in range(states):
        inverse[0, line, line * width : (line + 1) * width] = 1.0
    solve(-0.5, matrices, acting, inverse, moved, switch)
    return inverse, moved, switch


@maker
def at_beginning(begin, back, place):
    """Return what turns columns of the middle of a step into those of its beginning.

    ``begin`` (states + functions, columns, width): the motion at the beginning; ``back`` (states,
    states, width): the inverse flow there, transposed. Also returns half of the flow from the
    middle to the beginning, transposed, which the `SWITCH` terms contain.
    """
    compact()
    states, columns, width = place.states, place.columns, begin.shape[2]
    from_beginning = np.zeros((columns, columns, width))
    first = np.zeros((states, states, width))
    for at in range(width):
        for line in range(states):
            for source in range(states):
                from_beginning[line, source, at] = back[source, line, at]
                first[source, line, at] = 0.5 * begin[line, source, at]
        for column in range(states, columns):
            from_beginning[column, column, at] = 1.0
            for line in range(states):
                for source in range(states):
                    value = begin[source, column, at]
                    from_beginning[line, column, at] -= back[source, line, at] * value
    return from_beginning, first


@maker
def write_maps(end, along, traced, target, place):
    """Write maps, gaps and switches of some steps into a table, and how much the gaps bend."""
    compact()
    states, columns, elements = place.states, place.columns, place.elements
    table, begin = target
    for at in range(end.shape[2]):
        row = table[at]
        piece = row[begin:]
        for column in range(columns):
            for line in range(states):
                piece[column * place.width + line] = end[line, column, at]
        for element in range(elements):
            for column in range(columns):
                bend = 0.0
                for term in range(TERMS):
                    value = along[term * elements + element, column, at]
                    piece[place.gap + (element * columns + column) * TERMS + term] = value
                    bend += _BENDS[term] * abs(value)
                bound = place.bounds + element * place.bound_size + column
                row[bound] = max(row[bound], bend)
            for term in range(TERMS):
                for line in range(states):
                    value = traced[term * elements + element, line, at]
                    piece[place.switch + (element * TERMS + term) * place.width + line] = value


@maker
def write_dampers(kept, damping, target, place):
    """Write what transfers the force of dampers that act in contact only."""
    compact()
    table, begin = target
    for at in range(kept.shape[2]):
        piece = table[at, begin + place.damper :]
        for element in range(place.elements):
            for term in range(TERMS):
                for line in range(place.states):
                    value = damping[element] * kept[term * place.elements + element, line, at]
                    piece[(element * TERMS + term) * place.width + line] = value


@maker
def solve(scale, matrices, acting, terms, seen, pulled):
    """Solve terms' = scale (rates + outer K engaged inner) terms for the terms of a series.

    ``seen`` and ``pulled`` receive inner terms, and K inner terms.
    """
    rates, outer, inner = matrices
    engaged, stiffness = acting
    forces = np.zeros(seen.shape[1:])
    for k in range(ORDER):
        add_product(1.0, inner, terms[k], seen[k])
        for element in range(seen.shape[1]):
            pull(k, element, stiffness, seen, pulled)
            for at in range(seen.shape[2]):
                forces[element, at] = engaged[element] * pulled[k, element, at]
        add_product(scale / (k + 1), rates, terms[k], terms[k + 1])
        add_product(scale / (k + 1), outer, forces, terms[k + 1])


@part
def pull(k, element, stiffness, seen, pulled):
    """Add term k of the product of K and the series ``seen`` of an element; see `solve`."""
    (_, elements, size), width = seen.shape, stiffness.shape[2]
    for begin in range(0, size, width):
        first = (k * elements + element) * size + begin
        for j in range(k + 1):
            source = (j * elements + element) * size + begin
            factor = (element * stiffness.shape[1] + k - j) * width
            if width == TOGETHER:
                add_products(pulled, first, stiffness, factor, seen, source)
            else:
                for at in range(width):
                    value = stiffness[element, k - j, at] * seen[j, element, begin + at]
                    pulled[k, element, begin + at] += value


@maker
def add_product(scale, a, b, target):
    """Add the product of a small matrix and a large one, times a number, to a target.

    Rows and columns that exceed the size of the other matrix or of the target are ignored.
    """
    apart()
    for line in range(min(a.shape[0], target.shape[0])):
        for source in range(min(a.shape[1], b.shape[0])):
            factor = scale * a[line, source]
            if factor != 0.0:
                for column in range(target.shape[1]):
                    target[line, column] += factor * b[source, column]


@maker
def combined(matrix, series):
    """Return a matrix times the terms of a series; further axes of the series are flattened."""
    flat = series.reshape((series.shape[0], -1))
    target = np.zeros((matrix.shape[0], flat.shape[1]))
    add_product(1.0, matrix, flat, target)
    return target


@maker
def multiplied(a, b):
    """Return the products of the matrices of every step; the last axis is that of steps."""
    apart()
    columns, width = b.shape[1], b.shape[2]
    target = np.zeros((a.shape[0], columns, width))
    for line in range(a.shape[0]):
        for source in range(b.shape[0]):
            for column in range(columns):
                if width == TOGETHER:
                    first = (line * columns + column) * width
                    factor = (line * a.shape[1] + source) * width
                    add_products(target, first, a, factor, b, (source * columns + column) * width)
                else:
                    for at in range(width):
                        target[line, column, at] += a[line, source, at] * b[source, column, at]
    return target


@maker
def economised(series, by):
    """Cut Taylor series to `TERMS` terms, and multiply them by the matrices of every step.

    Returns the terms, shape (TERMS * functions, columns of ``by``, steps), where ``series`` has the
    shape (ORDER, functions, lines of ``by`` * steps), and the largest relative error of the cut.
    """
    compact()
    kept, lost = combined(_KEPT, series), combined(_DROPPED, series)
    most = 0.0
    for column in range(lost.shape[1]):
        together = 0.0
        for term in range(lost.shape[0]):
            together += abs(lost[term, column])
        most = np.maximum(most, together)
    rows = TERMS * series.shape[1]
    terms = multiplied(kept.reshape((rows, by.shape[0], by.shape[2])), by)
    return terms, most / np.maximum(largest(kept), 1e-300)


@maker
def largest(matrix):
    """Return the largest absolute value of a matrix, or NaN if it contains one."""
    compact()
    most = 0.0
    for row in matrix:
        for number in row:
            value = abs(number)
            # The processor predicts this branch, whereas a maximum waits for the one before.
            if not value <= most:
                if math.isnan(value):
                    return value
                most = value
    return most
