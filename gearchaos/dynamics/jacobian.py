"""The Jacobian of eq. 13 of Pan 2021 on its contact branches, where the equations are linear."""

from __future__ import annotations

import numpy as np
from gearchaos_kernels import Model, Scene
from numpy.typing import NDArray

Floats = NDArray[np.float64]

COORDINATES = (
    "torsion",
    "transverse bearing of the driving gear",
    "transverse bearing of the driven gear",
    "axial bearing of the driving gear",
    "axial bearing of the driven gear",
)
"""What moves in delta_5, delta_1, ... delta_4."""


def coordinates(scene: Scene) -> NDArray[np.intp]:
    """Return the rows of `COORDINATES` that a scene has, two states each."""
    return np.flatnonzero(np.repeat([True, scene.transverse, scene.axial], [1, 2, 2]))


def jacobian(scene: Scene, model: Model, tangential: Floats, axial: Floats) -> Floats:
    """Return the Jacobian of eq. 13 on one contact branch of either direction.

    The axial displacements act on no other: their columns are zero in the other rows.

    Parameters
    ----------
    scene : Scene
    model : Model
        Dimensionless groups, arrays of shape (lanes,).
    tangential, axial : ndarray, shape (lanes,)
        kappa f' in N_y and in N_z: the relative mesh stiffness in contact, 0 without contact.

    Returns
    -------
    ndarray, shape (lanes, states, states)
        Per unit of tau, in the order of the scene's states: delta_5, its rate, delta_1, ...
    """
    kept = coordinates(scene)
    bearing_stiffness = _columns(
        0.0,
        model.transverse_stiffness_p,
        model.transverse_stiffness_g,
        model.axial_stiffness_p,
        model.axial_stiffness_g,
    )
    bearing_damping = 2.0 * _columns(
        0.0,
        model.transverse_damping_p,
        model.transverse_damping_g,
        model.axial_damping_p,
        model.axial_damping_g,
    )
    mesh_damping = 2.0 * model.damping_ratio
    result = np.zeros((model.load.size, 2 * kept.size, 2 * kept.size))
    result[:, 0::2, 1::2] = np.eye(kept.size)
    result[:, 1::2, 0::2] = -_coupling(model, bearing_stiffness, tangential, axial, kept)
    result[:, 1::2, 1::2] = -_coupling(model, bearing_damping, mesh_damping, mesh_damping, kept)
    return result


def _coupling(
    model: Model, bearings: Floats, tangential: Floats, axial: Floats, kept: NDArray[np.intp]
) -> Floats:
    """Stiffness or damping matrix, shape (lanes, coordinates, coordinates)."""
    cosine, sine = np.cos(model.base_helix_angle), np.sin(model.base_helix_angle)
    tangent, p, g = np.tan(model.base_helix_angle), model.mass_ratio_p, model.mass_ratio_g
    y_1 = _columns(1.0, 1.0, -np.ones_like(p), 0.0, 0.0)  # eq. 6
    y_2 = _columns(-tangent, -tangent, tangent, 1.0, -1.0)  # eq. 7
    by_n_y = _columns(cosine, cosine * p, -cosine * g, 0.0, 0.0)  # rows of eq. 13
    by_n_z = _columns(0.0, 0.0, 0.0, sine * p, -sine * g)
    outer = "l,lr,lc->lrc"
    matrix: Floats = np.einsum(outer, tangential, by_n_y[:, kept], y_1[:, kept])
    matrix += np.einsum(outer, axial, by_n_z[:, kept], y_2[:, kept])
    matrix += bearings[:, kept, np.newaxis] * np.eye(kept.size)
    return matrix


def _columns(*columns: float | Floats) -> Floats:
    return np.stack(np.broadcast_arrays(*columns), axis=1)
