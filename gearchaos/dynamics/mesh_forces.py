"""Mesh forces, contact and accelerations of a computed motion: eq. 13 of Pan 2021 on its states.

All samples lie one step of the integration apart, the first one at mesh phase 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import STATE_ROWS, Model, Scene
from numpy.typing import NDArray

from gearchaos.gear import pitch_error
from gearchaos.gear.mesh_stiffness import FourierStiffness

Floats = NDArray[np.float64]
Integers = NDArray[np.uint8]

APART, DRIVING_FLANK, BACK_FLANK = 0, 1, 2
CONTACTS = ("apart", "driving_flank", "back_flank")
"""Meanings of the contact states 0, 1 and 2."""

_COORDINATES = len(STATE_ROWS) // 2


class Excitation(NamedTuple):
    """What the mesh imposes, each of shape (lanes, samples).

    ``stiffness`` is kappa (eq. 19); ``error``, ``error_rate`` and ``error_acceleration`` are e, e'
    and e'' (eq. 14).
    """

    stiffness: Floats
    error: Floats
    error_rate: Floats
    error_acceleration: Floats


class MeshForces(NamedTuple):
    """Forces in the mesh and where the teeth touch, each of shape (lanes, samples).

    ``tangential`` and ``axial`` are N_y and N_z (eq. 13), the contact states those of `CONTACTS`.
    Without clearance teeth never part, and the sign of the gap tells the flank.
    """

    tangential: Floats
    axial: Floats
    contact_tangential: Integers
    contact_axial: Integers


def excitation(
    scene: Scene,
    model: Model,
    stiffness_cosine: Floats,
    stiffness_sine: Floats,
    steps_per_period: int,
    samples: int,
) -> Excitation:
    """Return mesh stiffness and pitch error at every sample (Pan 2021, eqs 14 and 19).

    Parameters
    ----------
    scene : Scene
        Effects that exist.
    model : Model
        Dimensionless groups, arrays of shape (lanes,).
    stiffness_cosine, stiffness_sine : ndarray, shape (harmonics,)
        Mesh stiffness relative to its mean.
    steps_per_period : int
        Samples of one mesh period.
    samples : int
    """
    shape = (model.load.size, steps_per_period)
    kappa, error, rate, acceleration = np.ones(shape), *np.zeros((3, *shape))
    if scene.stiffness_variation:
        series = FourierStiffness(stiffness_cosine, stiffness_sine).table(steps_per_period)
        kappa += model.stiffness_variation_scale[:, np.newaxis] * (series - 1.0)
    if scene.pitch_error:
        frequency = model.mesh_frequency[:, np.newaxis]
        tau = 2.0 * np.pi / frequency * np.arange(steps_per_period) / steps_per_period
        sine = {
            "mesh_frequency": frequency,
            "amplitude": model.error_amplitude[:, np.newaxis],
            "phase": model.error_phase[:, np.newaxis],
        }
        error += pitch_error.error(tau, mean=model.error_mean[:, np.newaxis], **sine)
        rate += pitch_error.rate(tau, **sine)
        acceleration += pitch_error.acceleration(tau, **sine)
    phase = np.arange(samples) % steps_per_period
    return Excitation(*(one[:, phase] for one in (kappa, error, rate, acceleration)))


def mesh_forces(
    scene: Scene, model: Model, imposed: Excitation, states: Floats, *, rederived: bool = False
) -> MeshForces:
    """Return the forces in the mesh along a motion (Pan 2021, eqs 6, 7, 13, 22 and 23).

    Parameters
    ----------
    scene : Scene
        Effects that exist.
    model : Model
        Dimensionless groups, arrays of shape (lanes,).
    imposed : Excitation
    states : ndarray, shape (lanes, samples, 10)
        Dimensionless, columns as in `STATE_ROWS`.
    rederived : bool
        Whether delta_5 + e enters the gaps, instead of delta_5 as printed.
    """
    groups = _beside_samples(model)
    y_1, y_2 = _gaps(groups, states[..., :_COORDINATES], imposed.error, rederived)
    y_1_rate, y_2_rate = _gaps(groups, states[..., _COORDINATES:], imposed.error_rate, rederived)
    half_backlash = groups.half_backlash if scene.backlash else np.zeros_like(groups.load)
    damping = 2.0 * groups.damping_ratio
    b_1 = half_backlash * np.cos(groups.base_helix_angle)
    b_2 = half_backlash * np.sin(groups.base_helix_angle)
    return MeshForces(
        imposed.stiffness * _clearance(y_1, b_1) + damping * y_1_rate,
        imposed.stiffness * _clearance(y_2, b_2) + damping * y_2_rate,
        _contact(y_1, b_1),
        _contact(y_2, b_2),
    )


def accelerations(
    scene: Scene, model: Model, imposed: Excitation, states: Floats, forces: MeshForces
) -> dict[str, Floats]:
    """Return the second derivatives of the coordinates of a scene (Pan 2021, eq. 13).

    Returns
    -------
    dict of str to ndarray, shape (lanes, samples)
        By coordinate, ``"delta_5"`` and so on; that of delta_5, which is measured from the pitch
        error, is what the paper calls torsional acceleration.
    """
    groups = _beside_samples(model)
    force_y = np.cos(groups.base_helix_angle) * forces.tangential
    force_z = np.sin(groups.base_helix_angle) * forces.axial
    found = {"delta_5": groups.load - force_y - imposed.error_acceleration}
    rows = []
    if scene.transverse:
        stiffness = groups.transverse_stiffness_p, groups.transverse_stiffness_g
        damping = groups.transverse_damping_p, groups.transverse_damping_g
        rows += [
            ("delta_1", -groups.mass_ratio_p * force_y, stiffness[0], damping[0]),
            ("delta_2", groups.mass_ratio_g * force_y, stiffness[1], damping[1]),
        ]
    if scene.axial:
        stiffness = groups.axial_stiffness_p, groups.axial_stiffness_g
        damping = groups.axial_damping_p, groups.axial_damping_g
        rows += [
            ("delta_3", -groups.mass_ratio_p * force_z, stiffness[0], damping[0]),
            ("delta_4", groups.mass_ratio_g * force_z, stiffness[1], damping[1]),
        ]
    for name, force, k, eta in rows:
        displacement = states[..., STATE_ROWS[name]]
        rate = states[..., STATE_ROWS[f"{name}_rate"]]
        found[name] = force - 2.0 * eta * rate - k * displacement
    return found


def _beside_samples(model: Model) -> Model:
    return Model(*(group[:, np.newaxis] for group in model))


def _gaps(
    groups: Model, coordinates: Floats, error: Floats, rederived: bool
) -> tuple[Floats, Floats]:
    """y_1 and y_2 (eqs 6 and 7), or their rates from rates."""
    delta_5, delta_1, delta_2, delta_3, delta_4 = np.moveaxis(coordinates, -1, 0)
    along_mesh = delta_1 - delta_2 + delta_5 + (error if rederived else 0.0)
    angle = groups.base_helix_angle
    y_1 = along_mesh - error * np.cos(angle)
    y_2 = delta_3 - delta_4 - np.tan(angle) * along_mesh - error * np.sin(angle)
    return y_1, y_2


def _clearance(y: Floats, half_backlash: Floats) -> Floats:
    """f(y; b), eqs 22 and 23."""
    return y - np.clip(y, -half_backlash, half_backlash)


def _contact(y: Floats, half_backlash: Floats) -> Integers:
    flank = np.where(y > half_backlash, DRIVING_FLANK, APART)
    return np.where(y < -half_backlash, BACK_FLANK, flank).astype(np.uint8)
