"""The fewest steps per mesh period with which the integration of a lane is stable.

On a contact branch with the stiffnesses of its elements held, the equations of motion are linear
with the eigenvalues of their Jacobian. None of them may lie outside the stable region of the
Runge-Kutta method of order 4, or the computed motion grows where the true one decays.

A step of length h multiplies the mode of an eigenvalue lambda by R(h lambda),
R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 (Hairer, Wanner 1996, sec. IV.2). The size of R need not
rise steadily along a ray from 0: on the negative real axis it first falls. But on every ray of the
left half plane it passes 1 only once. All steps shorter than the longest stable one are stable.
"""

import numpy as np
from gearchaos_kernels import LaneSystem, jacobian

from gearchaos.arrays import Complex, Floats, Integers

MOST_STEPS = 2**53  # Stands for every number of steps beyond it.

ROUNDING = 1e-9
"""Relative error granted to eigenvalues: an undamped mode lies on the imaginary axis up to that."""

_RAYS = 2**14


def fewest_stable_steps(system: LaneSystem) -> Integers:
    """Return the fewest steps per period with which every lane is stable on every branch.

    The branches are those with and without contact, with the stiffness held at its smallest and at
    its largest value, see `LaneSystem.branch_stiffnesses`. A motion that stays on one branch for
    some of the time only may survive with fewer steps. Eigenvalues whose real part is positive grow
    by themselves and set no limit. Every larger number of steps, shape (lanes,), is stable too.
    """
    system = system.measurable()
    held = (jacobian(system, stiffnesses) for stiffnesses in system.branch_stiffnesses())
    demand = np.max([_demand(matrix) for matrix in held], axis=0)
    with np.errstate(over="ignore"):
        steps: Floats = np.ceil(demand * (1.0 - ROUNDING) * system.mesh_period)
    return np.clip(steps, 1.0, MOST_STEPS).astype(np.intp)


def in_contact(system: LaneSystem) -> Floats:
    """Return the relative stiffnesses of all elements in contact, at their mean: ones."""
    return np.ones((system.lanes, system.elements))


def exponent_bias(system: LaneSystem, steps: int) -> tuple[Floats, Floats]:
    """Return by how much a step alone shifts the largest exponent of the system in contact.

    With stiffnesses held at their mean, the equations are linear: the method multiplies the mode of
    an eigenvalue by R(h lambda) in each step, where the true factor is exp(h lambda).

    Returns the difference of the largest rate of growth from the true one, and the true one, both
    per unit of tau, shape (lanes,).
    """
    step, contact = system.mesh_period[:, np.newaxis] / steps, in_contact(system)
    eigenvalues = np.linalg.eigvals(jacobian(system, contact)).astype(np.complex128)
    true = np.max(eigenvalues.real, axis=1)
    computed = np.max(np.log(amplification(step * eigenvalues)) / step, axis=1)
    return computed - true, true


def amplification(z: Complex) -> Floats:
    """Return abs(R(z)), by which one step multiplies a mode, for z = h lambda."""
    return np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))))


def _reach(angles: Floats) -> Floats:
    """Return where rays at these angles leave the stable region; all of them between 2.5 and 3."""
    inside, outside = np.full_like(angles, 2.5), np.full_like(angles, 3.0)
    for _ in range(52):
        middle = 0.5 * (inside + outside)
        stable = amplification(middle * np.exp(1j * angles)) <= 1.0
        inside, outside = np.where(stable, middle, inside), np.where(stable, outside, middle)
    return inside


_ANGLES = np.linspace(0.5 * np.pi, np.pi, _RAYS)
_LENGTHS = _reach(_ANGLES)


def steps_per_time(eigenvalues: Complex) -> Floats:
    """Return the fewest stable steps per unit of time for every eigenvalue.

    It is abs(lambda) over the length of the ray through lambda, and 0 where the real part is
    positive: what grows by itself may grow in the steps.
    """
    size = np.abs(eigenvalues)
    ray = np.interp(np.abs(np.angle(eigenvalues)), _ANGLES, _LENGTHS)
    return np.where(eigenvalues.real <= ROUNDING * size, size / ray, 0.0)


def _demand(matrix: Floats) -> Floats:
    """Return the fewest stable steps per unit of tau of every matrix."""
    # As bytes, which are sorted much faster than rows of numbers.
    rows = np.ascontiguousarray(matrix).reshape(matrix.shape[0], -1)
    every = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1])))[:, 0]
    _, distinct, kind = np.unique(every, return_index=True, return_inverse=True)
    # Where groups are so large that their products overflow, no number of steps is enough.
    demand = np.full(distinct.size, np.inf)
    computable = np.isfinite(matrix[distinct]).all(axis=(1, 2))
    eigenvalues = np.linalg.eigvals(matrix[distinct][computable]).astype(np.complex128)
    with np.errstate(invalid="ignore", over="ignore"):
        found = np.max(steps_per_time(eigenvalues), axis=1, initial=0.0)
    demand[computable] = np.where(np.isfinite(found), found, np.inf)
    return demand[kind]
