"""The maps of one lane from the Taylor series of eq. 13 about the middle of every step, compiled.

Two things enter: the formulas of `equations`, applied to unit vectors, and the functions of the
mesh phase (eqs 14 and 19). `flow_map` has the equations that are solved here.
"""

import numpy as np
from numba import prange
from numpy.polynomial import chebyshev

from gearchaos_kernels import rows
from gearchaos_kernels.block_memory import aligned_memory, fill_lane, read_state, write_state
from gearchaos_kernels.compilation import driver, evaluator, part
from gearchaos_kernels.equations import accelerations, gaps_at
from gearchaos_kernels.flow_layout import BOUNDS, HEADER, TERMS, fourth_derivative
from gearchaos_kernels.forcing import Phase, forcing_at
from gearchaos_kernels.rows import STRIDE, Directions, Lane, State
from gearchaos_kernels.system import Floats, System

ORDER = 22
"""Terms of the Taylor series that they come from."""

TAIL = 2e-15
"""What may be left of the series, relative to their largest term."""

TOGETHER = 8
"""Steps whose series are computed side by side: they fill vectors, and the cache holds them."""


def _economy() -> tuple[Floats, Floats]:
    """What cuts a Taylor series (ORDER,) to TERMS terms, and the Chebyshev terms that it drops."""
    exact = np.stack(
        [np.pad(chebyshev.poly2cheb(unit), (0, ORDER))[:ORDER] for unit in np.eye(ORDER)]
    )
    kept = np.stack([np.pad(chebyshev.cheb2poly(one[:TERMS]), (0, TERMS))[:TERMS] for one in exact])
    return np.ascontiguousarray(kept.T), np.ascontiguousarray(exact.T[TERMS:])


_KEPT, _DROPPED = _economy()


_BENDS = fourth_derivative(np.arange(TERMS, dtype=float)) / 18.0
"""By how much each power of s may lower the middle Bezier points of its Hermite cubic.

With t from 0 to 1 along the step, which is 2 long, both differ by no more than f t^2 (1 - t)^2 2/3,
where f is the fourth derivative, and that is no more than f/6 (t (1 - t)^2 + t^2 (1 - t)): what
both middle points add, moved by f/18. A piece of the step has the fourth power of its share.
"""

_ENDS = np.stack([(-1.0) ** np.arange(ORDER + 1), np.ones(ORDER + 1)])
"""What makes the values at both ends of a step of a series."""


_MEAN, _VARIATION = map(Lane._fields.index, ("mean_stiffness", "stiffness_variation"))


@evaluator
def differentiate(coefficients, matrices, present):
    """Apply the formulas of eq. 13 to one unit after the other, lane by lane.

    ``matrices`` (lanes, states + 2, states + 5): rates of the states without mesh stiffness, and
    both gaps, by state, drive, sine and cosine of the error, and by a force of one in either
    direction of the mesh, the axial one with its share of the stiffness.
    """
    memory = aligned_memory()
    states = matrices.shape[1] - 2
    for number in range(matrices.shape[0]):
        lane, matrix = fill_lane(memory, 0, coefficients[number]), matrices[number]
        for column in range(states + 5):
            unit = np.zeros(states + 5)
            unit[column] = 1.0
            for line in range(states):
                memory[(rows.STATE + line) * STRIDE] = unit[line]
            drive, sine, cosine = unit[states], unit[states + 1], unit[states + 2]
            state = read_state(memory, rows.STATE, 0, present)
            acting = forcing_at(lane, Phase(0.0, sine, cosine, -sine), present)
            gaps = gaps_at(state, lane, acting, present)
            forces = Directions(
                lane.mesh_damping * gaps.tangential.rate + unit[states + 3],
                lane.axial_share * lane.mesh_damping * gaps.axial.rate
                + lane.axial_share * unit[states + 4],
            )
            change = accelerations(state, forces, drive + acting.drive, lane, present)
            write_state(memory, rows.STATE, 0, State(state.rate, change), present)
            for line in range(states):
                matrix[line, column] = memory[(rows.STATE + line) * STRIDE]
            matrix[states, column] = gaps.tangential.value
            matrix[states + 1, column] = gaps.axial.value


