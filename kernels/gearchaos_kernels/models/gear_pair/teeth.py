"""The pitch error of a pair in which every tooth has its own error.

Tooth pair j comes into mesh in mesh period j. Its flanks are too far apart by eps_j, the error of
its driven tooth less that of its driving tooth. The pairs in mesh act in parallel, each with a
contact line of length l, so that the error of the mesh is

    e = sum_j w_j eps_j,    w_j = l_j / sum_i l_i,

in place of the sine of eq. 14. The shares w depend on the mesh phase only and are tabulated. A lane
keeps the errors of the few pairs in mesh; they shift by one pair every mesh period.
"""

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import load, store
from gearchaos_kernels.memory.rows import STRIDE, rows
from gearchaos_kernels.models.gear_pair.forcing import (
    Phase,
    of_lane,
    phase_on_grid,
    phase_table,
    phase_within,
    waves_at,
    waves_between,
)
from gearchaos_kernels.models.gear_pair.tooth_errors import SPLINE_DEGREE, Teeth
from gearchaos_kernels.models.mesh_phase import half_step_angles
from gearchaos_kernels.models.waves import waves_of
from gearchaos_kernels.plan import Floats

if TYPE_CHECKING:
    from gearchaos_kernels.models.gear_pair.pairs import GearPairs

NARROW, MOST_PAIRS = 4, 7
"""Tooth pairs in mesh at once: a faster loop serves up to `NARROW`; `MOST_PAIRS` is the limit."""

ROWS = MOST_PAIRS + len(Phase._fields)
"""Rows of a block: the errors of the pairs, then the mesh phase at the end of the last step."""

NO_TEETH = Teeth(np.zeros((1, 1)), np.zeros((1, 1)), np.zeros(1, np.intp), np.zeros(1), 1, 0.0)
"""Placeholder of a system whose pitch error is that of eq. 14."""


class ToothTables(NamedTuple):
    """Tables over one mesh period on a grid of half steps, the same for all lanes.

    Attributes
    ----------
    phases : array, shape (2 steps + 1, columns)
        See `phase_table`.
    waves : array, shape (2 steps + 1, waves)
        See `waves_of`; no waves if lanes share the harmonics of their stiffness.
    shares : array, shape (2 steps + 1, 3, pairs - 1)
        See `share_table`.
    driving, driven, profile : arrays
        See `Teeth`.
    ahead : int
        See `Teeth.ahead`.
    """

    phases: Floats
    waves: Floats
    shares: Floats
    driving: Floats
    driven: Floats
    profile: NDArray[np.intp]
    ahead: int


def tables_of(system: "GearPairs", steps_per_period: int) -> ToothTables:
    """Return the tables of a system; raise ValueError with too many tooth pairs in mesh."""
    shared = () if system.own_harmonics else (system.stiffness_cosine, system.stiffness_sine)
    phases = phase_table(*(tuple(one) for one in shared or ((), ())), steps_per_period)
    teeth = system.teeth if system.effects.pitch_error and system.teeth is not None else NO_TEETH
    ahead = 0 if teeth is NO_TEETH else teeth.ahead
    return ToothTables(
        phases,
        waves_of(system.flags().orders, half_step_angles(steps_per_period)),
        share_table(teeth, steps_per_period),
        np.ascontiguousarray(teeth.driving, dtype=np.float64),
        np.ascontiguousarray(teeth.driven, dtype=np.float64),
        np.ascontiguousarray(teeth.profile, dtype=np.intp),
        ahead,
    )


