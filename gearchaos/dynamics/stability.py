"""The fewest steps per mesh period with which the integration of a lane is stable.

On a contact branch with its mesh stiffness held, eq. 13 is linear with the eigenvalues of its
Jacobian. None of them may lie outside the stable region of the Runge-Kutta method of order 4, or
the computed motion grows where the true one decays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from gearchaos_kernels import Model, Scene
from numpy.typing import NDArray

from gearchaos.configuration.messages import Fault
from gearchaos.dynamics.jacobian import COORDINATES, coordinates, jacobian
from gearchaos.dynamics.stable_region import ROUNDING, SHORTEST_RAY, steps_per_time

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_STEPS = 2**53
"""Stands for every number of steps beyond it."""

_BEYOND_MEASURE = 1e150
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
        """Word the limit, given the configured steps and the swept parameter of every lane."""
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


def joined_limit(limits: Sequence[StabilityLimit]) -> StabilityLimit:
    """Join the limits of parts of a sweep, whose lanes are numbered as in the whole."""
    strictest = max(limits, key=lambda limit: limit.steps)
    return replace(
        strictest,
        lanes=np.concatenate([limit.lanes for limit in limits]),
        fewest=np.concatenate([limit.fewest for limit in limits]),
    )


def stability_limit(
    scene: Scene, model: Model, stiffness_cosine: Floats, stiffness_sine: Floats, steps: int
) -> StabilityLimit | None:
    """Find the lanes in which so many steps per period are unstable; None if there are none.

    Eigenvalues are computed only where `sufficient_steps` leaves a doubt. The other parameters are
    those of `fewest_stable_steps`.
    """
    sufficient = sufficient_steps(scene, model, stiffness_cosine, stiffness_sine)
    doubtful = np.flatnonzero(sufficient > steps)
    part = _lanes(model, doubtful)
    fewest = fewest_stable_steps(scene, part, stiffness_cosine, stiffness_sine)
    unstable = np.flatnonzero(fewest > steps)
    if unstable.size == 0:
        return None
    worst = _lanes(part, unstable[[np.argmax(fewest[unstable])]])
    stiffnesses = _stiffnesses(scene, worst, stiffness_cosine, stiffness_sine)
    eigenvalue, owner = _strictest_mode(scene, worst, stiffnesses)
    return StabilityLimit(doubtful[unstable], fewest[unstable], eigenvalue, owner)


def fewest_stable_steps(
    scene: Scene, model: Model, stiffness_cosine: Floats, stiffness_sine: Floats
) -> Integers:
    """Return the fewest steps per period with which every lane is stable on every branch.

    The branches are those with and without contact in either direction, with the mesh stiffness
    held at its smallest and at its largest value. A motion that stays on one branch for part of the
    time only may survive with fewer steps. Eigenvalues whose real part is positive grow by
    themselves and set no limit.

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
    demand = np.zeros(model.load.size)
    for begin in range(0, demand.size, _LANES_AT_ONCE):
        chosen = slice(begin, begin + _LANES_AT_ONCE)
        part = _lanes(model, chosen)
        for stiffness in stiffnesses[:, chosen]:
            for block in _diagonal_blocks(scene, part, stiffness):
                demand[chosen] = np.maximum(demand[chosen], _demand(block))
    return _per_period(demand, model)


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
    model = _lanes(model, slice(None))
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
    largest = half + np.hypot(half, np.sqrt(k))
    return _per_period(largest / SHORTEST_RAY, model)


def _lanes(model: Model, chosen: slice | NDArray[np.intp]) -> Model:
    """Return some lanes, with groups that no computation could hold cut short of overflow."""
    return Model(*(np.clip(group[chosen], -_BEYOND_MEASURE, _BEYOND_MEASURE) for group in model))


def _stiffnesses(
    scene: Scene, model: Model, stiffness_cosine: Floats, stiffness_sine: Floats
) -> Floats:
    """kappa f' on the branches, shape (stiffnesses, lanes): no contact and the extremes of it."""
    values = [np.ones_like(model.load)]
    if scene.stiffness_variation:
        harmonics = np.concatenate([[0.0], stiffness_cosine + 1j * stiffness_sine])
        variation = np.fft.fft(harmonics, _POINTS_PER_WAVE * harmonics.size).real
        extremes = np.min(variation), np.max(variation)
        values = [1.0 + model.stiffness_variation_scale * extreme for extreme in extremes]
    if scene.backlash:
        values.append(np.zeros_like(model.load))
    return np.stack(values)


def _diagonal_blocks(scene: Scene, model: Model, stiffness: Floats) -> list[Floats]:
    """Jacobians of the tangential and of the axial motion at one stiffness of the mesh.

    The axial motion acts on nothing else, so that the eigenvalues of any branch are those of its
    tangential block together with those of its axial one.
    """
    whole = jacobian(scene, model, stiffness, stiffness)
    first = 6 if scene.transverse else 2
    blocks = [whole[:, :first, :first], whole[:, first:, first:]]
    return blocks[: 1 + scene.axial]


def _demand(block: Floats) -> Floats:
    """Return the fewest stable steps per unit of tau of every matrix."""
    distinct, kind = _distinct(block.reshape(block.shape[0], -1))
    eigenvalues = np.linalg.eigvals(block[distinct]).astype(np.complex128)
    demand: Floats = np.max(steps_per_time(eigenvalues), axis=1)
    return demand[kind]


def _distinct(rows: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the numbers of rows that differ from each other, and which of them every row is."""
    varying = rows[:, np.any(rows != rows[:1], axis=0)]
    if varying.size == 0:
        same = np.zeros(rows.shape[0], dtype=np.intp)
        return same[:1], same
    order = np.lexsort(varying.T)
    begins = np.ones(order.size, dtype=bool)
    begins[1:] = np.any(varying[order[1:]] != varying[order[:-1]], axis=1)
    kind = np.empty_like(order)
    kind[order] = np.cumsum(begins) - 1
    return order[begins], kind


def _per_period(demand: Floats, model: Model) -> Integers:
    with np.errstate(over="ignore"):
        steps = np.ceil(demand * (1.0 - ROUNDING) * (2.0 * np.pi / model.mesh_frequency))
    return np.clip(steps, 1.0, MOST_STEPS).astype(np.int64)


def _strictest_mode(scene: Scene, model: Model, stiffnesses: Floats) -> tuple[complex, str]:
    """Return the eigenvalue of one lane that asks for the most steps, and what moves with it."""
    kept = coordinates(scene)
    most, strictest, owner = -1.0, 0j, ""
    for stiffness in stiffnesses:
        first = 0
        for block in _diagonal_blocks(scene, model, stiffness):
            values, vectors = np.linalg.eig(block[0].astype(np.complex128))
            demand = steps_per_time(values)
            mode = np.argmax(demand)
            if demand[mode] > most:
                most, strictest = demand[mode], complex(values[mode])
                owner = COORDINATES[kept[first + np.argmax(np.abs(vectors[1::2, mode]))]]
            first += values.size // 2
    return strictest, owner