def series_of_forcing(system: System, steps: int) -> Floats:
    """Taylor coefficients about the middle of every step, shape (3, `ORDER`, steps).

    Of the stiffness variation relative to the mean (eq. 19), and of sine and cosine of the phase.
    """
    half = np.pi / steps
    middle = (2 * np.arange(steps) + 1) * half
    term = np.arange(ORDER)[:, np.newaxis]
    factor = half**term / np.cumprod(np.maximum(term, 1.0))[:, np.newaxis]
    turn = np.exp(1j * middle) * 1j**term * factor
    variation = np.zeros(turn.shape)
    if system.effects.stiffness_variation:
        for number, amplitude in enumerate(system.stiffness_cosine - 1j * system.stiffness_sine, 1):
            waves = amplitude * np.exp(1j * number * middle) * (1j * number) ** term * factor
            variation += waves.real
    return np.stack([variation, turn.imag, turn.real])


@driver
def make_maps(matrices, coefficients, forcing, tables, tails, place):
    """Fill the maps of lanes, shape (lanes, steps, size of a step), and tell what series leave.

    Compiled once for all scenes; ``matrices``: see `differentiate`.
    """
    for number in prange(tables.shape[0]):
        # One type of number inside and outside of the parallel loop: else two are compiled.
        lane = np.int64(number)
        tails[lane] = fill_maps(matrices[lane], coefficients[lane], forcing, tables[lane], place)


@part
def fill_maps(matrix, coefficients, forcing, table, place):
    """Fill the maps of a lane, shape (steps, size of a step); return what series leave."""
    tail = 0.0
    for first in range(0, table.shape[0], TOGETHER):
        some = table[first : first + TOGETHER]
        near = forcing[:, :, first : first + TOGETHER]
        width = place.pairs * some.shape[0]
        engaged = np.empty((2, width))
        acting = np.empty((3, ORDER, width))
        for at in range(width):
            pair, step = divmod(at, some.shape[0])
            engaged[0, at] = 1.0 - pair % 2
            engaged[1, at] = 1.0 - pair // 2
            for term in range(ORDER):
                acting[0, term, at] = coefficients[_VARIATION] * near[0, term, step]
                acting[1, term, at] = near[1, term, step]
                acting[2, term, at] = near[2, term, step]
            acting[0, 0, at] += coefficients[_MEAN]
        tail = np.maximum(tail, fill_steps(matrix, engaged, acting, some, place))
        if not tail < TAIL:
            break
    return tail


@part
def fill_steps(matrix, engaged, forcing, table, place):
    """Fill the maps of some steps on all pairs of branches; return what is left of the series.

    In every array the last numbers are those of these steps, pair by pair. They are written one by
    one: with an array for a part of another one Numba compiles a text for where they do not fit.
    """
    states, columns, ways = place.states, place.columns, place.ways
    rates, gaps = matrix[:states, : states + 3].copy(), matrix[states:, : states + 3].copy()
    mobility = matrix[:states, states + 3 :].copy()
    width = engaged.shape[1]
    error = states + 1 + ways

    # The motion by column with drive and error below it, the gaps, and the forces times K.
    psi = np.zeros((ORDER + 1, states + 3, columns * width))
    gap = np.zeros((ORDER, ways, columns * width))
    force = np.zeros((ORDER, ways, columns * width))
    for column in range(states + 1):
        psi[0, column, column * width : (column + 1) * width] = 1.0
    for k in range(ORDER):
        for at in range(width):
            sine, cosine = forcing[1, k, at], forcing[2, k, at]
            if columns > error:
                psi[k, states + 1, error * width + at] = sine
                psi[k, states + 2, error * width + at] = cosine
            if columns > error + 1:
                psi[k, states + 1, (error + 1) * width + at] = cosine
                psi[k, states + 2, (error + 1) * width + at] = -sine
    # An offset is no part of the gap, but less deflection.
    for way in range(ways):
        gap[0, way, (states + 1 + way) * width : (states + 2 + way) * width] = -1.0
    solve(0.5, (rates, mobility, gaps), forcing[0], engaged, psi, gap, force)
    for way in range(ways):
        for at in range((states + 1 + way) * width, (states + 2 + way) * width):
            gap[0, way, at] += 1.0

    # The inverse flow, transposed, and what it makes of the mobilities, with K.
    inverse = np.zeros((ORDER + 1, states, states * width))
    moved = np.zeros((ORDER, ways, states * width))
    switch = np.zeros((ORDER, ways, states * width))
    for line in range(states):
        inverse[0, line, line * width : (line + 1) * width] = 1.0
    backward = np.ascontiguousarray(rates[:, :states].T), gaps.T.copy(), mobility.T.copy()
    solve(-0.5, backward, forcing[0], engaged, inverse, moved, switch)

    # From the middle of the step to its beginning; a step is 2 long in s.
    ends = combined(_ENDS, psi).reshape((2, states + 3, columns, width))
    back = combined(_ENDS, inverse).reshape((2, states, states, width))[0]
    from_beginning = np.zeros((columns, columns, width))
    first = np.zeros((states, states, width))
    for at in range(width):
        for line in range(states):
            for source in range(states):
                from_beginning[line, source, at] = back[source, line, at]
                first[source, line, at] = 0.5 * ends[0, line, source, at]
        for column in range(states, columns):
            from_beginning[column, column, at] = 1.0
            for line in range(states):
                for source in range(states):
                    begin = ends[0, source, column, at]
                    from_beginning[line, column, at] -= back[source, line, at] * begin
    end = multiplied(ends[1, :states], from_beginning)
    along, tail = economised(gap)
    along = multiplied(along.reshape((TERMS * ways, columns, width)), from_beginning)
    traced, lost = economised(switch)
    traced = multiplied(traced.reshape((TERMS * ways, states, width)), first)
    for left in (lost, largest(psi[ORDER, :states]), largest(inverse[ORDER])):
        tail = np.maximum(tail, left)

    for at in range(width):
        pair, step = divmod(at, table.shape[0])
        row = table[step]
        piece = row[HEADER + pair * place.size :]
        for column in range(columns):
            for line in range(states):
                piece[column * place.width + line] = end[line, column, at]
        for way in range(ways):
            for column in range(columns):
                bend = 0.0
                for term in range(TERMS):
                    value = along[term * ways + way, column, at]
                    piece[place.gap + (way * columns + column) * TERMS + term] = value
                    bend += _BENDS[term] * abs(value)
                row[BOUNDS[way] + column] = max(row[BOUNDS[way] + column], bend)
            for term in range(TERMS):
                for line in range(states):
                    value = traced[term * ways + way, line, at]
                    piece[place.switch + (way * TERMS + term) * place.width + line] = value
    return tail


