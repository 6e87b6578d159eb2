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


class Slopes(NamedTuple):
    """Stiffness of the active contact branch in the two directions: d(mesh force)/d(gap)."""

    tangential: float
    axial: float


@scalar
def mesh_force(gap, gap_rate, stiffness, damping, half_backlash, backlash):
    """Return the mesh force (eqs 2, 4) and the stiffness of its active branch (eqs 22, 23)."""
    if backlash is None:
        return stiffness * gap + damping * gap_rate, stiffness
    deflection = gap - min(max(gap, -half_backlash), half_backlash)
    slope = stiffness if deflection != 0.0 else 0.0
    return stiffness * deflection + damping * gap_rate, slope


@scalar
def branch_force(gap, gap_rate, stiffness, damping, branch):
    """Return the mesh force and its stiffness on one linear piece of the clearance function."""
    deflection = branch.engaged * gap - branch.offset
    return stiffness * deflection + damping * gap_rate, stiffness * branch.engaged


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
def tangential_gap(position, lane, forcing, transverse):
    """Return y_1 (eq. 6) over cos(beta_b)."""
    return approach(position, lane, transverse) - forcing.error


@scalar
def tangential_gap_rate(rate, lane, forcing, transverse):
    """Return the rate of y_1 over cos(beta_b), per step."""
    return approach(rate, lane, transverse) - forcing.error_rate


@scalar
def axial_gap(position, gap, lane, forcing):
    """Return y_2 (eq. 7) over sin(beta_b) from the tangential gap at the same instant."""
    return axial_approach(position, lane) - gap - forcing.axial_error


@scalar
def axial_gap_rate(rate, gap_rate, length, lane, forcing):
    """Return the rate of y_2 over sin(beta_b) from that of y_1, per so many steps."""
    return length * (axial_approach(rate, lane) - forcing.axial_error_rate) - gap_rate


@scalar
def accelerations(position, rate, lane, forcing, branches, backlash, transverse, axial):
    """Return the accelerations of eq. 13 and the slopes of the active contact branches.

    Without ``branches`` the clearance function itself is evaluated.
    """
    gap = tangential_gap(position, lane, forcing, transverse)
    gap_rate = tangential_gap_rate(rate, lane, forcing, transverse)
    if branches is None:
        force_y, slope_y = mesh_force(
            gap,
            gap_rate,
            forcing.stiffness,
            lane.mesh_damping,
            lane.half_backlash,
            backlash,
        )
    else:
        force_y, slope_y = branch_force(
            gap, gap_rate, forcing.stiffness, lane.mesh_damping, branches.tangential
        )
    force_z = 0.0
    slope_z = 0.0
    if axial is not None:
        gap_z = axial_gap(position, gap, lane, forcing)
        gap_rate_z = axial_gap_rate(rate, gap_rate, 1.0, lane, forcing)
        stiffness = lane.axial_share * forcing.stiffness
        damping = lane.axial_share * lane.mesh_damping
        if branches is None:
            force_z, slope_z = mesh_force(
                gap_z, gap_rate_z, stiffness, damping, lane.half_backlash, backlash
            )
        else:
            force_z, slope_z = branch_force(gap_z, gap_rate_z, stiffness, damping, branches.axial)
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
