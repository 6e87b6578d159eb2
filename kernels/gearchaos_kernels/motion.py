"""Equations of motion of one lane (Pan 2021, eq. 13) and their linearisation, as plain formulas.

An effect that is off is passed as ``None``: Numba then removes its branch before compilation.
Everything is in the scaled coordinates of `lane`, in which (with q = approach of the two gears)::

    gap_y = q - e,            y_1 = cos(beta_b) gap_y
    gap_z = p - gap_y - 2 e,  y_2 = sin(beta_b) gap_z,   p = mu_p axial_p + mu_g axial_g

for the published formulation; the rederived one multiplies the first e by 1 - 1/cos(beta_b) and
leaves the second line as it is. The clearance of both directions is then the same half backlash.
"""

from __future__ import annotations

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.lane import Coordinates


class Forcing(NamedTuple):
    """What acts on a lane at one instant; what a scene leaves out is the constant 0."""

    stiffness: float
    drive: float
    error: float
    error_rate: float
    axial_error: float
    axial_error_rate: float


class Slopes(NamedTuple):
    """Stiffness of the active contact branch in the two directions: d(mesh force)/d(gap)."""

    tangential: float
    axial: float


@scalar
def forcing_at(lane, variation, sine, cosine, pitch_error, phase, stiffness_variation, axial):
    """Return mesh stiffness (eq. 19), load and pitch error (eq. 14) at one tabulated instant."""
    stiffness = lane.mean_stiffness
    if stiffness_variation is not None:
        stiffness = lane.mean_stiffness + lane.stiffness_variation * variation
    drive = lane.load
    error = 0.0
    error_rate = 0.0
    axial_error = 0.0
    axial_error_rate = 0.0
    if pitch_error is not None:
        if phase is not None:
            shifted = lane.cos_phase * sine + lane.sin_phase * cosine
            cosine = lane.cos_phase * cosine - lane.sin_phase * sine
            sine = shifted
        # -e'' = Omega^2 e of the sine drives delta_5, which is measured from e (eq. 13).
        drive = lane.load + lane.error_inertia * sine
        error = lane.error_mean + lane.error_amplitude * sine
        error_rate = lane.error_rate * cosine
        if axial is not None:
            axial_error = lane.axial_error_mean + lane.axial_error_amplitude * sine
            axial_error_rate = lane.axial_error_rate * cosine
    return Forcing(stiffness, drive, error, error_rate, axial_error, axial_error_rate)


@scalar
def mesh_force(gap, gap_rate, stiffness, damping, half_backlash, backlash):
    """Return the mesh force (eqs 2, 4) and the stiffness of its active branch (eqs 22, 23)."""
    if backlash is None:
        return stiffness * gap + damping * gap_rate, stiffness
    deflection = gap - min(max(gap, -half_backlash), half_backlash)
    slope = stiffness if deflection != 0.0 else 0.0
    return stiffness * deflection + damping * gap_rate, slope


@scalar
def approach(values, lane, transverse):
    """Return q = delta_1 - delta_2 + delta_5 (eq. 6) over cos(beta_b)."""
    if transverse is None:
        return values.torsion
    return (
        values.torsion
        + lane.mass_ratio_p * values.transverse_p
        + (lane.mass_ratio_g * values.transverse_g)
    )


@scalar
def axial_approach(values, lane):
    """Return delta_3 - delta_4 (eq. 7) over sin(beta_b)."""
    return lane.mass_ratio_p * values.axial_p + lane.mass_ratio_g * values.axial_g


@scalar
def respond(position, rate, force_y, force_z, drive, lane, transverse, axial):
    """Return the accelerations that mesh forces, drive and bearings give (rows of eq. 13)."""
    transverse_p = 0.0
    transverse_g = 0.0
    axial_p = 0.0
    axial_g = 0.0
    # The mesh force comes last in each row: it is known last.
    if transverse is not None:
        transverse_p = (
            -lane.transverse_damping_p * rate.transverse_p
            - lane.transverse_stiffness_p * position.transverse_p
        ) - force_y
        transverse_g = (
            -lane.transverse_damping_g * rate.transverse_g
            - lane.transverse_stiffness_g * position.transverse_g
        ) - force_y
    if axial is not None:
        axial_p = (
            -lane.axial_damping_p * rate.axial_p - lane.axial_stiffness_p * position.axial_p
        ) - force_z
        axial_g = (
            -lane.axial_damping_g * rate.axial_g - lane.axial_stiffness_g * position.axial_g
        ) - force_z
    return Coordinates(drive - force_y, transverse_p, transverse_g, axial_p, axial_g)


@scalar
def accelerations(position, rate, lane, forcing, backlash, transverse, axial):
    """Return the accelerations of eq. 13 and the slopes of the active contact branches."""
    gap = approach(position, lane, transverse) - forcing.error
    gap_rate = approach(rate, lane, transverse) - forcing.error_rate
    force_y, slope_y = mesh_force(
        gap, gap_rate, forcing.stiffness, lane.mesh_damping, lane.half_backlash, backlash
    )
    force_z = 0.0
    slope_z = 0.0
    if axial is not None:
        force_z, slope_z = mesh_force(
            axial_approach(position, lane) - gap - forcing.axial_error,
            axial_approach(rate, lane) - gap_rate - forcing.axial_error_rate,
            lane.axial_share * forcing.stiffness,
            lane.axial_share * lane.mesh_damping,
            lane.half_backlash,
            backlash,
        )
    acceleration = respond(position, rate, force_y, force_z, forcing.drive, lane, transverse, axial)
    return acceleration, Slopes(slope_y, slope_z)


@scalar
def tangent_accelerations(position, rate, lane, slopes, transverse, axial):
    """Return the accelerations of a tangent vector along a motion with the given slopes.

    The field is continuous across a clearance boundary, so the variational equation needs no jump
    matrix there: its Jacobian is that of the active branch.
    """
    gap = approach(position, lane, transverse)
    gap_rate = approach(rate, lane, transverse)
    force_y = slopes.tangential * gap + lane.mesh_damping * gap_rate
    force_z = 0.0
    if axial is not None:
        force_z = slopes.axial * (axial_approach(position, lane) - gap) + (
            lane.axial_share * lane.mesh_damping
        ) * (axial_approach(rate, lane) - gap_rate)
    return respond(position, rate, force_y, force_z, 0.0, lane, transverse, axial)