def share_table(teeth: Teeth, steps_per_period: int) -> Floats:
    """Return the shares of the pairs in mesh at every half step, shape (2 steps + 1, 3, pairs - 1).

    The second axis has the share and its first and second derivative by the mesh phase in radians.
    The newest pair is left out, since all shares add up to 1. Unused columns are zero. Raises
    ValueError with too many tooth pairs in mesh.
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
    """Return the table of `share_table`; ``share``: the bytes of its cells, which can be hashed."""
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
    """Return the B-spline with knots 0, 1, ..., degree + 1 or a derivative of it, at places x."""
    if derivative:
        below = _basis(x, derivative - 1, degree - 1), _basis(x - 1.0, derivative - 1, degree - 1)
        return below[0] - below[1]
    if degree == 0:
        return ((x >= 0.0) & (x < 1.0)).astype(np.float64)
    left, right = _basis(x, 0, degree - 1), _basis(x - 1.0, 0, degree - 1)
    spline: NDArray[np.float64] = (x * left + (degree + 1 - x) * right) / degree
    return spline


@scalar
def begin_period(memory, slot, index, period, tables, scene):
    """Store the errors of the tooth pairs that are in mesh in a mesh period."""
    if scene.model.teeth is not None:
        profile = tables.profile[index]
        driving = tables.driving[profile]
        driven = tables.driven[profile]
        first = rows(scene).model
        # The error of the newest pair, then those of the others relative to it.
        newest = 0.0
        for place in range(MOST_PAIRS):
            pair = period + tables.ahead - place
            error = driven[pair % driven.shape[0]] - driving[pair % driving.shape[0]] - newest
            memory[(first + place) * STRIDE + slot] = error
            if place == 0:
                newest = error


@scalar
def shares_at(shares, row, scene):
    """Return one row of the table of shares as tuples of numbers, None without teeth."""
    if scene.model.teeth is None:
        return None
    near = three(shares[row], 0)
    if scene.model.wide is None:
        return near, near
    return near, three(shares[row], NARROW - 1)


@scalar
def three(shares, first):
    """Return the shares of three pairs, and their first and second derivatives."""
    return (
        (shares[0, first], shares[0, first + 1], shares[0, first + 2]),
        (shares[1, first], shares[1, first + 1], shares[1, first + 2]),
        (shares[2, first], shares[2, first + 1], shares[2, first + 2]),
    )


@scalar
def grid_at(tables, row, scene):
    """Return the mesh phase and the shares of the tooth pairs at a row of the tables."""
    shares = shares_at(tables.shares, row, scene)
    return phase_on_grid(tables.phases, row), shares, waves_at(tables.waves, row, scene)


@scalar
def grid_within(tables, number, fraction, scene):
    """Return the mesh phase at a fraction of a step, for scenes without errors tooth by tooth."""
    waves = waves_between(tables.waves, number, fraction, scene)
    return phase_within(tables.phases, number, fraction), None, waves


@scalar
def point_at(memory, slot, grid, scene):
    """Return the mesh phase of a lane: with teeth, its error is the weighted sum over the pairs."""
    point, shares, waves = grid
    point = of_lane(memory, slot, point, waves, scene)
    if scene.model.teeth is None:
        return point
    near, far = shares
    first = rows(scene).model
    value, slope, curvature = weigh(memory, slot, first + 1, near)
    if scene.model.wide is not None:
        more = weigh(memory, slot, first + NARROW, far)
        value += more[0]
        slope += more[1]
        curvature += more[2]
    return Phase(point.variation, memory[first * STRIDE + slot] + value, slope, curvature)


@scalar
def first_point(memory, slot, grid, scene):
    """Return the mesh phase at the beginning of a step; with teeth, the one that was kept."""
    if scene.model.teeth is None:
        return point_at(memory, slot, grid, scene)
    return load(memory, rows(scene).model + MOST_PAIRS, slot, Phase)


@scalar
def keep_point(memory, slot, point, scene):
    """With teeth, keep the mesh phase at the end of a step, where the next one begins."""
    if scene.model.teeth is not None:
        store(memory, rows(scene).model + MOST_PAIRS, slot, point)


@scalar
def point_within(memory, slot, tables, number, fraction, scene):
    """Return the mesh phase of a lane at a fraction of a step."""
    waves = waves_between(tables.waves, number, fraction, scene)
    point = of_lane(memory, slot, phase_within(tables.phases, number, fraction), waves, scene)
    if scene.model.teeth is not None:
        half = 0 if fraction < 0.5 else 1
        row = 2 * number + half
        begin = point_at(memory, slot, grid_at(tables, row, scene), scene)
        end = point_at(memory, slot, grid_at(tables, row + 1, scene), scene)
        width = 2.0 * np.pi / (tables.phases.shape[0] - 1)
        point = between(begin, end, 2.0 * fraction - half, width, point)
    return point


@scalar
def weigh(memory, slot, first, shares):
    """Return the weighted errors of three pairs and two derivatives; ``first``: their row."""
    e1 = memory[first * STRIDE + slot]
    e2 = memory[(first + 1) * STRIDE + slot]
    e3 = memory[(first + 2) * STRIDE + slot]
    a, b, c = shares
    return (
        a[0] * e1 + a[1] * e2 + a[2] * e3,
        b[0] * e1 + b[1] * e2 + b[2] * e3,
        c[0] * e1 + c[1] * e2 + c[2] * e3,
    )


@scalar
def between(begin, end, t, width, point):
    """Return a mesh phase with the error interpolated at fraction t between two half steps."""
    # Quintic Hermite interpolation: value, slope and curvature at both ends.
    c1 = width * begin.slope
    c2 = 0.5 * width * width * begin.curvature
    # Value, slope and curvature at the end, less those of the parabola from the beginning.
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
