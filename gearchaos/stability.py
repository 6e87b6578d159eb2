"""The fewest steps per mesh period with which the Runge-Kutta method of order 4 is stable.

On a contact branch eq. 13 is linear, and a step of length h multiplies the mode of the eigenvalue
lambda by R(h lambda), R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24. Along every ray from 0 into the left
half plane \\|R| leaves 1 exactly once, so that more steps than the fewest stable ones are stable too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from gearchaos_kernels import Model, Scene
from numpy.typing import NDArray

from gearchaos.configuration.messages import Fault

Floats = NDArray[np.float64]

MOST_STEPS = 2**53
"""Stands for any number of steps beyond it."""

_RAYS = 2**14
_ROUNDING = 1e-9
_CHUNK = 2**14
_POINTS_PER_WAVE = 64
_SHORTEST_AND_LONGEST_RAY = 2.6, 3.0

# Whatever else differs between lanes does not appear in the Jacobian.
_OUTSIDE_JACOBIAN = {"mesh_frequency", "load", "half_backlash"} | {
    "error_mean",
    "error_amplitude",
    "error_phase",
}
_OWNERS = (
    "torsional motion",
    "transverse bearing of the driving gear",
    "transverse bearing of the driven gear",
    "axial bearing of the driving gear",
    "axial bearing of the driven gear",
)


@dataclass(frozen=True, eq=False)
class StabilityLimit:
    """What keeps a number of steps per period from being stable.

    Attributes
    ----------
    lanes : ndarray, shape (unstable lanes,)
        Numbers of the lanes whose steps are too long.
    fewest : ndarray, shape (unstable lanes,)
        Fewest steps per period with which each of them is stable.
    eigenvalue : complex
        The one that asks for the most steps of all, per unit of tau.
    owner : str
        The part of the pair that moves most in its mode.
    """

    lanes: NDArray[np.intp]
    fewest: NDArray[np.int64]
    eigenvalue: complex
    owner: str

    def fault(self, steps: int, axis: str, values: Floats) -> Fault:
        """Word the limit for whoever chose so few steps.

        Parameters
        ----------
        steps : int
            Configured steps per period.
        axis : str
            Name of the swept parameter.
        values : ndarray, shape (lanes,)
            Its value in every lane of the sweep.
        """
        most, swept = int(np.max(self.fewest)), values[self.lanes]
        low, high = f"{np.min(swept):g}", f"{np.max(swept):g}"
        where = f"{axis} = {low}" if low == high else f"{axis} from {low} to {high}"
        real, imaginary = self.eigenvalue.real, abs(self.eigenvalue.imag)
        eigenvalue = f"{real:.3g} ± {imaginary:.3g}i" if imaginary else f"{real:.3g}"
        return Fault(
            "integration.steps_per_period",
            f"RK4 is unstable below {most} steps per period for {self.lanes.size} of {values.size} "
            f"lanes ({where}), because of the eigenvalue {eigenvalue} of the {self.owner}",
            f'raise it to {most} or more, or set integration.unstable = "raise"',
            steps,
        )


def jacobian(scene: Scene, model: Model, tangential: Floats, axial: Floats) -> Floats:
    """Return the Jacobian of eq. 13 on one contact branch of either direction.

    Parameters
    ----------
    scene : Scene
    model : Model
        Dimensionless groups, arrays of shape (lanes,).
    tangential, axial : ndarray, shape (lanes,)
        kappa f' of eqs 4 and 5: the mesh stiffness in contact, 0 without.

    Returns
    -------
    ndarray, shape (lanes, states, states)
        Per unit of tau, in the order of the scene's states: delta_5, its rate, delta_1, ...
    """
    cosine, sine, slope = (f(model.base_helix_angle) for f in (np.cos, np.sin, np.tan))
    one, none, p, g = np.ones_like(cosine), np.zeros_like(cosine), *_mass_ratios(model)
    # How the displacements enter y_1 and y_2 (eqs 6, 7), and N_y and N_z the accelerations.
    into_y = [one, one, -one, none, none]
    into_z = [-slope, -slope, slope, one, -one]
    from_y = [cosine, cosine * p, -cosine * g, none, none]
    from_z = [none, none, none, sine * p, -sine * g]
    bearing_stiffness = [none, *model[11:19:2]]
    bearing_damping = [none, *(2.0 * eta for eta in model[12:19:2])]
    present = np.repeat([True, scene.transverse, scene.axial], [1, 2, 2])

    def matrix(diagonal: list[Floats], y: Floats, z: Floats) -> Floats:
        d, a, b, c, e = (
            np.stack(rows, axis=1)[:, present]
            for rows in (diagonal, from_y, into_y, from_z, into_z)
        )
        by_mesh = (y[:, None] * a)[:, :, None] * b[:, None] + (z[:, None] * c)[:, :, None] * e[
            :, None
        ]
        mesh_and_bearings: Floats = by_mesh + d[:, :, None] * np.eye(d.shape[1])
        return mesh_and_bearings

    mesh_damping = 2.0 * model.damping_ratio
    coordinates = np.count_nonzero(present)
    result = np.zeros((cosine.size, 2 * coordinates, 2 * coordinates))
    result[:, 0::2, 1::2] = np.eye(coordinates)
    result[:, 1::2, 0::2] = -matrix(bearing_stiffness, tangential, axial)
    result[:, 1::2, 1::2] = -matrix(bearing_damping, mesh_damping, mesh_damping)
    return result
