"""The maps of one lane from the Taylor series of eq. 13 about the middle of every step, compiled.

Two things enter: the formulas of `equations`, applied to unit vectors, and the functions of the
mesh phase (eqs 14 and 19). `flow_map` has the equations that are solved here.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from gearchaos_kernels import rows
from gearchaos_kernels.block_memory import aligned_memory, fill_lane, read_state, write_state
from gearchaos_kernels.compilation import evaluator, part
from gearchaos_kernels.equations import Directions, accelerations, gaps_at
from gearchaos_kernels.flow_layout import BOUNDS, HEADER, TERMS
from gearchaos_kernels.forcing import Phase, forcing_at
from gearchaos_kernels.rows import STRIDE, Coordinates, Lane, State
from gearchaos_kernels.system import Floats, System

ORDER = 26
"""Terms of the Taylor series that they come from."""


def _economy() -> tuple[Floats, Floats]:
    """What cuts a Taylor series (ORDER,) to TERMS terms, and the Chebyshev terms that it drops."""
    exact = np.stack(
        [np.pad(chebyshev.poly2cheb(unit), (0, ORDER))[:ORDER] for unit in np.eye(ORDER)]
    )
    kept = np.stack([np.pad(chebyshev.cheb2poly(one[:TERMS]), (0, TERMS))[:TERMS] for one in exact])
    return np.ascontiguousarray(kept.T), np.ascontiguousarray(exact.T[TERMS:])


_KEPT, _DROPPED = _economy()


def _bends() -> Floats:
    """By how much each power of s may lower the middle Bezier points of its Hermite cubic.

    With t from 0 to 1 along the step, both differ by no more than b t^2 (1 - t)^2, and that is no
    more than b/4 (t (1 - t)^2 + t^2 (1 - t)): what both middle points add, moved by b/12.
    """
    t = np.linspace(0.0, 1.0, 402)[1:-1]
    power = np.arange(TERMS)[:, np.newaxis]
    s, sign = 2.0 * t - 1.0, (-1.0) ** power
    first = (1.0 - t) ** 2 * ((1.0 + 2.0 * t) * sign - 2.0 * t * power * sign)
    last = t**2 * ((3.0 - 2.0 * t) - 2.0 * (1.0 - t) * power)
    apart = np.abs(s**power - first - last) / (t * (1.0 - t)) ** 2
    # Powers up to the third are cubics themselves; between two samples it is hardly larger.
    bends: Floats = np.where(np.arange(TERMS) > 3, 1.01 * apart.max(axis=1) / 12.0, 0.0)
    return bends


_BENDS = _bends()


class RightSide(NamedTuple):
    """Eq. 13 as matrices: what every state and every forcing adds to rates and gaps.

    ``rates`` (states, states + 3): without mesh stiffness, by state and by drive, sine and cosine
    of the error; ``gaps`` (2, states + 3): both gaps, by the same; ``mobility`` (states, 2): what a
    force of one in the mesh takes away, the axial one with its share of the stiffness.
    """

    rates: Floats
    gaps: Floats
    mobility: Floats


@evaluator
def differentiate(coefficients, right_side, present):
    """Apply the formulas of eq. 13 to one unit after the other."""
    states = right_side.rates.shape[0]
    memory = aligned_memory()
    lane = fill_lane(memory, 0, coefficients)
    zero = Coordinates(0.0, 0.0, 0.0, 0.0, 0.0)
    rest = State(zero, zero)
    for column in range(states + 3):
        for line in range(states):
            memory[(rows.STATE + line) * STRIDE] = 1.0 if line == column else 0.0
        drive = 1.0 if column == states else 0.0
        sine = 1.0 if column == states + 1 else 0.0
        cosine = 1.0 if column == states + 2 else 0.0
        state = read_state(memory, rows.STATE, 0, present)
        acting = forcing_at(lane, Phase(0.0, sine, cosine, -sine), present)
        both = gaps_at(state, lane, acting, present)
        right_side.gaps[0, column] = both.tangential.value
        right_side.gaps[1, column] = both.axial.value
        forces = Directions(
            lane.mesh_damping * both.tangential.rate,
            lane.axial_share * lane.mesh_damping * both.axial.rate,
        )
        result = State(
            state.rate, accelerations(state, forces, drive + acting.drive, lane, present)
        )
        write_state(memory, rows.STATE, 0, result, present)
        for line in range(states):
            right_side.rates[line, column] = memory[(rows.STATE + line) * STRIDE]
    for way in range(2):
        forces = Directions(1.0 - way, lane.axial_share * way)
        result = State(zero, accelerations(rest, forces, 0.0, lane, present))
        write_state(memory, rows.STATE, 0, result, present)
        for line in range(states):
            right_side.mobility[line, way] = memory[(rows.STATE + line) * STRIDE]


def series_of_forcing(system: System, lane: Lane, steps: int) -> Floats:
    """Taylor coefficients about the middle of every step, shape (steps, 3, `ORDER`).

    Of the mesh stiffness (eq. 19), and of sine and cosine of the mesh phase.
    """
    half = np.pi / steps
    middle = (2 * np.arange(steps) + 1)[:, np.newaxis] * half
    term = np.arange(ORDER)
    factor = half**term / np.cumprod(np.maximum(term, 1.0))
    turn = np.exp(1j * middle) * 1j**term * factor
    stiffness = lane.mean_stiffness * (term == 0) * np.ones((steps, 1))
    if system.effects.stiffness_variation:
        for number, amplitude in enumerate(system.stiffness_cosine - 1j * system.stiffness_sine, 1):
            waves = amplitude * np.exp(1j * number * middle) * (1j * number) ** term * factor
            stiffness = stiffness + lane.stiffness_variation * waves.real
    return np.stack([stiffness, turn.imag, turn.real], axis=1)


@evaluator
def fill_maps(right_side, forcing, table, place):
    """Fill the maps of every step, shape (steps, size of a step); return what series leave."""
    tail = 0.0
    for number in range(table.shape[0]):
        for pair in range(place.pairs):
            left = fill_pair(pair, table[number], right_side, forcing[number], place)
            tail = np.maximum(tail, left)
    return tail


@part
def fill_pair(pair, row, right_side, forcing, place):
    """Fill the maps of one step on one pair of branches; return what is left of the series."""
    piece = row[HEADER + pair * place.size : HEADER + (pair + 1) * place.size]
    engaged = (1.0 - pair % 2, 1.0 - pair // 2)
    states = place.states
    columns = place.columns
    stiffness = forcing[0]
    rates, gaps, mobility = right_side
    engaged_gaps = np.zeros((2, states))
    for way in range(2):
        for line in range(states):
            engaged_gaps[way, line] = engaged[way] * gaps[way, line]
    ways = place.ways
    error = states + 1 + ways

    # The motion by column with drive and error below it, the gaps, and the forces times K.
    psi = np.zeros((ORDER + 1, states + 3, columns))
    gap = np.zeros((ORDER, ways, columns))
    force = np.zeros((ways, columns))
    for column in range(states + 1):
        psi[0, column, column] = 1.0
    for k in range(ORDER):
        scale = 0.5 / (k + 1)
        if columns > error:
            psi[k, states + 1, error] = forcing[1, k]
            psi[k, states + 2, error] = forcing[2, k]
        if columns > error + 1:
            psi[k, states + 1, error + 1] = forcing[2, k]
            psi[k, states + 2, error + 1] = -forcing[1, k]
        add_product(1.0, gaps, psi[k], gap[k])
        for way in range(ways):
            for column in range(columns):
                force[way, column] = 0.0
            for j in range(k + 1):
                factor = engaged[way] * stiffness[k - j]
                for column in range(columns):
                    force[way, column] += factor * gap[j, way, column]
            force[way, states + 1 + way] -= stiffness[k]
        add_product(scale, rates, psi[k], psi[k + 1])
        add_product(scale, mobility, force, psi[k + 1])

    # The inverse flow, and with K what it makes of the mobilities.
    inverse = np.zeros((ORDER + 1, states, states))
    moved = np.zeros((ORDER, states, ways))
    switch = np.zeros((ORDER, states, ways))
    for line in range(states):
        inverse[0, line, line] = 1.0
    for k in range(ORDER):
        scale = -0.5 / (k + 1)
        add_product(1.0, inverse[k], mobility, moved[k])
        for j in range(k + 1):
            for line in range(states):
                for way in range(ways):
                    switch[k, line, way] += stiffness[k - j] * moved[j, line, way]
        add_product(scale, inverse[k], rates, inverse[k + 1])
        add_product(scale, switch[k], engaged_gaps, inverse[k + 1])

    first = np.zeros((states, columns))
    last = np.zeros((states, columns))
    back = np.zeros((states, states))
    tail = 0.0
    for k in range(ORDER, -1, -1):
        sign = 1.0 - 2.0 * (k % 2)
        # The first term of the inverse is 1.
        add_product(sign, inverse[0], psi[k], first)
        add_product(1.0, inverse[0], psi[k], last)
        add_product(sign, inverse[0], inverse[k], back)
    for line in range(states):
        for column in range(states):
            tail = np.maximum(tail, abs(psi[ORDER, line, column]))
            tail = np.maximum(tail, abs(inverse[ORDER, line, column]))

    # From the middle of the step to its beginning; a step is 2 long in s.
    end = over_beginning(last, first, back)
    for line in range(states):
        for column in range(columns):
            piece[column * place.width + line] = end[line, column]
    along = over_beginning(gap.reshape((ways * ORDER, columns)), first, back)
    cut, left = economised(along.reshape((ORDER, ways * columns)))
    tail = np.maximum(tail, left)
    traced = np.zeros((ORDER, states, ways))
    for k in range(ORDER):
        add_product(0.5, first, switch[k], traced[k])
    thrown, left = economised(traced.reshape((ORDER, ways * states)))
    tail = np.maximum(tail, left)
    for way in range(ways):
        at = place.gaps[way]
        bound = BOUNDS[way]
        for column in range(columns):
            terms = piece[at + column * TERMS : at + (column + 1) * TERMS]
            bend = 0.0
            for term in range(TERMS):
                terms[term] = cut[term, way * columns + column]
                bend += _BENDS[term] * abs(terms[term])
            row[bound + column] = max(row[bound + column], bend)
        at = place.switches[way]
        for term in range(TERMS):
            for line in range(states):
                piece[at + term * place.width + line] = thrown[term, ways * line + way]
    return tail


@part
def add_product(scale, a, b, target):
    """Add the product of two small matrices, many of whose elements are 0, times a number.

    What one of them has more of than the target or the other one does not count: no axial pair.
    """
    for line in range(min(a.shape[0], target.shape[0])):
        for source in range(min(a.shape[1], b.shape[0])):
            factor = scale * a[line, source]
            if factor != 0.0:
                for column in range(target.shape[1]):
                    target[line, column] += factor * b[source, column]


@part
def over_beginning(rows, first, back):
    """Turn rows over the middle state and forcing into ones over the state at the beginning."""
    states = back.shape[0]
    target = np.zeros(rows.shape)
    for line in range(rows.shape[0]):
        for source in range(states):
            for column in range(states):
                target[line, column] += rows[line, source] * back[source, column]
        for column in range(states, rows.shape[1]):
            target[line, column] = rows[line, column]
        for source in range(states):
            for column in range(states, rows.shape[1]):
                target[line, column] -= target[line, source] * first[source, column]
    return target


@part
def economised(series):
    """Cut Taylor series to fewer terms; return them, and the largest share that is lost."""
    target = np.zeros((TERMS, series.shape[1]))
    lost = np.zeros((ORDER - TERMS, series.shape[1]))
    add_product(1.0, _KEPT, series, target)
    add_product(1.0, _DROPPED, series, lost)
    largest = 1e-300
    most = 0.0
    for column in range(series.shape[1]):
        left = 0.0
        for term in range(lost.shape[0]):
            left += abs(lost[term, column])
        most = np.maximum(most, left)
        for term in range(TERMS):
            largest = np.maximum(largest, abs(target[term, column]))
    return target, most / largest
