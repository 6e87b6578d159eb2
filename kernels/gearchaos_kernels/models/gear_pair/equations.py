"""Equations of motion of one lane (Pan 2021, eq. 13) and their linearisation, as plain formulas.

Coordinates are scaled such that the mesh force enters every equation with coefficient -1 (beta_b:
base helix angle, mu: mass ratio)::

    torsion = delta_5 / cos(beta_b)
    transverse_p = delta_1 / (mu_p cos(beta_b))    transverse_g = -delta_2 / (mu_g cos(beta_b))
    axial_p = delta_3 / (mu_p sin(beta_b))         axial_g = -delta_4 / (mu_g sin(beta_b))

Displacements are dimensionless; rates are per step, accelerations and forces per step squared. With
q for the approach of the two gears, the gaps are::

    gap_y = q - e,            y_1 = cos(beta_b) gap_y
    gap_z = p - gap_y - 2 e,  y_2 = sin(beta_b) gap_z,   p = mu_p axial_p + mu_g axial_g

in the published formulation. The physical one multiplies the first e by 1 - 1/cos(beta_b) and
leaves the second line as it is. In these coordinates the clearance of both directions is the same
half backlash.

In the physical formulation, deviations of teeth act along the transverse line of action: both e
become e / cos(beta_b). The torsion is then measured from rest instead of from e (`from_kept`). The
error of a tooth is constant, so the damper acts on the rates of q and of p - q.
"""

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import store
from gearchaos_kernels.memory.rows import State, rows
from gearchaos_kernels.models.gear_pair.coefficients import Lane
from gearchaos_kernels.models.gear_pair.forcing import pitch_error_at
from gearchaos_kernels.models.protocol import Element, Gap

FRICTION = Lane._fields.index("friction")
"""Place of friction among the coefficients; the moments at which it changes follow."""


class Coordinates(NamedTuple):
    """One number for each of the five scaled coordinates; 0 for those that a scene leaves out."""

    torsion: float
    transverse_p: float
    transverse_g: float
    axial_p: float
    axial_g: float


@scalar
def approach(values, lane, scene):
    """Return (delta_1 - delta_2 + delta_5) / cos(beta_b) (eq. 6), or its rate from rates."""
    if scene.model.transverse is None:
        return values.torsion
    return (
        values.torsion
        + lane.mass_ratio_p * values.transverse_p
        + (lane.mass_ratio_g * values.transverse_g)
    )


@scalar
def axial_approach(values, lane, less):
    """Return (delta_3 - delta_4) / sin(beta_b) (eq. 7), or its rate from rates, less a number."""
    # The sum begins with the number: both products are then fused into it.
    return -less + lane.mass_ratio_p * values.axial_p + lane.mass_ratio_g * values.axial_g


@scalar
def gaps_at(state, lane, forcing, scene):
    """Return y_1 / cos(beta_b) and, with axial motion, y_2 / sin(beta_b) (eqs 6, 7)."""
    gap = approach(state.position, lane, scene) - forcing.error
    rate = approach(state.rate, lane, scene) - forcing.error_rate
    # Both gaps close faster by e': the axial one contains 2 e' - e'.
    moved = forcing.error_rate if scene.model.undamped is not None else 0.0
    if scene.model.axial is None:
        return (Gap(gap, rate, rate + moved),)
    axial_gap = axial_approach(state.position, lane, gap + forcing.axial_error)
    axial_rate = axial_approach(state.rate, lane, rate + forcing.axial_error_rate)
    return Gap(gap, rate, rate + moved), Gap(axial_gap, axial_rate, axial_rate + moved)


@scalar
def from_kept(state, forcing, scene):
    """Return a state whose torsion is measured from rest, if the errors are those of teeth.

    In this coordinate the error acts on the mesh springs only. With delta_5 of eq. 13, measured
    from e, e'' drives the pair as well; a step does not resolve e'' where a tooth takes up its load
    within less than a step.
    """
    if scene.model.undamped is None:
        return state
    return State(
        with_torsion(state.position, forcing.error), with_torsion(state.rate, forcing.error_rate)
    )


@scalar
def to_kept(state, forcing, scene):
    """Return a state whose torsion is measured from e again, as delta_5 of eq. 13 is."""
    if scene.model.undamped is None:
        return state
    return State(
        with_torsion(state.position, -forcing.error), with_torsion(state.rate, -forcing.error_rate)
    )


@scalar
def kept_accelerations(changes, lane, point, scene):
    """Return the accelerations of the coordinates of eq. 13: delta_5 is measured from e."""
    if scene.model.undamped is None:
        return changes
    return with_torsion(changes, -(lane.error_inertia * point.curvature))


@scalar
def with_torsion(values, more):
    """Return coordinates with a number added to the torsion."""
    return Coordinates(
        values.torsion + more,
        values.transverse_p,
        values.transverse_g,
        values.axial_p,
        values.axial_g,
    )


@scalar
def elements_at(lane, forcing, scene):
    """Return the elements of the mesh: tangential and, with axial motion, axial (eqs 2, 4)."""
    b = lane.half_backlash
    tangential = Element(forcing.stiffness, lane.mesh_damping, b)
    if scene.model.axial is None:
        return (tangential,)
    share = lane.axial_share
    return tangential, Element(share * forcing.stiffness, share * lane.mesh_damping, b)


@scalar
def gap_speeds(lane, scene):
    """Return the factors from gap rates per step to rates of y_1 and y_2 per unit of tau."""
    if scene.model.axial is None:
        return (lane.tangential_speed,)
    return lane.tangential_speed, lane.axial_speed


@scalar
def accelerations(state, pushes, forcing, lane, scene):
    """Return the accelerations of eq. 13, from mesh forces, drive, bearings and state."""
    y, w = state
    transverse_p = 0.0
    transverse_g = 0.0
    axial_p = 0.0
    axial_g = 0.0
    # The mesh force is subtracted last in each row, because it is computed last.
    force = pushes[0].force
    if scene.model.transverse is not None:
        transverse_p = (
            -lane.transverse_damping_p * w.transverse_p
            - lane.transverse_stiffness_p * y.transverse_p
        ) - force
        transverse_g = (
            -lane.transverse_damping_g * w.transverse_g
            - lane.transverse_stiffness_g * y.transverse_g
        ) - force
    if scene.model.axial is not None:
        # No other row waits for these two. They begin with the force, so that both products are
        # fused into the sum.
        axial_force = pushes[1].force
        axial_p = (
            -axial_force - lane.axial_damping_p * w.axial_p - lane.axial_stiffness_p * y.axial_p
        )
        axial_g = (
            -axial_force - lane.axial_damping_g * w.axial_g - lane.axial_stiffness_g * y.axial_g
        )
    torsion = forcing.drive - force
    if scene.model.friction is not None:
        torsion += lane.friction * force
    return Coordinates(torsion, transverse_p, transverse_g, axial_p, axial_g)


@scalar
def next_sliding(lane, scene):
    """Return when sliding, and with it friction, changes its sign next."""
    return lane.next_sliding


@scalar
def change_sliding(memory, slot, lane, scene):
    """Store friction of the other sign, which changes again at the other moment."""
    changed = -lane.friction, lane.later_sliding, lane.next_sliding
    store(memory, rows(scene).coefficients + FRICTION, slot, changed)


@scalar
def observed_at(state, lane, point, scene):
    """Return the transmission error delta_5 + e; in eq. 13 delta_5 is measured from e."""
    error = lane.cosine * state.position.torsion
    if scene.model.pitch_error is not None and scene.model.undamped is None:
        error += pitch_error_at(lane, point, scene)
    return (error,)
