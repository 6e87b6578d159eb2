"""A block of lanes in memory: which row holds which number, and how the inner loop reads it.

A lane is one parameter value of the batch. A block holds ``LANES`` of them as a structure of
arrays, one flat array in which row r of lane l is element ``r * STRIDE + l``: one base pointer and
constant distances, so that the compiler can prove that the loop over lanes vectorises.

Coordinates are *scaled* so that the mesh force enters every equation with coefficient -1 (beta_b:
base helix angle, mu: mass ratio)::

    torsion = delta_5 / cos(beta_b)
    transverse_p = delta_1 / (mu_p cos(beta_b))    transverse_g = -delta_2 / (mu_g cos(beta_b))
    axial_p = delta_3 / (mu_p sin(beta_b))         axial_g = -delta_4 / (mu_g sin(beta_b))

and rates are displacements per step (h times d/d tau).
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar

LANES = 32
"""Lanes of one block: a few vectors wide, small enough for the first-level cache."""

STRIDE = LANES + 8
"""Distance between rows: no two rows fall on the same cache set at a distance of 4096 bytes."""

COORDINATES = 5
POSITION, RATE, TANGENT_POSITION, TANGENT_RATE = 0, 5, 10, 15
"""First row of each group of coordinates, in the order of `Coordinates`."""

STATES = 2 * COORDINATES
TANGENT = STATES
"""First row of the tangent vector."""

BEFORE = 2 * STATES
"""First row of a copy of all that, as it was before the step."""

COEFFICIENT = 2 * BEFORE
"""First row of the coefficients, in the order of `Lane`."""


Number: TypeAlias = float | NDArray[np.float64]


class Coordinates(NamedTuple):
    """One number for each of the five scaled coordinates; 0 for those a scene leaves out."""

    torsion: float
    transverse_p: float
    transverse_g: float
    axial_p: float
    axial_g: float


class Lane(NamedTuple):
    """Coefficients of one lane (numbers) or of many (arrays), per step; see `coefficients`."""

    mass_ratio_p: Number
    mass_ratio_g: Number
    transverse_damping_p: Number
    transverse_damping_g: Number
    transverse_stiffness_p: Number
    transverse_stiffness_g: Number
    axial_damping_p: Number
    axial_damping_g: Number
    axial_stiffness_p: Number
    axial_stiffness_g: Number
    mean_stiffness: Number
    stiffness_variation: Number
    mesh_damping: Number
    axial_share: Number
    half_backlash: Number
    load: Number
    error_inertia: Number
    error_mean: Number
    error_amplitude: Number
    error_rate: Number
    axial_error_mean: Number
    axial_error_amplitude: Number
    axial_error_rate: Number
    cos_phase: Number
    sin_phase: Number


BRANCH = COEFFICIENT + len(Lane._fields)
"""First row of the active contact branches, in the order of `contact.Branches`."""

SUSPECT = BRANCH + 8
"""Row that marks the lanes whose step may have left a contact branch."""

GROWTH = SUSPECT + 1
"""Row of the logarithm of the tangent vector's growth since the period began."""

ROWS = GROWTH + 1


@scalar
def read_lane(block, lane):
    """Return the coefficients of one lane; those that a scene does not use cost nothing."""
    first = COEFFICIENT * STRIDE + lane
    return Lane(
        block[first],
        block[first + STRIDE],
        block[first + 2 * STRIDE],
        block[first + 3 * STRIDE],
        block[first + 4 * STRIDE],
        block[first + 5 * STRIDE],
        block[first + 6 * STRIDE],
        block[first + 7 * STRIDE],
        block[first + 8 * STRIDE],
        block[first + 9 * STRIDE],
        block[first + 10 * STRIDE],
        block[first + 11 * STRIDE],
        block[first + 12 * STRIDE],
        block[first + 13 * STRIDE],
        block[first + 14 * STRIDE],
        block[first + 15 * STRIDE],
        block[first + 16 * STRIDE],
        block[first + 17 * STRIDE],
        block[first + 18 * STRIDE],
        block[first + 19 * STRIDE],
        block[first + 20 * STRIDE],
        block[first + 21 * STRIDE],
        block[first + 22 * STRIDE],
        block[first + 23 * STRIDE],
        block[first + 24 * STRIDE],
    )


@scalar
def read(block, row, lane, transverse, axial):
    """Return five coordinates from consecutive rows; an absent pair is the constant 0."""
    first = row * STRIDE + lane
    transverse_p = 0.0
    transverse_g = 0.0
    axial_p = 0.0
    axial_g = 0.0
    if transverse is not None:
        transverse_p = block[first + STRIDE]
        transverse_g = block[first + 2 * STRIDE]
    if axial is not None:
        axial_p = block[first + 3 * STRIDE]
        axial_g = block[first + 4 * STRIDE]
    return Coordinates(block[first], transverse_p, transverse_g, axial_p, axial_g)


@scalar
def write(block, row, lane, values, transverse, axial):
    """Store the coordinates that the scene has into consecutive rows."""
    first = row * STRIDE + lane
    block[first] = values.torsion
    if transverse is not None:
        block[first + STRIDE] = values.transverse_p
        block[first + 2 * STRIDE] = values.transverse_g
    if axial is not None:
        block[first + 3 * STRIDE] = values.axial_p
        block[first + 4 * STRIDE] = values.axial_g


@scalar
def plus(a, b):
    """Return a + b, coordinate by coordinate."""
    return Coordinates(
        a.torsion + b.torsion,
        a.transverse_p + b.transverse_p,
        a.transverse_g + b.transverse_g,
        a.axial_p + b.axial_p,
        a.axial_g + b.axial_g,
    )


@scalar
def along(a, factor, b):
    """Return a + factor * b, coordinate by coordinate."""
    return Coordinates(
        a.torsion + factor * b.torsion,
        a.transverse_p + factor * b.transverse_p,
        a.transverse_g + factor * b.transverse_g,
        a.axial_p + factor * b.axial_p,
        a.axial_g + factor * b.axial_g,
    )
