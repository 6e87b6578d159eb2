"""The fewest steps per mesh period with which the integration of a lane is stable.

On a contact branch with its mesh stiffness held, eq. 13 is linear with the eigenvalues of its
Jacobian. None of them may lie outside the stable region of the Runge-Kutta method of order 4, or
the computed motion grows where the true one decays.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Groups, System, jacobian
from numpy.typing import NDArray

from gearchaos.dynamics.stable_region import ROUNDING, SHORTEST_RAY, amplification, steps_per_time

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_STEPS = 2**53
"""Stands for every number of steps beyond it."""

OWNERS = {
    "delta_5": "torsion",
    "delta_1": "transverse bearing of the driving gear",
    "delta_2": "transverse bearing of the driven gear",
    "delta_3": "axial bearing of the driving gear",
    "delta_4": "axial bearing of the driven gear",
}
"""What moves in each coordinate."""

_BEYOND_MEASURE = 1e150
_POINTS_PER_WAVE = 64


class StabilityLimit(NamedTuple):
    """Why a number of steps per period is unstable.

    ``lanes``, ``fewest`` (unstable lanes,): their numbers, and the fewest stable steps of each;
    ``eigenvalue``: the one that asks for the most steps, per unit of tau; ``owner``: what moves
    most in its mode.
    """

    lanes: NDArray[np.intp]
    fewest: Integers
    eigenvalue: complex
    owner: str

    @property
    def steps(self) -> int:
        """Fewest steps per period with which all lanes are stable."""
        return int(np.max(self.fewest))


def stability_limit(system: System, steps: int) -> StabilityLimit | None:
    """Find the lanes in which so many steps per period are unstable; None if there are none.

    Eigenvalues are computed only where `sufficient_steps` leaves a doubt.
    """
    doubtful = np.flatnonzero(sufficient_steps(system) > steps)
    if doubtful.size == 0:
        return None
    some = system.of(doubtful)
    fewest = fewest_stable_steps(some)
    unstable = np.flatnonzero(fewest > steps)
    if unstable.size == 0:
        return None
    eigenvalue, owner = _strictest_mode(some.of(unstable[[np.argmax(fewest[unstable])]]))
    return StabilityLimit(doubtful[unstable], fewest[unstable], eigenvalue, owner)


def fewest_stable_steps(system: System) -> Integers:
    """Return the fewest steps per period with which every lane is stable on every branch.

    The branches are those with and without contact in either direction, with the mesh stiffness
    held at its smallest and at its largest value. A motion that stays on one branch for some of the
    time only may survive with fewer steps. Eigenvalues whose real part is positive grow by
    themselves and set no limit. Every larger number of steps, shape (lanes,), is stable too.
    """
    system = _measurable(system)
    demands = [_demand(block) for _, block in _diagonal_blocks(system)]
    return _per_period(np.max(demands, axis=0), system)


def sufficient_steps(system: System) -> Integers:
    """Return a number of steps per period that is surely stable, without any eigenvalue.

    In coordinates weighted by the square roots of the masses, stiffness K and damping C of the
    tangential and of the axial motion are symmetric. A mode u of unit length then satisfies
    lambda^2 + lambda u*Cu + u*Ku = 0, hence abs(lambda) <= c/2 + sqrt(c^2/4 + k) with the norms c
    and k of C and K, themselves at most the largest bearing plus the mesh. The step reaches as
    far as the shortest of all rays. Shape (lanes,).
    """
    system = _measurable(system)
    effects, groups = system.effects, system.groups
    masses = groups.mass_ratio_p + groups.mass_ratio_g
    directions = [(np.cos(groups.base_helix_angle), 1.0 + effects.transverse * masses)]
    k = c = np.zeros(system.lanes)
    if effects.transverse:
        k = np.maximum(groups.transverse_stiffness_p, groups.transverse_stiffness_g)
        c = 2.0 * np.maximum(groups.transverse_damping_p, groups.transverse_damping_g)
    if effects.axial:
        directions.append((np.sin(groups.base_helix_angle), masses))
        k = np.maximum.reduce([k, groups.axial_stiffness_p, groups.axial_stiffness_g])
        c = np.maximum.reduce([c, 2.0 * groups.axial_damping_p, 2.0 * groups.axial_damping_g])
    # By so much the mesh accelerates the approach of the teeth, per unit of its force.
    share = np.max([np.abs(projection) * moved for projection, moved in directions], axis=0)
    k = k + np.max(np.abs(_stiffnesses(system)), axis=0) * share
    half = 0.5 * c + groups.damping_ratio * share
    largest = half + np.hypot(half, np.sqrt(k))
    return _per_period(largest / SHORTEST_RAY, system)


def exponent_bias(system: System, steps: int) -> tuple[Floats, Floats]:
    """Return by how much a step alone shifts the largest exponent of the pair in contact.

    With its stiffness held at the mean, eq. 13 is linear: the method multiplies the mode of an
    eigenvalue by R(h lambda) in each step, where the true factor is exp(h lambda). Returned are the
    difference of the largest rate of growth from the true one, and this one, both per unit of tau,
    shape (lanes,).
    """
    step, contact = system.mesh_period[:, np.newaxis] / steps, np.ones(system.lanes)
    eigenvalues = np.linalg.eigvals(jacobian(system, contact, contact)).astype(np.complex128)
    true = np.max(eigenvalues.real, axis=1)
    computed = np.max(np.log(amplification(step * eigenvalues)) / step, axis=1)
    return computed - true, true


def _measurable(system: System) -> System:
    """Return the system with groups that no computation could hold cut short of overflow."""
    clipped = (np.clip(group, -_BEYOND_MEASURE, _BEYOND_MEASURE) for group in system.groups)
    return system._replace(groups=Groups(*clipped))


def _stiffnesses(system: System) -> Floats:
    """kappa f' on the branches, shape (stiffnesses, lanes): no contact and the extremes of it."""
    values = [np.ones(system.lanes)]
    if system.effects.stiffness_variation:
        waves = system.stiffness_cosine + 1j * system.stiffness_sine
        harmonics = np.concatenate([[0.0], waves])
        variation = np.fft.fft(harmonics, _POINTS_PER_WAVE * harmonics.size).real
        scale = system.groups.stiffness_variation_scale
        values = [1.0 + scale * extreme for extreme in (np.min(variation), np.max(variation))]
    if system.effects.backlash:
        values.append(np.zeros(system.lanes))
    return np.stack(values)


