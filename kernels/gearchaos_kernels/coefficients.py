"""From the dimensionless groups to the numbers the inner loop reads.

This is the only place that knows both the notation of Pan 2021 and the scaled coordinates of
`rows`: the groups come in as they are printed in eqs 8-13, and leave as coefficients per
step. With a step of 1 they are those per unit of tau.
"""

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.rows import Lane
from gearchaos_kernels.system import Floats, Groups, System

BEARING_DAMPING = [name for name in Groups._fields if "_damping_" in name]
BEARING_STIFFNESS = [name for name in Groups._fields if "_stiffness_" in name]

LARGEST_GROWTH = 200.0
"""Natural logarithm of the growth or decay allowed between scalings; numbers end near 700."""


def state_scales(system: System, step: Floats) -> Floats:
    """Return what turns scaled states into those of eq. 13, shape (lanes, states).

    ``step``, shape (lanes,), is the length of a step in units of tau.
    """
    groups, effects = system.groups, system.effects
    cosine, sine = np.cos(groups.base_helix_angle), np.sin(groups.base_helix_angle)
    # A spur pair has no axial mesh force: any non-zero scale serves its axial bearings.
    sine = np.where(sine == 0.0, 1.0, sine)
    displacements = [cosine]
    for present, way in ((effects.transverse, cosine), (effects.axial, sine)):
        if present:
            displacements += [way * groups.mass_ratio_p, -way * groups.mass_ratio_g]
    scales = np.repeat(np.array(displacements), 2, axis=0)
    scales[1::2] /= step
    return scales.T.copy()


def lane_coefficients(system: System, step: Floats) -> Floats:
    """Return the coefficients of every lane, shape (lanes, number of fields of `Lane`)."""
    groups = system.groups
    cosine, sine = np.cos(groups.base_helix_angle), np.sin(groups.base_helix_angle)
    # y_1 = q - e cos(beta_b) as printed in eq. 6, or q + e - e cos(beta_b) as eq. 1 gives.
    share = 1.0 - 1.0 / cosine if system.physical else np.ones_like(cosine)
    share_z = 2.0 * np.ones_like(cosine)
    if system.physical and system.teeth is not None:
        # Deviations of teeth lie in the transverse plane: y_1 = q - e, with q itself.
        share, share_z = 1.0 / cosine, 2.0 / cosine
    phase_step = groups.mesh_frequency * step
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
    )
    return np.array(lane, dtype=np.float64).T.copy()


def steps_between_scalings(
    system: System, steps_per_period: int | NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return after how many steps each tangent vector is scaled back to length 1, shape (lanes,).

    Between two scalings it must neither overflow nor vanish. Its rate of growth or decay is bounded
    by the damping and by the square root of the largest stiffness of the mesh in one direction;
    bearings only exchange energy and dissipate it.
    """
    groups = system.groups
    bearings = np.maximum.reduce([getattr(groups, name) for name in BEARING_DAMPING])
    # How much a unit of mesh force accelerates the approach of the gears in one direction.
    mobility = 1.0 + groups.mass_ratio_p + groups.mass_ratio_g
    damping = 2.0 * groups.damping_ratio * mobility + 2.0 * bearings
    rate = damping + np.sqrt(mobility * (1.0 + np.abs(groups.stiffness_variation_scale)))
    scalings = rate * system.mesh_period / LARGEST_GROWTH
    # Powers of two, so that the shortest interval of a block divides all others.
    interval = np.exp2(np.floor(np.log2(np.maximum(1.0, steps_per_period / scalings))))
    return np.where(scalings > 1.0, interval, steps_per_period).astype(np.intp)
