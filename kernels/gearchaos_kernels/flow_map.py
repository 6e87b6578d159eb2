"""The flow of eq. 13 over a step, to rounding: one affine map for each pair of contact branches.

On a contact branch eq. 13 is linear, with coefficients that depend on the mesh phase alone. With x
the state at the beginning of a step and c the few numbers that force a lane (load, the offsets of
the engaged flanks, both parts of its pitch error), and s running from -1 to 1 over the step,

    state at its end    Phi x + g c                                   (`END`)
    a gap along it      sum_k s^k (Y_k x + y_k c)                     (`GAP`)
    what a deflection of one for a moment at s adds, traced back to the beginning of the step
                        sum_k s^k p_k = K(s) Phi(s -> -1) u / 2       (`SWITCH`)

The last one carries a lane from a branch to the next (`flow_steps`). All of it depends on the phase
and on the groups other than load, error and clearance: lanes that share those share their maps.

From the Taylor series about the middle of the step, Psi(0) = 1 and Q = Psi^-1,

    Psi' = (C + u_y K e_y w_y + u_z K e_z w_z) Psi / 2,    Q' = -Q (C + ...) / 2,

where C, the mobilities u and the rows w of the gaps come from the formulas of `equations`, applied
to unit vectors, and e is 1 on an engaged flank. Polynomials along the step are cut to fewer terms
as Chebyshev series are. Where the series do not converge to rounding, the step is divided.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from gearchaos_kernels.block_memory import (
    COEFFICIENTS,
    STATE,
    STRIDE,
    Coordinates,
    Lane,
    Present,
    State,
    aligned_memory,
    fill_lane,
    flags,
    load,
    read_state,
    write_state,
)
from gearchaos_kernels.coefficients import lane_coefficients
from gearchaos_kernels.compilation import evaluator, part, scalar
from gearchaos_kernels.equations import (
    Directions,
    accelerations,
    gaps_at,
)
from gearchaos_kernels.forcing import Phase, forcing_at
from gearchaos_kernels.system import Floats, Groups, Plan, System

TERMS = 16
"""Terms of the polynomials along a step."""

ORDER = 26
"""Terms of the Taylor series that they come from."""

BOUND_Y, BOUND_Z, HEADER = 8, 24, 40
"""What stands before the maps of a step: sine and cosine of the mesh phase at its beginning and at
its end; by how much each column may bend either gap beyond a cubic, on any branch."""

TAIL = 2e-15
"""What may be left of the series, relative to their largest term."""

MOST_STEPS = 4096
"""Steps per period beyond which nothing is divided any more."""

MOST_BYTES = 2**27
"""Maps that are kept in memory."""

_UNIT = {
    "load": 0.0,
    "half_backlash": 0.0,
    "error_mean": 0.0,
    "error_amplitude": 1.0,
    "error_phase": 0.0,
}

OWN = [name for name in Groups._fields if name not in _UNIT]
"""Groups on which the maps depend."""


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

_ENGAGED = np.array([[1.0 - pair % 2, 1.0 - pair // 2] for pair in range(4)])
"""Whether the flanks of both directions are engaged, on each pair of branches."""


class Maps(NamedTuple):
    """Maps of several groups of lanes in one array.

    ``table``: all of them; ``steps``, ``starts`` (groups,): steps per period of each, a multiple of
    those asked for, and where its maps begin.
    """

    table: Floats
    steps: NDArray[np.intp]
    starts: NDArray[np.intp]


def sharing(system: System) -> NDArray[np.intp]:
    """Return the number of the group of lanes with the same maps of every lane, shape (lanes,)."""
    rows = _own_groups(system)
    if (rows == rows[:1]).all():
        return np.zeros(len(rows), dtype=np.intp)
    _, number = np.unique(rows, axis=0, return_inverse=True)
    return number.reshape(-1).astype(np.intp)


def maps_memory(system: System, plan: Plan) -> int:
    """Return about how many bytes the maps of lanes that are integrated together take."""
    place: Layout = layout.py_func(flags(system, plan))
    one = 8 * plan.steps_per_period * (HEADER + place.pairs * place.size)
    return min(one * (int(sharing(system).max(initial=0)) + 1), 2 * MOST_BYTES)


_kept: OrderedDict[Hashable, Floats] = OrderedDict()
_joined: dict[Hashable, Maps] = {}


def maps_of(system: System, steps: int, present: Present) -> Maps:
    """Return the maps of the first lanes of a system, as many as fit into memory.

    Those used last are kept: the same lanes may be integrated again and again.
    """
    present = present._replace(tangent=None)
    waves = system.stiffness_cosine, system.stiffness_sine
    scene = (steps, present, system.physical, *(wave.tobytes() for wave in waves))
    rows = [row.tobytes() for row in _own_groups(system)]
    if (scene, *rows) in _joined:
        return _joined[scene, *rows]
    tables: list[Floats] = []
    size = 0
    for number, row in enumerate(rows):
        if (scene, row) not in _kept:
            _kept[scene, row] = _make(system.of([number]), steps, present)
        _kept.move_to_end((scene, row))
        tables.append(_kept[scene, row])
        size += tables[-1].nbytes
        if size > MOST_BYTES:
            break
    while sum(table.nbytes for table in _kept.values()) > MOST_BYTES and len(_kept) > 1:
        _kept.popitem(last=False)
    sizes = np.array([table.size for table in tables], dtype=np.intp)
    joined = Maps(
        np.concatenate([table.reshape(-1) for table in tables]),
        np.array([len(table) for table in tables], dtype=np.intp),
        np.cumsum(sizes) - sizes,
    )
    _joined.clear()
    _joined[scene, *rows] = joined
    return joined


def _own_groups(system: System) -> Floats:
    """Return the groups on which maps depend, shape (lanes, groups)."""
    return np.stack([getattr(system.groups, name) for name in OWN], axis=1)


def _make(system: System, steps: int, present: Present) -> Floats:
    """Make the maps of one lane, shape (steps, size of a step), with steps divided if need be.

    A motion so fast that no steps resolve it has maps that are not a number.
    """
    place: Layout = layout.py_func(present)
    unit = {name: np.full(1, value) for name, value in _UNIT.items()}
    system = system._replace(groups=system.groups._replace(**unit))
    states, count = place.states, steps
    while True:
        coefficients = lane_coefficients(system, system.mesh_period / count)[0]
        right_side = RightSide(
            *(np.zeros(shape) for shape in ((states, states), (states, 3))),
            *(np.zeros(shape) for shape in ((states, 2), (2, states), (2, 3))),
        )
        _differentiate(coefficients, right_side, present)
        forcing = _forcing(system, Lane(*coefficients), count, place.varies)
        table = np.zeros((count, HEADER + place.pairs * place.size))
        edges = 2.0 * np.pi / count * np.arange(count + 1)
        for column, values in enumerate((np.sin(edges), np.cos(edges))):
            table[:, column], table[:, column + 2] = values[:-1], values[1:]
        tails = np.zeros(count)
        _fill_maps(right_side, forcing, _ENGAGED, table, tails, _KEPT, _DROPPED, _BENDS, place)
        if tails.max() < TAIL:
            return table
        if 2 * count > MOST_STEPS or not np.isfinite(coefficients).all():
            return np.full((steps, table.shape[1]), np.nan)
        count *= 2


class RightSide(NamedTuple):
    """Eq. 13 as matrices: what every state and every forcing adds to rates and gaps.

    ``constant`` (states, states), ``forced`` (states, 3): rates without mesh stiffness, by state
    and by drive, sine and cosine of the error; ``mobility`` (states, 2): what a force of one in the
    mesh takes away, the axial one with its share of the stiffness; ``gaps`` (2, states),
    ``gaps_forced`` (2, 3): both gaps, by the same.
    """

    constant: Floats
    forced: Floats
    mobility: Floats
    gaps: Floats
    gaps_forced: Floats


@evaluator
def _differentiate(coefficients, right_side, present):
    """Apply the formulas of eq. 13 to one unit after the other."""
    states = right_side.constant.shape[0]
    memory = aligned_memory()
    fill_lane(memory, 0, coefficients)
    lane = load(memory, COEFFICIENTS, 0, Lane)
    zero = Coordinates(0.0, 0.0, 0.0, 0.0, 0.0)
    rest = State(zero, zero)
    for column in range(states + 3):
        for line in range(states):
            memory[(STATE + line) * STRIDE] = 1.0 if line == column else 0.0
        drive = 1.0 if column == states else 0.0
        sine = 1.0 if column == states + 1 else 0.0
        cosine = 1.0 if column == states + 2 else 0.0
        state = read_state(memory, STATE, 0, present)
        acting = forcing_at(lane, Phase(0.0, sine, cosine), present)
        both = gaps_at(state, lane, acting, present)
        gaps = right_side.gaps
        rates = right_side.constant
        at = column
        if column >= states:
            gaps = right_side.gaps_forced
            rates = right_side.forced
            at = column - states
        gaps[0, at] = both.tangential.value
        gaps[1, at] = both.axial.value
        forces = Directions(
            lane.mesh_damping * both.tangential.rate,
            lane.axial_share * lane.mesh_damping * both.axial.rate,
        )
        result = State(
            state.rate, accelerations(state, forces, drive + acting.drive, lane, present)
        )
        write_state(memory, STATE, 0, result, present)
        for line in range(states):
            rates[line, at] = memory[(STATE + line) * STRIDE]
    for way in range(2):
        forces = Directions(1.0 - way, lane.axial_share * way)
        result = State(zero, accelerations(rest, forces, 0.0, lane, present))
        write_state(memory, STATE, 0, result, present)
        for line in range(states):
            right_side.mobility[line, way] = memory[(STATE + line) * STRIDE]


def _forcing(system: System, lane: Lane, steps: int, varies: bool) -> Floats:
    """Taylor coefficients about the middle of every step, shape (steps, 3, `ORDER`).

    Of the mesh stiffness (eq. 19), and of sine and cosine of the mesh phase.
    """
    half = np.pi / steps
    middle = (2 * np.arange(steps) + 1)[:, np.newaxis] * half
    term = np.arange(ORDER)
    factor = half**term / np.cumprod(np.maximum(term, 1.0))
    turn = np.exp(1j * middle) * 1j**term * factor
    stiffness = lane.mean_stiffness * (term == 0) * np.ones((steps, 1))
    if varies:
        for number, amplitude in enumerate(system.stiffness_cosine - 1j * system.stiffness_sine, 1):
            waves = amplitude * np.exp(1j * number * middle) * (1j * number) ** term * factor
            stiffness = stiffness + lane.stiffness_variation * waves.real
    return np.stack([stiffness, turn.imag, turn.real], axis=1)


@evaluator
def _fill_maps(right_side, forcing, engaged, table, tails, kept, dropped, bends, place):
    """Fill the maps of every step, shape (steps, size of a step)."""
    for number in range(table.shape[0]):
        row = table[number]
        tail = 0.0
        for pair in range(place.pairs):
            at = HEADER + pair * place.size
            piece = row[at : at + place.size]
            left = fill_pair(
                piece, row, right_side, forcing[number], engaged[pair], kept, dropped, bends, place
            )
            tail = larger(tail, left)
        tails[number] = tail


@part
def fill_pair(piece, row, right_side, forcing, engaged, kept, dropped, bends, place):
    """Fill the maps of one step on one pair of branches; return what is left of the series."""
    states = place.states
    columns = place.columns
    stiffness = forcing[0]
    mobility = right_side.mobility
    rows = right_side.gaps
    engaged_rows = np.zeros((2, states))
    for way in range(2):
        for line in range(states):
            engaged_rows[way, line] = engaged[way] * rows[way, line]
    ways = place.ways
    error = states + 1 + ways

    # The motion by column, and what acts on it: gaps, forces times K, drive and error.
    psi = np.zeros((ORDER + 1, states, columns))
    gap = np.zeros((ORDER, ways, columns))
    force = np.zeros((ways, columns))
    inputs = np.zeros((3, columns))
    for column in range(states):
        psi[0, column, column] = 1.0
    for k in range(ORDER):
        scale = 0.5 / (k + 1)
        inputs[0, states] = 1.0 if k == 0 else 0.0
        if columns > error:
            inputs[1, error] = forcing[1, k]
            inputs[2, error] = forcing[2, k]
        if columns > error + 1:
            inputs[1, error + 1] = forcing[2, k]
            inputs[2, error + 1] = -forcing[1, k]
        add_product(1.0, rows, psi[k], gap[k])
        add_product(1.0, right_side.gaps_forced, inputs, gap[k])
        for way in range(ways):
            for column in range(columns):
                force[way, column] = 0.0
            for j in range(k + 1):
                factor = engaged[way] * stiffness[k - j]
                for column in range(columns):
                    force[way, column] += factor * gap[j, way, column]
            force[way, states + 1 + way] -= stiffness[k]
        add_product(scale, right_side.constant, psi[k], psi[k + 1])
        add_product(scale, right_side.forced, inputs, psi[k + 1])
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
        add_product(scale, inverse[k], right_side.constant, inverse[k + 1])
        add_product(scale, switch[k], engaged_rows, inverse[k + 1])

    first = np.zeros((states, columns))
    last = np.zeros((states, columns))
    back = np.zeros((states, states))
    tail = 0.0
    for k in range(ORDER, -1, -1):
        sign = 1.0 - 2.0 * (k % 2)
        for line in range(states):
            for column in range(columns):
                first[line, column] += sign * psi[k, line, column]
                last[line, column] += psi[k, line, column]
            for column in range(states):
                back[line, column] += sign * inverse[k, line, column]
    for line in range(states):
        for column in range(states):
            tail = larger(tail, abs(psi[ORDER, line, column]))
            tail = larger(tail, abs(inverse[ORDER, line, column]))

    # From the middle of the step to its beginning; a step is 2 long in s.
    end = over_beginning(last, first, back)
    for line in range(states):
        for column in range(columns):
            piece[place.end + column * place.width + line] = end[line, column]
    along = over_beginning(gap.reshape((ways * ORDER, columns)), first, back)
    cut, left = economised(along.reshape((ORDER, ways * columns)), kept, dropped)
    tail = larger(tail, left)
    traced = np.zeros((ORDER, states, ways))
    for k in range(ORDER):
        add_product(0.5, first, switch[k], traced[k])
    thrown, left = economised(traced.reshape((ORDER, ways * states)), kept, dropped)
    tail = larger(tail, left)
    for way in range(ways):
        at = place.gap_y if way == 0 else place.gap_z
        bound = BOUND_Y if way == 0 else BOUND_Z
        for column in range(columns):
            terms = piece[at + column * TERMS : at + (column + 1) * TERMS]
            bend = 0.0
            for term in range(TERMS):
                terms[term] = cut[term, way * columns + column]
                bend += bends[term] * abs(terms[term])
            row[bound + column] = max(row[bound + column], bend)
        at = place.switch_y if way == 0 else place.switch_z
        for term in range(TERMS):
            for line in range(states):
                piece[at + term * place.width + line] = thrown[term, ways * line + way]
    return tail


@scalar
def larger(a, b):
    """Return the larger of two numbers, or not a number where one is not."""
    return a if a > b or a != a else b


@part
def add_product(scale, a, b, target):
    """Add the product of two small matrices, many of whose elements are 0, times a number.

    What one of them has more of than the target or the other one does not count: no axial pair.
    """
    for line in range(target.shape[0]):
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
def economised(series, kept, dropped):
    """Cut Taylor series to fewer terms; return them, and the largest share that is lost."""
    target = np.zeros((TERMS, series.shape[1]))
    lost = np.zeros((dropped.shape[0], series.shape[1]))
    add_product(1.0, kept, series, target)
    add_product(1.0, dropped, series, lost)
    largest = 1e-300
    most = 0.0
    for column in range(series.shape[1]):
        left = 0.0
        for term in range(lost.shape[0]):
            left += abs(lost[term, column])
        most = larger(most, left)
        for term in range(TERMS):
            largest = larger(largest, abs(target[term, column]))
    return target, most / largest
