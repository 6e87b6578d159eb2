"""The pitch error of a pair whose teeth each have their own: shared by the tooth pairs in mesh.

Pair j, one more every mesh period, is too far apart by eps_j, the error of its driven tooth less
that of its driving one. With the contact lines l of all pairs in mesh side by side, the mesh sees

    e = sum_j w_j eps_j,    w_j = l_j / sum_i l_i,

in place of the sine of eq. 14. The shares w belong to the mesh phase alone, and come in tables; a
lane keeps the errors of the few pairs in mesh, which move on by one pair every mesh period.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.block_memory import Present
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.forcing import Phase, phase_on_grid, phase_table
from gearchaos_kernels.rows import MOST_PAIRS, NARROW, PAIRS, STRIDE
from gearchaos_kernels.system import SPLINE_DEGREE, Floats, System, Teeth

NO_TEETH = Teeth(np.zeros((1, 1)), np.zeros((1, 1)), np.zeros(1, np.intp), np.zeros(1), 1, 0.0)
"""Stands where the pitch error is that of eq. 14."""


def tables_of(system: System, present: Present, steps_per_period: int) -> tuple[Any, ...]:
    """Return the phase table of a system, that of the shares, its errors and profile: see `Teeth`.

    Raises ValueError with too many pairs in mesh.
    """
    waves = tuple(system.stiffness_cosine), tuple(system.stiffness_sine)
    phases = phase_table(*waves, steps_per_period)
    teeth = NO_TEETH if present.teeth is None or system.teeth is None else system.teeth
    errors = (np.ascontiguousarray(gear, np.float64) for gear in (teeth.driving, teeth.driven))
    profile = np.ascontiguousarray(teeth.profile, dtype=np.intp)
    return phases, share_table(teeth, steps_per_period), *errors, profile


def share_table(teeth: Teeth, steps_per_period: int) -> Floats:
    """Return the shares of the pairs in mesh at every half step, shape (2 steps + 1, 3, pairs).

    The share and its first and second derivative by the mesh phase in radians, of all pairs but the
    one that came last, which has the rest, and of pairs that fill up, without a share. Raises
    ValueError with too many in mesh.
    """
    if teeth is NO_TEETH:
        return np.zeros((1, 3, NARROW - 1))
    most = teeth.pairs_in_mesh
    if most > MOST_PAIRS:
        raise ValueError(f"{most} tooth pairs in mesh at once, more than {MOST_PAIRS}")
    share = np.ascontiguousarray(teeth.share, dtype=np.float64).tobytes()
    pairs = NARROW if most <= NARROW else MOST_PAIRS
    begins = teeth.begins + teeth.ahead
    return _table(share, teeth.cells_per_period, begins, pairs, steps_per_period)


@lru_cache(maxsize=8)
def _table(share: bytes, cells_per_period: int, begins: float, pairs: int, steps: int) -> Floats:
    cells = np.frombuffer(share)
    phase = np.arange(2 * steps + 1)[:, np.newaxis] / (2 * steps)
    place = cells_per_period * (phase + np.arange(pairs) - begins)
    whole = np.floor(place)
    number = np.clip(whole.astype(np.intp), -1, cells.size + SPLINE_DEGREE)
    padded = np.pad(cells, (SPLINE_DEGREE + 1, SPLINE_DEGREE + 1))
    table = np.zeros((2 * steps + 1, 3, pairs))
    for back in range(SPLINE_DEGREE + 1):
        cell = padded[number - back + SPLINE_DEGREE + 1]
        for order in range(3):
            slope = (cells_per_period / (2.0 * np.pi)) ** order
            table[:, order] += slope * cell * _basis(place - whole + back, order)
    return np.ascontiguousarray(table[:, :, 1:])


def _basis(x: Floats, derivative: int, degree: int = SPLINE_DEGREE) -> Floats:
    """Return the spline of unit knots that is not zero from 0 to its degree + 1."""
    if derivative:
        below = _basis(x, derivative - 1, degree - 1), _basis(x - 1.0, derivative - 1, degree - 1)
        return below[0] - below[1]
    if degree == 0:
        return ((x >= 0.0) & (x < 1.0)).astype(np.float64)
    left, right = _basis(x, 0, degree - 1), _basis(x - 1.0, 0, degree - 1)
    spline: NDArray[np.float64] = (x * left + (degree + 1 - x) * right) / degree
    return spline


def last_pair(system: System, period: int) -> int:
    """Return the number of the pair that is the last one to come into mesh in a mesh period."""
    return period if system.teeth is None else period + system.teeth.ahead


@scalar
def engage(memory, slot, driving, driven, last):
    """Store the errors of the pairs in mesh: that of the last one to come, the rest less that."""
    newest = 0.0
    for place in range(MOST_PAIRS):
        pair = last - place
        error = driven[pair % driven.shape[0]] - driving[pair % driving.shape[0]] - newest
        memory[(PAIRS + place) * STRIDE + slot] = error
        if place == 0:
            newest = error


@scalar
def shares_at(shares, row, present):
    """Return one row of the table as numbers that every slot reads, None without teeth."""
    if present.teeth is None:
        return None
    near = three(shares[row], 0)
    if present.wide is None:
        return near, near
    return near, three(shares[row], NARROW - 1)


@scalar
def three(shares, first):
    """Return the shares of three pairs with their derivatives."""
    return (
        (shares[0, first], shares[0, first + 1], shares[0, first + 2]),
        (shares[1, first], shares[1, first + 1], shares[1, first + 2]),
        (shares[2, first], shares[2, first + 1], shares[2, first + 2]),
    )


@scalar
def on_grid(table, shares, row, present):
    """Return the mesh phase at a row of both tables, and the shares of the teeth there."""
    return phase_on_grid(table, row), shares_at(shares, row, present)


@scalar
def with_teeth(memory, slot, grid, present):
    """Return a mesh phase with the error that the teeth share, if they have their own."""
    point, shares = grid
    if present.teeth is None:
        return point
    near, far = shares
    value, slope, curvature = weigh(memory, slot, 1, near)
    if present.wide is not None:
        more = weigh(memory, slot, NARROW, far)
        value += more[0]
        slope += more[1]
        curvature += more[2]
    return Phase(point.variation, memory[PAIRS * STRIDE + slot] + value, slope, curvature)


@scalar
def point_on_grid(memory, slot, table, shares, row, present):
    """Return the mesh phase of a lane at a row of both tables."""
    return with_teeth(memory, slot, on_grid(table, shares, row, present), present)


@scalar
def weigh(memory, slot, first, shares):
    """Weigh the errors of three pairs."""
    e1 = memory[(PAIRS + first) * STRIDE + slot]
    e2 = memory[(PAIRS + first + 1) * STRIDE + slot]
    e3 = memory[(PAIRS + first + 2) * STRIDE + slot]
    a, b, c = shares
    return (
        a[0] * e1 + a[1] * e2 + a[2] * e3,
        b[0] * e1 + b[1] * e2 + b[2] * e3,
        c[0] * e1 + c[1] * e2 + c[2] * e3,
    )


@scalar
def between(begin, end, t, width, point):
    """Return a mesh phase with the error at a fraction of the width between two half steps."""
    # The polynomial of order 5 through value, slope and curvature at both.
    c1 = width * begin.slope
    c2 = 0.5 * width * width * begin.curvature
    # What the parabola at the beginning leaves of value, slope and curvature at the end.
    value = end.value - begin.value - c1 - c2
    slope = width * end.slope - c1 - 2.0 * c2
    curvature = 0.5 * width * width * end.curvature - c2
    c3 = 10.0 * value - 4.0 * slope + curvature
    c4 = 7.0 * slope - 15.0 * value - 2.0 * curvature
    c5 = 6.0 * value - 3.0 * slope + curvature
    return Phase(
        point.variation,
        begin.value + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
        (c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))) / width,
        (2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))) / (width * width),
    )
