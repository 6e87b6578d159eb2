"""The pitch error of a pair whose teeth each have their own: shared by the tooth pairs in mesh.

Pair j, one more every mesh period, is too far apart by eps_j, the error of its driven tooth less
that of its driving one. With the contact lines l of all pairs in mesh side by side, the mesh sees

    e = sum_j w_j eps_j,    w_j = l_j / sum_i l_i,

in place of the sine of eq. 14. The shares w belong to the mesh phase alone, and come in tables; a
lane keeps the errors of the few pairs in mesh, which move on by one pair every mesh period.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.block_memory import LANES, MOST_PAIRS, PAIRS, SHARED, STRIDE, load
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.forcing import Phase, Shared
from gearchaos_kernels.system import Floats, Teeth

DEGREE = 5
"""Of the splines between the shares: e'' then has the derivatives that order 4 asks for."""

NO_TEETH = Teeth(np.zeros((1, 1)), np.zeros((1, 1)), np.zeros(1, np.intp), np.zeros(1), 1, 0.0)
"""Stands where the pitch error is that of eq. 14."""

_AT_ONCE = 3
"""Pairs whose errors are weighed in one go."""


def share_table(teeth: Teeth, steps_per_period: int) -> Floats:
    """Return the shares of the pairs in mesh at every half step, shape (2 steps + 1, 3, pairs).

    The share and its first and second derivative by the mesh phase in radians, of all pairs but the
    one that came last, which has the rest, and of pairs that fill up, without a share. Raises
    ValueError with too many in mesh.
    """
    cells = np.ascontiguousarray(teeth.share, dtype=np.float64)
    # The spline of a cell is centred on it; what then begins before period 0 is the next pair.
    entry = (teeth.entry - DEGREE / (2.0 * teeth.cells_per_period)) % 1.0
    return _table(cells.tobytes(), teeth.cells_per_period, entry, steps_per_period)


@lru_cache(maxsize=8)
def _table(share: bytes, cells_per_period: int, entry: float, steps: int) -> Floats:
    cells = np.frombuffer(share)
    pairs = int(np.ceil((cells.size + DEGREE) / cells_per_period + entry))
    if pairs > MOST_PAIRS:
        raise ValueError(f"{pairs} tooth pairs in mesh at once, more than {MOST_PAIRS}")
    pairs += -(pairs - 1) % _AT_ONCE
    phase = np.arange(2 * steps + 1)[:, np.newaxis] / (2 * steps)
    place = cells_per_period * (phase + np.arange(pairs) - entry)
    whole = np.floor(place)
    number = np.clip(whole.astype(np.intp), -1, cells.size + DEGREE)
    padded = np.pad(cells, (DEGREE + 1, DEGREE + 1))
    table = np.zeros((2 * steps + 1, 3, pairs))
    for back in range(DEGREE + 1):
        cell = padded[number - back + DEGREE + 1]
        for order in range(3):
            slope = (cells_per_period / (2.0 * np.pi)) ** order
            table[:, order] += slope * cell * _basis(place - whole + back, order)
    return np.ascontiguousarray(table[:, :, 1:])


def _basis(x: Floats, derivative: int, degree: int = DEGREE) -> Floats:
    """Return the spline of unit knots that is not zero from 0 to its degree + 1."""
    if derivative:
        below = _basis(x, derivative - 1, degree - 1), _basis(x - 1.0, derivative - 1, degree - 1)
        return below[0] - below[1]
    if degree == 0:
        return ((x >= 0.0) & (x < 1.0)).astype(np.float64)
    left, right = _basis(x, 0, degree - 1), _basis(x - 1.0, 0, degree - 1)
    spline: NDArray[np.float64] = (x * left + (degree + 1 - x) * right) / degree
    return spline


@scalar
def engage(memory, slot, driving, driven, period):
    """Store the errors of the pairs in mesh: that of the last one to come, the rest less that."""
    newest = 0.0
    for place in range(MOST_PAIRS):
        pair = period - place
        error = driven[pair % driven.shape[0]] - driving[pair % driving.shape[0]] - newest
        memory[(PAIRS + place) * STRIDE + slot] = error
        if place == 0:
            newest = error


@scalar
def share_errors(memory, shares, row, half):
    """Weigh the errors of the pairs in mesh in every slot, at one of the three phases of a step."""
    weigh(memory, shares[row], half, 0)
    if shares.shape[2] > _AT_ONCE:
        weigh(memory, shares[row], half, _AT_ONCE)


@scalar
def weigh(memory, shares, half, first):
    """Weigh the errors of three pairs, and add what others have."""
    a1, a2, a3 = shares[0, first], shares[0, first + 1], shares[0, first + 2]
    b1, b2, b3 = shares[1, first], shares[1, first + 1], shares[1, first + 2]
    c1, c2, c3 = shares[2, first], shares[2, first + 1], shares[2, first + 2]
    at = (SHARED + 3 * half) * STRIDE
    for slot in range(LANES):
        value = memory[PAIRS * STRIDE + slot]
        slope = 0.0
        curvature = 0.0
        if first > 0:
            value = memory[at + slot]
            slope = memory[at + STRIDE + slot]
            curvature = memory[at + 2 * STRIDE + slot]
        e1 = memory[(PAIRS + first + 1) * STRIDE + slot]
        e2 = memory[(PAIRS + first + 2) * STRIDE + slot]
        e3 = memory[(PAIRS + first + 3) * STRIDE + slot]
        memory[at + slot] = value + a1 * e1 + a2 * e2 + a3 * e3
        memory[at + STRIDE + slot] = slope + b1 * e1 + b2 * e2 + b3 * e3
        memory[at + 2 * STRIDE + slot] = curvature + c1 * e1 + c2 * e2 + c3 * e3


@scalar
def share_step(memory, shares, number):
    """Prepare a step: its begin is the end of the one before, its middle and end are new."""
    for order in range(3):
        for slot in range(LANES):
            end = memory[(SHARED + 6 + order) * STRIDE + slot]
            memory[(SHARED + order) * STRIDE + slot] = end
    share_errors(memory, shares, 2 * number + 1, 1)
    share_errors(memory, shares, 2 * number + 2, 2)


@scalar
def with_teeth(memory, slot, half, point, present):
    """Return one of the three mesh phases of a step with the error that its teeth share, if any."""
    if present.teeth is None:
        return point
    shared = load(memory, SHARED + 3 * half, slot, Shared)
    return Phase(point.variation, shared.value, shared.slope, shared.curvature)


@scalar
def with_teeth_within(memory, slot, fraction, point, rows, present):
    """Return the mesh phase at a fraction of a step with the error that its teeth share, if any.

    Between two half steps, of which there are so many rows a period, it is the polynomial of order
    5 through value, slope and curvature at both.
    """
    if present.teeth is None:
        return point
    half = 0 if fraction < 0.5 else 1
    width = 2.0 * math.pi / (rows - 1)
    t = 2.0 * fraction - half
    begin = load(memory, SHARED + 3 * half, slot, Shared)
    end = load(memory, SHARED + 3 * half + 3, slot, Shared)
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
