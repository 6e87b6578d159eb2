"""Equations of motion of one lane (Pan 2021, eq. 13) and their linearisation, as plain formulas.

Everything is in the scaled coordinates of `rows`, displacements dimensionless and rates,
accelerations and forces per step and per step squared. There (with q = approach of the two gears)::

    gap_y = q - e,            y_1 = cos(beta_b) gap_y
    gap_z = p - gap_y - 2 e,  y_2 = sin(beta_b) gap_z,   p = mu_p axial_p + mu_g axial_g

for the published formulation; the physical one multiplies the first e by 1 - 1/cos(beta_b) and
leaves the second line as it is. The clearance of both directions is then the same half backlash.

Deviations of teeth in the physical formulation lie along the transverse line of action: both e
become e / cos(beta_b), and torsion is that of a state measured from rest, without -e (`from_rest`).
The error of a tooth is constant, so that the damper sees the rates of q and of p - q.
"""

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.rows import Coordinates, Directions, State


class Gap(NamedTuple):
    """A gap and its rate."""

    value: float
    rate: float


@scalar
def approach(values, lane, present):
    """Return delta_1 - delta_2 + delta_5 (eq. 6) over cos(beta_b), or its rate from rates."""
    if present.transverse is None:
        return values.torsion
    return (
        values.torsion
        + lane.mass_ratio_p * values.transverse_p
        + (lane.mass_ratio_g * values.transverse_g)
    )


@scalar
def axial_approach(values, lane):
    """Return delta_3 - delta_4 (eq. 7) over sin(beta_b), or its rate from rates."""
    return lane.mass_ratio_p * values.axial_p + lane.mass_ratio_g * values.axial_g


@scalar
def gaps_at(state, lane, forcing, present):
    """Return y_1 over cos(beta_b) and y_2 over sin(beta_b) (eqs 6, 7), 0 without axial pair."""
    gap = approach(state.position, lane, present) - forcing.error
    rate = approach(state.rate, lane, present) - forcing.error_rate
    axial_gap = 0.0
    axial_rate = 0.0
    if present.axial is not None:
        axial_gap = axial_approach(state.position, lane) - gap - forcing.axial_error
        axial_rate = axial_approach(state.rate, lane) - forcing.axial_error_rate - rate
    return Directions(Gap(gap, rate), Gap(axial_gap, axial_rate))


@scalar
def from_rest(state, forcing, present):
    """Return a state with a torsion that is measured from rest, where e is that of teeth.

    In this coordinate the error acts on the mesh springs alone. In that of eq. 13 e'' drives the
    pair as well, of which a step sees nothing where teeth take their load in less than a step.
    """
    if present.undamped is None:
        return state
    return State(
        _with_torsion(state.position, forcing.error), _with_torsion(state.rate, forcing.error_rate)
    )


@scalar
def from_error(state, forcing, present):
    """Return a state with a torsion that is measured from e again, as delta_5 is."""
    if present.undamped is None:
        return state
    return State(
        _with_torsion(state.position, -forcing.error),
        _with_torsion(state.rate, -forcing.error_rate),
    )


@scalar
def _with_torsion(values, more):
    """Return coordinates with more torsion."""
    return Coordinates(
        values.torsion + more,
        values.transverse_p,
        values.transverse_g,
        values.axial_p,
        values.axial_g,
    )


@scalar
def flank_rate(gap, forcing, present):
    """Return the rate at which flanks approach each other: that of the gap, or with teeth of q."""
    if present.undamped is None:
        return gap.rate
    # The same in both directions: e' and 2 e' of the axial gap less e' of the tangential one.
    return gap.rate + forcing.error_rate


@scalar
def mesh_force(gap, rate, stiffness, damping, half_backlash, branch, present):
    """Return a mesh force (eqs 2, 4) and its slope (eqs 22, 23), on a branch if one is given."""
    deflection, slope = gap.value, stiffness
    if branch is not None:
        deflection = branch.engaged * gap.value - branch.offset
        slope = stiffness * branch.engaged
    elif present.backlash is not None:
        deflection = gap.value - min(max(gap.value, -half_backlash), half_backlash)
        slope = stiffness if deflection != 0.0 else 0.0
    return stiffness * deflection + damping * rate, slope


@scalar
def mesh_forces(gaps, lane, forcing, branches, present):
    """Return N_y and N_z of eq. 13 and their slopes d(force)/d(gap), on branches or `ANYWHERE`."""
    stiffness, damping, b = forcing.stiffness, lane.mesh_damping, lane.half_backlash
    stiffness_z, damping_z = lane.axial_share * stiffness, lane.axial_share * damping
    on_y, on_z = branches
    rate = flank_rate(gaps.tangential, forcing, present)
    force_y, slope_y = mesh_force(gaps.tangential, rate, stiffness, damping, b, on_y, present)
    force_z = 0.0
    slope_z = 0.0
    if present.axial is not None:
        rate = flank_rate(gaps.axial, forcing, present)
        force_z, slope_z = mesh_force(gaps.axial, rate, stiffness_z, damping_z, b, on_z, present)
    return Directions(force_y, force_z), Directions(slope_y, slope_z)


@scalar
def tangent_forces(tangent, lane, slopes, present):
    """Return what a tangent vector adds to the mesh forces on branches of the given slopes.

    The field is continuous across a clearance boundary, so the variational equation needs no jump
    matrix there: its Jacobian is that of the active branch.
    """
    gap = approach(tangent.position, lane, present)
    rate = approach(tangent.rate, lane, present)
    force_z = 0.0
    if present.axial is not None:
        force_z = slopes.axial * (axial_approach(tangent.position, lane) - gap) + (
            lane.axial_share * lane.mesh_damping
        ) * (axial_approach(tangent.rate, lane) - rate)
    return Directions(slopes.tangential * gap + lane.mesh_damping * rate, force_z)


@scalar
def accelerations(state, forces, drive, lane, present):
    """Return the rows of eq. 13: what mesh forces, drive and bearings make of a state."""
    y, w = state
    transverse_p = 0.0
    transverse_g = 0.0
    axial_p = 0.0
    axial_g = 0.0
    # The mesh force comes last in each row: it is known last.
    if present.transverse is not None:
        transverse_p = (
            -lane.transverse_damping_p * w.transverse_p
            - lane.transverse_stiffness_p * y.transverse_p
        ) - forces.tangential
        transverse_g = (
            -lane.transverse_damping_g * w.transverse_g
            - lane.transverse_stiffness_g * y.transverse_g
        ) - forces.tangential
    if present.axial is not None:
        axial_p = (
            -lane.axial_damping_p * w.axial_p - lane.axial_stiffness_p * y.axial_p
        ) - forces.axial
        axial_g = (
            -lane.axial_damping_g * w.axial_g - lane.axial_stiffness_g * y.axial_g
        ) - forces.axial
    torsion = drive - forces.tangential
    return Coordinates(torsion, transverse_p, transverse_g, axial_p, axial_g)