@part
def solve(scale, matrices, stiffness, engaged, terms, seen, pulled):
    """Solve terms' = scale (rates + outer K engaged inner) terms; tell inner terms, and K of it."""
    rates, outer, inner = matrices
    width = engaged.shape[1]
    acting = np.zeros(seen.shape[1:])
    for k in range(ORDER):
        add_product(1.0, inner, terms[k], seen[k])
        for way in range(seen.shape[1]):
            for begin in range(0, seen.shape[2], width):
                part = pulled[k, way, begin : begin + width]
                for j in range(k + 1):
                    for at in range(width):
                        part[at] += stiffness[k - j, at] * seen[j, way, begin + at]
                for at in range(width):
                    acting[way, begin + at] = engaged[way, at] * part[at]
        add_product(scale / (k + 1), rates, terms[k], terms[k + 1])
        add_product(scale / (k + 1), outer, acting, terms[k + 1])


@part
def add_product(scale, a, b, target):
    """Add the product of two matrices, the first of which is small, times a number.

    What one of them has more of than the target or the other one does not count: no axial pair.
    """
    for line in range(min(a.shape[0], target.shape[0])):
        for source in range(min(a.shape[1], b.shape[0])):
            factor = scale * a[line, source]
            if factor != 0.0:
                for column in range(target.shape[1]):
                    target[line, column] += factor * b[source, column]


@part
def combined(matrix, series):
    """Return combinations of the terms of a series."""
    flat = series.reshape((series.shape[0], -1))
    target = np.zeros((matrix.shape[0], flat.shape[1]))
    add_product(1.0, matrix, flat, target)
    return target


@part
def multiplied(a, b):
    """Return the product of the matrices of every step."""
    target = np.zeros((a.shape[0], b.shape[1], b.shape[2]))
    for line in range(a.shape[0]):
        for source in range(b.shape[0]):
            for column in range(b.shape[1]):
                for at in range(b.shape[2]):
                    target[line, column, at] += a[line, source, at] * b[source, column, at]
    return target


@part
def economised(series):
    """Cut Taylor series to fewer terms; return them, and the largest share that is lost."""
    kept, lost = combined(_KEPT, series), combined(_DROPPED, series)
    most = 0.0
    for column in range(lost.shape[1]):
        together = 0.0
        for term in range(lost.shape[0]):
            together += abs(lost[term, column])
        most = np.maximum(most, together)
    return kept, most / np.maximum(largest(kept), 1e-300)


@part
def largest(matrix):
    """Return the size of the largest element; what is not a number is larger than any."""
    most = 0.0
    for row in matrix:
        for number in row:
            most = np.maximum(most, abs(number))
    return most
