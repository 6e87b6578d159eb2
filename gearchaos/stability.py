"""The fewest steps per mesh period with which the Runge-Kutta method of order 4 is stable.

On a contact branch with its mesh stiffness held, eq. 13 is linear, and a step of length h
multiplies the mode of an eigenvalue lambda by R(h lambda), R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24
(Hairer, Wanner 1996, sec. IV.2). A mode that does not grow by itself must not grow in the steps.

The size of R need not rise steadily along a ray from 0 into the left half plane: on the negative
real axis it first falls. But it leaves 1 only once, so that all step numbers from the fewest
stable one on are stable.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from gearchaos_kernels import Model, Scene
from numpy.typing import NDArray

from gearchaos.configuration.messages import Fault
from gearchaos.jacobian import COORDINATES, OUTSIDE, coordinates, jacobian

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_STEPS = 2**53
"""Stands for every number of steps beyond it."""

_RAYS = 2**14
_ROUNDING = 1e-9
_LANES_AT_ONCE = 2**14
_POINTS_PER_WAVE = 64


@dataclass(frozen=True, eq=False)
class StabilityLimit:
    """Why a number of steps per period is unstable.

    Attributes
    ----------
    lanes : ndarray, shape (unstable lanes,)
        Numbers of the lanes in which it is.
    fewest : ndarray, shape (unstable lanes,)
        Fewest stable steps per period of each.
    eigenvalue : complex
        The one that asks for the most steps, per unit of tau.
    owner : str
        What moves most in its mode.
    """

    lanes: NDArray[np.intp]
    fewest: Integers
    eigenvalue: complex
    owner: str

    @property
    def steps(self) -> int:
        """Fewest steps per period with which all lanes are stable."""
        return int(np.max(self.fewest))

    def fault(self, configured: int, axis: str, values: Floats) -> Fault:
        """Word the limit for whoever configured so few steps.

        Parameters
        ----------
        configured : int
            Steps per period.
        axis : str
            Name of the swept parameter.
        values : ndarray, shape (lanes,)
            Its value in every lane.
        """
        low, high = np.min(values[self.lanes]), np.max(values[self.lanes])
        where = f"= {low:.6g}" if low == high else f"from {low:.6g} to {high:.6g}"
        imaginary = abs(self.eigenvalue.imag)
        pair = f" ± {imaginary:.3g}i" if imaginary > 0.0 else ""
        return Fault(
            "integration.steps_per_period",
            f"RK4 is unstable below {self.steps} steps per period for {self.lanes.size} of "
            f"{values.size} lanes ({axis} {where}), because of the eigenvalue "
            f"{self.eigenvalue.real:.3g}{pair} of the {self.owner}",
            f'raise it to {self.steps} or more, or set integration.unstable = "raise"',
            configured,
        )


def stability_limit(
    scene: Scene, model: Model, stiffness_cosine: Floats, stiffness_sine: Floats, steps: int
) -> StabilityLimit | None:
    """Find the lanes in which a number of steps per period is unstable.

    Eigenvalues are computed only where `sufficient_steps` leaves a doubt.

    Parameters
    ----------
    scene, model, stiffness_cosine, stiffness_sine
        As for `fewest_stable_steps`.
    steps : int
        Steps per period.

    Returns
    -------
    StabilityLimit or None
        None if all lanes are stable.
    """
    doubtful = np.flatnonzero(
        sufficient_steps(scene, model, stiffness_cosine, stiffness_sine) > steps
    )
    part = Model(*(group[doubtful] for group in model))
    fewest = fewest_stable_steps(scene, part, stiffness_cosine, stiffness_sine)
    unstable = np.flatnonzero(fewest > steps)
    if unstable.size == 0:
        return None
    worst = unstable[[np.argmax(fewest[unstable])]]
    eigenvalue, owner = _strictest_mode(
        scene, Model(*(group[worst] for group in part)), stiffness_cosine, stiffness_sine
    )
    return StabilityLimit(doubtful[unstable], fewest[unstable], eigenvalue, owner)


def fewest_stable_steps(
    scene: Scene, model: Model, stiffness_cosine: Floats, stiffness_sine: Floats
) -> Integers:
    """Return the fewest steps per period with which every lane is stable on every branch.

    The branches are those with and without contact in either direction, with the mesh stiffness
    held at its smallest and at its largest value. Eigenvalues whose real part is positive grow
    by themselves and set no limit.

    Parameters
    ----------
    scene : Scene
    model : Model
        Dimensionless groups, arrays of shape (lanes,).
    stiffness_cosine, stiffness_sine : ndarray, shape (harmonics,)
        Mesh stiffness relative to its mean (eq. 19).

    Returns
    -------
    ndarray, shape (lanes,)
        Whole numbers of at least 1. Every larger number of steps is stable too.
    """
    stiffnesses = _stiffnesses(scene, model, stiffness_cosine, stiffness_sine)
    first, lane = _distinct(model, stiffnesses)
    demand = np.zeros(first.size)
    for begin in range(0, first.size, _LANES_AT_ONCE):
        chosen = first[begin : begin + _LANES_AT_ONCE]
        part = Model(*(group[chosen] for group in model))
        for stiffness in stiffnesses:
            for block in _diagonal_blocks(scene, part, stiffness[chosen]):
                eigenvalues = _where_finite(np.linalg.eigvals, block)
                most = np.max(steps_per_time(eigenvalues), axis=1)
                demand[begin : begin + _LANES_AT_ONCE] = np.maximum(
                    demand[begin : begin + _LANES_AT_ONCE], most
                )
    return _per_period(demand[lane], model)


def sufficient_steps(
    scene: Scene, model: Model, stiffness_cosine: Floats, stiffness_sine: Floats
) -> Integers:
    """Return a number of steps per period that is surely stable, without any eigenvalue.

    In coordinates weighted by the square roots of the masses, stiffness K and damping C of the
    tangential and of the axial motion are symmetric. A mode u of unit length then satisfies
    lambda^2 + lambda u*Cu + u*Ku = 0, hence abs(lambda) <= c/2 + sqrt(c^2/4 + k) with the norms c
    and k of C and K, themselves at most the largest bearing plus the mesh. The step reaches as
    far as the shortest of all rays. Parameters as for `fewest_stable_steps`.

    Returns
    -------
    ndarray, shape (lanes,)
    """
    mesh_stiffness = np.max(
        np.abs(_stiffnesses(scene, model, stiffness_cosine, stiffness_sine)), axis=0
    )
    masses = model.mass_ratio_p + model.mass_ratio_g
    directions = [(np.cos(model.base_helix_angle), 1.0 + scene.transverse * masses)]
    k = c = np.zeros_like(model.load)
    if scene.transverse:
        k = np.maximum(model.transverse_stiffness_p, model.transverse_stiffness_g)
        c = 2.0 * np.maximum(model.transverse_damping_p, model.transverse_damping_g)
    if scene.axial:
        directions.append((np.sin(model.base_helix_angle), masses))
        k = np.maximum.reduce([k, model.axial_stiffness_p, model.axial_stiffness_g])
        c = np.maximum.reduce([c, 2.0 * model.axial_damping_p, 2.0 * model.axial_damping_g])
    feels = np.max([np.abs(projection) * moved for projection, moved in directions], axis=0)
    k = k + mesh_stiffness * feels
    half = 0.5 * c + model.damping_ratio * feels
    largest = half + np.sqrt(half**2 + k)
    return _per_period(largest / np.min(_rays()[1]), model)


def steps_per_time(eigenvalues: NDArray[np.complex128]) -> Floats:
    """Return the fewest stable steps per unit of tau for every eigenvalue; 0 if it grows."""
    angles, lengths = _rays()
    size = np.abs(eigenvalues)
    # An undamped mode lies on the imaginary axis up to rounding.
    decays = eigenvalues.real <= _ROUNDING * size
    angle = np.abs(np.angle(eigenvalues))
    return np.where(decays, size / np.interp(angle, angles, lengths), 0.0)


@cache
def _rays() -> tuple[Floats, Floats]:
    """Angles from pi/2 to pi, and how far the stability region reaches along them."""
    angles = np.linspace(0.5 * np.pi, np.pi, _RAYS)
    direction = np.exp(1j * angles)
    inside, outside = np.full(_RAYS, 2.0), np.full(_RAYS, 4.0)
    # |R|^2 - 1 on the imaginary axis is rounding near 0, so that the search begins further out.
    while np.max(outside - inside) > 1e-14:
        middle = 0.5 * (inside + outside)
        z = middle * direction
        stable = np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))) <= 1.0
        inside, outside = np.where(stable, middle, inside), np.where(stable, outside, middle)
        if np.all((inside == middle) | (outside == middle)) and np.all(
            np.nextafter(inside, outside) >= outside
        ):
            break
    return angles, inside