def _diagonal_blocks(system: System) -> Iterator[tuple[int, Floats]]:
    """Jacobians of tangential and axial motion at every stiffness, each with its first state.

    The axial motion acts on nothing else, so that the eigenvalues of any branch are those of its
    tangential block together with those of its axial one.
    """
    axial = 6 if system.effects.transverse else 2
    for stiffness in _stiffnesses(system):
        whole = jacobian(system, stiffness, stiffness)
        yield 0, whole[:, :axial, :axial]
        if system.effects.axial:
            yield axial, whole[:, axial:, axial:]


def _demand(block: Floats) -> Floats:
    """Return the fewest stable steps per unit of tau of every matrix."""
    # As bytes, which are sorted much faster than rows of numbers.
    rows = np.ascontiguousarray(block).reshape(block.shape[0], -1)
    every = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1])))[:, 0]
    _, distinct, kind = np.unique(every, return_index=True, return_inverse=True)
    eigenvalues = np.linalg.eigvals(block[distinct]).astype(np.complex128)
    demand: Floats = np.max(steps_per_time(eigenvalues), axis=1)
    return demand[kind]


def _per_period(demand: Floats, system: System) -> Integers:
    with np.errstate(over="ignore"):
        steps = np.ceil(demand * (1.0 - ROUNDING) * system.mesh_period)
    return np.clip(steps, 1.0, MOST_STEPS).astype(np.int64)


def _strictest_mode(system: System) -> tuple[complex, str]:
    """Return the eigenvalue of one lane that asks for the most steps, and what moves with it."""
    system = _measurable(system)
    most, strictest, owner = -1.0, 0j, ""
    for first, block in _diagonal_blocks(system):
        values, vectors = np.linalg.eig(block[0].astype(np.complex128))
        demand = steps_per_time(values)
        mode = np.argmax(demand)
        if demand[mode] > most:
            most, strictest = demand[mode], complex(values[mode])
            moving = first + 2 * int(np.argmax(np.abs(vectors[1::2, mode])))
            owner = OWNERS[system.states[moving]]
    return strictest, owner
