"""From the dimensionless groups of Pan 2021 to the coefficients that the inner loop reads.

Groups are in the notation of eqs 8-13; coefficients belong to the scaled coordinates of `equations`
and are per step. With a step of 1 they are per unit of tau. No other file knows both.
"""

from collections import namedtuple
from typing import TYPE_CHECKING

import numpy as np

from gearchaos_kernels.models.gear_pair.groups import Groups
from gearchaos_kernels.plan import Floats

if TYPE_CHECKING:
    from gearchaos_kernels.models.gear_pair.pairs import GearPairs

Lane = namedtuple(
    "Lane",
    "mass_ratio_p mass_ratio_g "
    "transverse_damping_p transverse_damping_g transverse_stiffness_p transverse_stiffness_g "
    "axial_damping_p axial_damping_g axial_stiffness_p axial_stiffness_g "
    "mean_stiffness stiffness_variation mesh_damping axial_share half_backlash load "
    "error_inertia error_mean error_amplitude error_rate "
    "axial_error_mean axial_error_amplitude axial_error_rate "
    "cos_phase sin_phase cosine tangential_speed axial_speed "
    "friction next_sliding later_sliding",
)
"""Coefficients of one lane (numbers) or of all lanes (arrays), per step; `lane_coefficients`
has their definitions."""

_ON_GRID = 1e-9
"""Steps by which rounding may move a moment at most."""

BEARING_DAMPING = [name for name in Groups._fields if "_damping_" in name]
BEARING_STIFFNESS = [name for name in Groups._fields if "_stiffness_" in name]


def state_scales(system: "GearPairs", step: Floats) -> Floats:
    """Return the factors from scaled states to those of eq. 13, shape (lanes, states).

    ``step``: length of a step in units of tau, shape (lanes,).
    """
    groups, effects = system.groups, system.effects
    cosine, sine = np.cos(groups.base_helix_angle), np.sin(groups.base_helix_angle)
    # A spur pair has no axial mesh force, so the scale of its axial bearings is arbitrary.
    sine = np.where(sine == 0.0, 1.0, sine)
    displacements = [cosine]
    for present, way in ((effects.transverse, cosine), (effects.axial, sine)):
        if present:
            displacements += [way * groups.mass_ratio_p, -way * groups.mass_ratio_g]
    scales = np.repeat(np.array(displacements), 2, axis=0)
    scales[1::2] /= step
    return scales.T.copy()


def lane_coefficients(system: "GearPairs", step: Floats) -> Floats:
    """Return the coefficients of every lane, shape (lanes, number of fields of `Lane`).

    ``step``: length of a step in units of tau, shape (lanes,).
    """
    groups = system.groups
    cosine, sine = np.cos(groups.base_helix_angle), np.sin(groups.base_helix_angle)
    # y_1 = q - e cos(beta_b) as printed in eq. 6, or q + e - e cos(beta_b) as eq. 1 gives.
    share = 1.0 - 1.0 / cosine if system.physical else np.ones_like(cosine)
    share_z = 2.0 * np.ones_like(cosine)
    if system.physical and system.teeth is not None:
        # Deviations of teeth are measured in the transverse plane: y_1 = q - e.
        share, share_z = 1.0 / cosine, 2.0 / cosine
    phase_step = groups.mesh_frequency * step
    friction, next_sliding, later_sliding = friction_coefficients(system, step)
    lane = Lane(
        mass_ratio_p=groups.mass_ratio_p,
        mass_ratio_g=groups.mass_ratio_g,
        **{name: 2.0 * getattr(groups, name) * step for name in BEARING_DAMPING},
        **{name: getattr(groups, name) * step**2 for name in BEARING_STIFFNESS},
        mean_stiffness=cosine * step**2,
        stiffness_variation=cosine * step**2 * groups.stiffness_variation_scale,
        mesh_damping=2.0 * groups.damping_ratio * cosine * step,
        axial_share=np.tan(groups.base_helix_angle),
        half_backlash=groups.half_backlash,
        load=groups.load / cosine * step**2,
        error_inertia=phase_step**2 * groups.error_amplitude / cosine,
        error_mean=share * groups.error_mean,
        error_amplitude=share * groups.error_amplitude,
        error_rate=share * groups.error_amplitude * phase_step,
        axial_error_mean=share_z * groups.error_mean,
        axial_error_amplitude=share_z * groups.error_amplitude,
        axial_error_rate=share_z * groups.error_amplitude * phase_step,
        cos_phase=np.cos(groups.error_phase),
        sin_phase=np.sin(groups.error_phase),
        cosine=cosine,
        tangential_speed=cosine / step,
        axial_speed=sine / step,
        friction=friction,
        next_sliding=next_sliding,
        later_sliding=later_sliding,
    )
    return np.array(lane, dtype=np.float64).T.copy()


def friction_coefficients(system: "GearPairs", step: Floats) -> tuple[Floats, Floats, Floats]:
    """Return friction at mesh phase 0, and the next two moments at which its sign changes.

    Friction: s mu lambda, with s = 1 before the pitch point and -1 behind it. The representative
    contact point passes the pitch point once per mesh period; half a period later that of the next
    tooth pair takes over, as far before the pitch point. Moments are in steps since the mesh period
    began, more than 0. Each has the shape (lanes,).
    """
    groups, nothing = system.groups, np.zeros(step.shape)
    if not system.effects.friction:
        return nothing, nothing, nothing
    steps = np.rint(system.mesh_period / step)
    turns = groups.pitch_point_phase / (2.0 * np.pi)
    passing = _moment(turns, steps)
    taking_over = _moment(turns + 0.5, steps)
    sign = np.where(passing < taking_over, 1.0, -1.0)
    return (
        sign * groups.friction_coefficient * groups.friction_lever,
        np.minimum(passing, taking_over),
        np.maximum(passing, taking_over),
    )


def _moment(turns: Floats, steps: Floats) -> Floats:
    """Return the moment of a mesh phase, in periods, in steps: more than 0, at most all steps."""
    moment = turns % 1.0 * steps
    # Rounding must not put a moment that lies on the grid of steps a little beside it.
    whole = np.rint(moment)
    moment = np.where(np.abs(moment - whole) < _ON_GRID, whole, moment)
    return np.where(moment > 0.0, moment, steps)


def growth_rates(system: "GearPairs") -> Floats:
    """Return a bound on how fast a tangent vector grows or decays, per unit of tau, shape (lanes,).

    The bound is the damping plus the square root of the largest mesh stiffness in one direction.
    Bearings need no term of their own: they only exchange and dissipate energy.
    """
    groups = system.groups
    bearings = np.maximum.reduce([getattr(groups, name) for name in BEARING_DAMPING])
    # Acceleration of the approach of the gears in one direction per unit of mesh force.
    mobility = 1.0 + groups.mass_ratio_p + groups.mass_ratio_g
    if system.effects.friction:
        mobility = mobility + groups.friction_coefficient * groups.friction_lever
    damping = 2.0 * groups.damping_ratio * mobility + 2.0 * bearings
    bound: Floats = damping + np.sqrt(mobility * (1.0 + np.abs(groups.stiffness_variation_scale)))
    return bound
