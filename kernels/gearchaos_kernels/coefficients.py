"""From the dimensionless groups to the numbers the inner loop reads.

This is the only place that knows both the notation of Pan 2021 and the scaled coordinates of
`lane`: the groups come in as they are printed in eqs 8-13, and leave as per-step coefficients.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.lane import STATES, Lane

Floats = NDArray[np.float64]

LARGEST_EXPONENT = 200.0
"""Natural logarithm of the growth or decay allowed between scalings; numbers end near 700."""


class Model(NamedTuple):
    """Dimensionless groups of a batch, each an array of shape (lanes,).

    Angles are in radians. Groups of an effect that the scene leaves out are ignored; 1 is a safe
    filling for the mass ratios and 0 for everything else.
    """

    mesh_frequency: Floats
    load: Floats
    damping_ratio: Floats
    base_helix_angle: Floats
    half_backlash: Floats
    error_mean: Floats
    error_amplitude: Floats
    error_phase: Floats
    stiffness_variation_scale: Floats
    mass_ratio_p: Floats
    mass_ratio_g: Floats
    transverse_stiffness_p: Floats
    transverse_damping_p: Floats
    transverse_stiffness_g: Floats
    transverse_damping_g: Floats
    axial_stiffness_p: Floats
    axial_damping_p: Floats
    axial_stiffness_g: Floats
    axial_damping_g: Floats


def state_scales(model: Model, steps_per_period: int) -> Floats:
    """Return what turns scaled states into those of eq. 13, shape (lanes, 10).

    Columns follow `Coordinates`: five displacements, then five rates.
    """
    sine = np.sin(model.base_helix_angle)
    cosine = np.cos(model.base_helix_angle)
    # A spur pair has no axial motion: any non-zero scale serves the unused rows.
    sine = np.where(sine == 0.0, 1.0, sine)
    displacement = np.stack(
        [
            cosine,
            cosine * model.mass_ratio_p,
            -cosine * model.mass_ratio_g,
            sine * model.mass_ratio_p,
            -sine * model.mass_ratio_g,
        ],
        axis=1,
    )
    step = 2.0 * np.pi / (model.mesh_frequency * steps_per_period)
    scales = np.concatenate([displacement, displacement / step[:, np.newaxis]], axis=1)
    assert scales.shape[1] == STATES
    return scales


def lane_coefficients(model: Model, steps_per_period: int, rederived: bool) -> Floats:
    """Return the coefficients of every lane, shape (lanes, number of fields of `Lane`)."""
    step = 2.0 * np.pi / (model.mesh_frequency * steps_per_period)
    cosine = np.cos(model.base_helix_angle)
    # y_1 = q - e cos(beta_b) as printed in eq. 6, or q + e - e cos(beta_b) as eq. 1 gives.
    share = 1.0 - 1.0 / cosine if rederived else np.ones_like(cosine)
    phase_step = model.mesh_frequency * step
    lane = Lane(
        mass_ratio_p=model.mass_ratio_p,
        mass_ratio_g=model.mass_ratio_g,
        transverse_damping_p=2.0 * model.transverse_damping_p * step,
        transverse_damping_g=2.0 * model.transverse_damping_g * step,
        transverse_stiffness_p=model.transverse_stiffness_p * step**2,
        transverse_stiffness_g=model.transverse_stiffness_g * step**2,
        axial_damping_p=2.0 * model.axial_damping_p * step,
        axial_damping_g=2.0 * model.axial_damping_g * step,
        axial_stiffness_p=model.axial_stiffness_p * step**2,
        axial_stiffness_g=model.axial_stiffness_g * step**2,
        mean_stiffness=cosine * step**2,
        stiffness_variation=cosine * step**2 * model.stiffness_variation_scale,
        mesh_damping=2.0 * model.damping_ratio * cosine * step,
        axial_share=np.tan(model.base_helix_angle),
        half_backlash=model.half_backlash,
        load=model.load / cosine * step**2,
        error_inertia=phase_step**2 * model.error_amplitude / cosine,
        error_mean=share * model.error_mean,
        error_amplitude=share * model.error_amplitude,
        error_rate=share * model.error_amplitude * phase_step,
        axial_error_mean=2.0 * model.error_mean,
        axial_error_amplitude=2.0 * model.error_amplitude,
        axial_error_rate=2.0 * model.error_amplitude * phase_step,
        cos_phase=np.cos(model.error_phase),
        sin_phase=np.sin(model.error_phase),
    )
    return np.stack(np.broadcast_arrays(*lane), axis=1).astype(np.float64)


def steps_between_scalings(model: Model, steps_per_period: int) -> NDArray[np.intp]:
    """Return after how many steps each tangent vector is scaled back to length 1, shape (lanes,).

    Between two scalings it must neither overflow nor vanish. Its rate of growth or decay is bounded
    by the damping and by the square root of the largest stiffness of the mesh, as one direction
    feels it; bearings only exchange energy and dissipate it.
    """
    bearings = np.maximum.reduce(
        [
            model.transverse_damping_p,
            model.transverse_damping_g,
            model.axial_damping_p,
            model.axial_damping_g,
        ]
    )
    feels = 1.0 + model.mass_ratio_p + model.mass_ratio_g
    damping = 2.0 * model.damping_ratio * feels + 2.0 * bearings
    rate = damping + np.sqrt(feels * (1.0 + np.abs(model.stiffness_variation_scale)))
    scalings = rate * 2.0 * np.pi / model.mesh_frequency / LARGEST_EXPONENT
    # Powers of two, so that the shortest interval of a block divides all others.
    interval = np.exp2(np.floor(np.log2(np.maximum(1.0, steps_per_period / scalings))))
    return np.where(scalings > 1.0, interval, steps_per_period).astype(np.intp)
