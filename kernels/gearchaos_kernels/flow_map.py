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
from typing import NamedTuple

import numpy as np
from numba import prange
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
    load,
    read_state,
    write_state,
)
from gearchaos_kernels.coefficients import lane_coefficients
from gearchaos_kernels.compilation import driver, scalar
from gearchaos_kernels.equations import (
    Directions,
    accelerations,
    gaps_at,
    tangent_forces,
)
from gearchaos_kernels.forcing import Forcing, Phase, forcing_at
from gearchaos_kernels.system import Floats, System

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

MOST_BYTES = 2**28
"""Maps that are kept in memory."""

SAMPLES = 48
"""Places at which a polynomial is compared with its cubic."""

OWN = (
    "mesh_frequency damping_ratio base_helix_angle stiffness_variation_scale mass_ratio_p "
    "mass_ratio_g transverse_stiffness_p transverse_damping_p transverse_stiffness_g "
    "transverse_damping_g axial_stiffness_p axial_damping_p axial_stiffness_g axial_damping_g"
).split()
"""Groups on which the maps depend."""

_UNIT = {
    "load": 0.0,
    "half_backlash": 0.0,
    "error_mean": 0.0,
    "error_amplitude": 1.0,
    "error_phase": 0.0,
}


class Layout(NamedTuple):
    """Where the parts of the maps of one step and one pair of branches stand, in numbers.

    ``columns``: those of x and then those of c: load, offset of the tangential and of the axial
    flank, sine and cosine part of the pitch error, as far as the scene has them; ``width``: of a
    state, so that it fills vector registers; ``pairs``: of branches.
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
    )


@scalar
def step_size(present):
    """Return how many numbers the maps of one step take."""
    place = layout(present)
    return HEADER + place.pairs * place.size


def _economy() -> tuple[Floats, Floats]:
    """What cuts a Taylor series (ORDER,) to TERMS terms, and the Chebyshev terms that it drops."""
    exact = np.stack([np.pad(chebyshev.poly2cheb(unit), (0, ORDER))[:ORDER] for unit in np.eye(ORDER)])
    kept = np.stack([np.pad(chebyshev.cheb2poly(one[:TERMS]), (0, TERMS))[:TERMS] for one in exact])
    return np.ascontiguousarray(kept.T), np.ascontiguousarray(exact.T[TERMS:])


_KEPT, _DROPPED = _economy()


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
    rows = np.stack([getattr(system.groups, name) for name in OWN], axis=1)
    _, number = np.unique(rows, axis=0, return_inverse=True)
    return number.reshape(-1).astype(np.intp)


_kept: OrderedDict[tuple[object, ...], Floats] = OrderedDict()


def maps_of(system: System, steps: int, present: Present) -> Maps:
    """Return the maps of the first lanes of a system, as many as fit into memory.

    Those used last are kept: the same lanes may be integrated again and again.
    """
    scene = (
        steps,
        present._replace(tangent=None),
        system.physical,
        system.stiffness_cosine.tobytes(),
        system.stiffness_sine.tobytes(),
    )
    rows = np.stack([getattr(system.groups, name) for name in OWN], axis=1)
    tables: list[Floats] = []
    size = 0
    for number, row in enumerate(rows):
        key = (*scene, row.tobytes())
        if key not in _kept:
            _kept[key] = _make(system.of([number]), steps, present._replace(tangent=None))
        _kept.move_to_end(key)
        tables.append(_kept[key])
        size += tables[-1].nbytes
        if size > MOST_BYTES:
            break
    while sum(table.nbytes for table in _kept.values()) > MOST_BYTES and len(_kept) > 1:
        _kept.popitem(last=False)
    counts = np.array([len(table) for table in tables], dtype=np.intp)
    sizes = np.array([table.size for table in tables], dtype=np.intp)
    flat = [table.reshape(-1) for table in tables]
    joined = flat[0] if len(flat) == 1 else np.concatenate(flat)
    return Maps(joined, counts, np.cumsum(sizes) - sizes)


def _make(system: System, steps: int, present: Present) -> Floats:
    """Make the maps of one lane, shape (steps, size of a step), with steps divided if need be."""
    place: Layout = layout.py_func(present)
    unit = {name: np.full(1, value) for name, value in _UNIT.items()}
    system = system._replace(groups=system.groups._replace(**unit))
    waves = np.stack([system.stiffness_cosine, system.stiffness_sine])
    count = steps
    while True:
        coefficients = lane_coefficients(system, system.mesh_period / count)[0]
        table = np.zeros((count, HEADER + place.pairs * place.size))
        tails = np.zeros(count)
        _fill_maps(coefficients, waves, table, tails, _KEPT, _DROPPED, *present)
        if tails.max() < TAIL:
            return table
        if 2 * count > MOST_STEPS or not np.isfinite(coefficients).all():
            raise ValueError(
                f"no {count} steps per mesh period are so short that the motion can be told"
            )
        count *= 2


@driver
def _fill_maps(
    coefficients,
    waves,
    table,
    tails,
    kept,
    dropped,
    pitch_error,
    phase,
    stiffness_variation,
    backlash,
    transverse,
    axial,
    resolved,
    tangent,
    flow_map,
):
    """Fill the maps of every step, shape (steps, size of a step)."""
    for number in prange(table.shape[0]):
        present = Present(
            pitch_error,
            phase,
            stiffness_variation,
            backlash,
            transverse,
            axial,
            resolved,
            tangent,
            flow_map,
        )
        tails[number] = fill_step(coefficients, waves, number, table, kept, dropped, present)


@scalar
def fill_step(coefficients, waves, number, table, kept, dropped, present):
    """Fill the maps of one step; return what is left of the series."""
    row = table[number]
    steps = table.shape[0]
    place = layout(present)
    memory = aligned_memory()
    memory[:] = 0.0
    fill_lane(memory, 0, coefficients)
    lane = load(memory, COEFFICIENTS, 0, Lane)
    right_side = differentiated(memory, lane, present)
    half = np.pi / steps
    middle = (2 * number + 1) * half
    # Taylor coefficients of mesh stiffness, sine and cosine about the middle of the step.
    forcing = np.zeros((3, ORDER))
    forcing[0, 0] = lane.mean_stiffness
    if present.stiffness_variation is not None:
        for harmonic in range(1, waves.shape[1] + 1):
            wave = lane.stiffness_variation * (waves[0, harmonic - 1] - 1j * waves[1, harmonic - 1])
            wave *= np.exp(1j * harmonic * middle)
            for term in range(ORDER):
                forcing[0, term] += wave.real
                wave *= 1j * harmonic * half / (term + 1)
    turn = np.exp(1j * middle)
    for term in range(ORDER):
        forcing[1, term] = turn.imag
        forcing[2, term] = turn.real
        turn *= 1j * half / (term + 1)
    begin = 2 * number * half
    row[0] = np.sin(begin)
    row[1] = np.cos(begin)
    row[2] = np.sin(begin + 2.0 * half)
    row[3] = np.cos(begin + 2.0 * half)
    tail = 0.0
    for pair in range(place.pairs):
        engaged_y = 1.0 - pair % 2
        engaged_z = 1.0 - pair // 2
        at = HEADER + pair * place.size
        part = row[at : at + place.size]
        found = fill_pair(
            part, row, right_side, forcing, engaged_y, engaged_z, kept, dropped, place, present
        )
        # Also where it is not a number.
        tail = tail if found <= tail else found
    return tail


@scalar
def differentiated(memory, lane, present):
    """Return eq. 13 as a matrix: what every state and every forcing adds to rates and gaps.

    ``constant`` (states, states + 3): without mesh stiffness, by state, drive, sine and cosine of
    the error; ``mobility`` (2, states): what a force of one in the mesh takes away, the axial one
    with its share of the stiffness; ``gaps`` (2, states + 3): rows of both gaps.
    """
    place = layout(present)
    states = place.states
    constant = np.zeros((states, states + 3))
    mobility = np.zeros((2, states))
    gaps = np.zeros((2, states + 3))
    zero = Coordinates(0.0, 0.0, 0.0, 0.0, 0.0)
    rest = State(zero, zero)
    for column in range(states + 3):
        memory[: states * STRIDE] = 0.0
        phase = Phase(0.0, 0.0, 0.0)
        drive = 0.0
        if column < states:
            memory[(STATE + column) * STRIDE] = 1.0
        elif column == states:
            drive = 1.0
        elif column == states + 1:
            phase = Phase(0.0, 1.0, 0.0)
        else:
            phase = Phase(0.0, 0.0, 1.0)
        state = read_state(memory, STATE, 0, present)
        acting = forcing_at(lane, phase, present)
        both = gaps_at(state, lane, acting, present)
        gaps[0, column] = both.tangential.value
        gaps[1, column] = both.axial.value
        forces = Directions(
            lane.mesh_damping * both.tangential.rate,
            lane.axial_share * lane.mesh_damping * both.axial.rate,
        )
        result = State(state.rate, accelerations(state, forces, drive + acting.drive, lane, present))
        write_state(memory, STATE, 0, result, present)
        for line in range(states):
            constant[line, column] = memory[(STATE + line) * STRIDE]
    for way in range(2):
        forces = Directions(1.0 - way, lane.axial_share * way)
        result = State(zero, accelerations(rest, forces, 0.0, lane, present))
        write_state(memory, STATE, 0, result, present)
        for line in range(states):
            mobility[way, line] = memory[(STATE + line) * STRIDE]
    return constant, mobility, gaps


@scalar
def fill_pair(part, row, right_side, forcing, engaged_y, engaged_z, kept, dropped, place, present):
    """Fill the maps of one step on one pair of branches; return what is left of the series."""
    constant, mobility, rows = right_side
    states = place.states
    columns = place.columns
    ways = 1
    offset_z = -1
    error = states + 2
    if present.axial is not None:
        ways = 2
        offset_z = states + 2
        error = states + 3
    engaged = (engaged_y, engaged_z)
    offset = (states + 1, offset_z)

    # The motion by column: psi_k of the state, gap_k and with K the force of each direction.
    psi = np.zeros((ORDER + 1, states, columns))
    gap = np.zeros((ORDER, 2, columns))
    force = np.zeros((ORDER, 2, columns))
    inputs = np.zeros((3, columns))
    for column in range(states):
        psi[0, column, column] = 1.0
    for k in range(ORDER):
        inputs[:] = 0.0
        inputs[0, states] = 1.0 if k == 0 else 0.0
        if present.pitch_error is not None:
            inputs[1, error] = forcing[1, k]
            inputs[2, error] = forcing[2, k]
            if present.phase is not None:
                inputs[1, error + 1] = forcing[2, k]
                inputs[2, error + 1] = -forcing[1, k]
        for way in range(ways):
            for column in range(columns):
                value = 0.0
                for line in range(states):
                    value += rows[way, line] * psi[k, line, column]
                gap[k, way, column] = value + rows[way, states + 1] * inputs[1, column]
            for j in range(k + 1):
                stiffness = engaged[way] * forcing[0, k - j]
                for column in range(columns):
                    force[k, way, column] += stiffness * gap[j, way, column]
            force[k, way, offset[way]] -= forcing[0, k]
        scale = 0.5 / (k + 1)
        for line in range(states):
            for column in range(columns):
                value = mobility[0, line] * force[k, 0, column]
                value += mobility[1, line] * force[k, 1, column]
                for source in range(3):
                    value += constant[line, states + source] * inputs[source, column]
                for source in range(states):
                    value += constant[line, source] * psi[k, source, column]
                psi[k + 1, line, column] = scale * value

    # The inverse flow, and with K what it makes of the mobilities.
    inverse = np.zeros((ORDER + 1, states, states))
    moved = np.zeros((ORDER, 2, states))
    switch = np.zeros((ORDER, 2, states))
    for line in range(states):
        inverse[0, line, line] = 1.0
    for k in range(ORDER):
        for way in range(ways):
            for line in range(states):
                value = 0.0
                for source in range(states):
                    value += inverse[k, line, source] * mobility[way, source]
                moved[k, way, line] = value
                value = 0.0
                for j in range(k + 1):
                    value += forcing[0, k - j] * moved[j, way, line]
                switch[k, way, line] = value
        scale = -0.5 / (k + 1)
        for line in range(states):
            for column in range(states):
                value = 0.0
                for way in range(ways):
                    value += engaged[way] * switch[k, way, line] * rows[way, column]
                for source in range(states):
                    value += inverse[k, line, source] * constant[source, column]
                inverse[k + 1, line, column] = scale * value

    first = np.zeros((states, columns))
    last = np.zeros((states, columns))
    back = np.zeros((states, states))
    tail = 0.0
    for k in range(ORDER, -1, -1):
        sign = 1.0 - 2.0 * (k % 2)
        first += sign * psi[k]
        last += psi[k]
        back += sign * inverse[k]
    for line in range(states):
        for column in range(states):
            tail = larger(tail, abs(psi[ORDER, line, column]))
            tail = larger(tail, abs(inverse[ORDER, line, column]))

    # From the middle of the step to its beginning.
    end = part[place.end : place.end + columns * place.width].reshape((columns, place.width))
    for line in range(states):
        begun(last[line], first, back, states, columns, end[:, line])
    cut = np.zeros((ORDER, columns))
    for way in range(ways):
        at = place.gap_y if way == 0 else place.gap_z
        target = part[at : at + columns * TERMS].reshape((columns, TERMS))
        for k in range(ORDER):
            begun(gap[k, way], first, back, states, columns, cut[k])
        largest = 0.0
        lost = 0.0
        for column in range(columns):
            left = economise(cut[:, column], kept, dropped, target[column])
            lost = larger(lost, left)
            largest = larger(largest, np.max(np.abs(cut[:, column])))
        tail = larger(tail, lost / largest)
        at = BOUND_Y if way == 0 else BOUND_Z
        for column in range(columns):
            row[at + column] = max(row[at + column], beyond_cubic(target[column]))
        at = place.switch_y if way == 0 else place.switch_z
        target = part[at : at + TERMS * place.width].reshape((TERMS, place.width))
        traced = np.zeros((states, ORDER))
        largest = 1e-300
        lost = 0.0
        for line in range(states):
            for k in range(ORDER):
                value = 0.0
                for source in range(states):
                    value += first[line, source] * switch[k, way, source]
                # Half of it: the step is 2 long in s.
                traced[line, k] = 0.5 * value
            left = economise(traced[line], kept, dropped, target[:, line])
            lost = larger(lost, left)
            largest = larger(largest, np.max(np.abs(traced[line])))
        tail = larger(tail, lost / largest)
    return tail


@scalar
def larger(a, b):
    """Return the larger of two numbers, or not a number where one is not."""
    return a if a > b or a != a else b


@scalar
def begun(row, first, back, states, columns, target):
    """Turn a row over state in the middle and forcing into one over the state at the beginning."""
    for column in range(states):
        value = 0.0
        for source in range(states):
            value += row[source] * back[source, column]
        target[column] = value
    for column in range(states, columns):
        value = row[column]
        for source in range(states):
            value -= target[source] * first[source, column]
        target[column] = value


@scalar
def economise(series, kept, dropped, target):
    """Cut a Taylor series to fewer terms; return the sum of the Chebyshev terms that are lost."""
    for term in range(TERMS):
        value = 0.0
        for k in range(ORDER):
            value += kept[term, k] * series[k]
        target[term] = value
    lost = 0.0
    for term in range(ORDER - TERMS):
        value = 0.0
        for k in range(ORDER):
            value += dropped[term, k] * series[k]
        lost += abs(value)
    return lost


@scalar
def beyond_cubic(terms):
    """Return by how much a polynomial may lower the middle Bezier points of its Hermite cubic.

    With t from 0 to 1 along the step, both differ by no more than b t^2 (1 - t)^2, and that is no
    more than b/4 (t (1 - t)^2 + t^2 (1 - t)): what both middle points add, moved by b/12.
    """
    values = np.zeros(2)
    slopes = np.zeros(2)
    for end in range(2):
        s = 2.0 * end - 1.0
        power = 1.0
        for term in range(TERMS):
            values[end] += terms[term] * power
            slopes[end] += term * terms[term] * power * s
            power *= s
    most = 0.0
    for number in range(1, SAMPLES):
        t = number / SAMPLES
        left = 1.0 - t
        value = 0.0
        for term in range(TERMS - 1, -1, -1):
            value = value * (2.0 * t - 1.0) + terms[term]
        cubic = left * left * ((1.0 + 2.0 * t) * values[0] + 2.0 * t * slopes[0])
        cubic += t * t * ((1.0 + 2.0 * left) * values[1] - 2.0 * left * slopes[1])
        most = max(most, abs(value - cubic) / (t * left) ** 2)
    # Between two samples it is hardly larger than at them.
    return 1.05 * most / 12.0
