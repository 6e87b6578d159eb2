"""The fewest steps per mesh period with which the integration of a lane is stable.

On a contact branch with the stiffnesses of its elements held, the equations of motion are linear
with the eigenvalues of their Jacobian. None of them may lie outside the stable region of the
method, see `gearchaos_kernels.methods.rk4.stability`, or the computed motion grows where the true
one decays.
"""

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem, jacobian

from gearchaos.arrays import Complex, Floats, Integers

STEPS_CEILING = 2**53  # Stands for every number of steps beyond it.

ROUNDING = 1e-9
"""Relative error granted to eigenvalues: an undamped mode lies on the imaginary axis up to that."""


def fewest_stable_steps(system: LaneSystem, method: str = "rk4") -> Integers:
    """Return the fewest steps per period with which a method is stable on every branch.

    The branches are those with and without contact, with the stiffness held at its smallest and at
    its largest value, see `LaneSystem.branch_stiffnesses`. A motion that stays on one branch for
    some of the time only may survive with fewer steps. Eigenvalues whose real part is positive grow
    by themselves and set no limit. Every larger number of steps, shape (lanes,), is stable too.
    """
    system = system.measurable()
    held = (jacobian(system, stiffnesses) for stiffnesses in system.branch_stiffnesses())
    demand = np.max([_demand(matrix, method) for matrix in held], axis=0)
    with np.errstate(over="ignore"):
        steps: Floats = np.ceil(demand * (1.0 - ROUNDING) * system.mesh_period)
    return np.clip(steps, 1.0, STEPS_CEILING).astype(np.intp)


def in_contact(system: LaneSystem) -> Floats:
    """Return the relative stiffnesses of all elements in contact, at their mean: ones."""
    return np.ones((system.lanes, system.elements))


def exponent_bias(system: LaneSystem, steps: int, method: str) -> tuple[Floats, Floats]:
    """Return by how much a step alone shifts the largest exponent of the system in contact.

    With stiffnesses held at their mean, the equations are linear: the method multiplies the mode of
    an eigenvalue by R(h lambda) in each step, where the true factor is exp(h lambda).

    Returns the difference of the largest rate of growth from the true one, and the true one, both
    per unit of tau, shape (lanes,).
    """
    step, contact = system.mesh_period[:, np.newaxis] / steps, in_contact(system)
    eigenvalues = np.linalg.eigvals(jacobian(system, contact)).astype(np.complex128)
    true = np.max(eigenvalues.real, axis=1)
    computed = np.max(np.log(METHODS[method].amplification(step * eigenvalues)) / step, axis=1)
    return computed - true, true


def steps_per_time(eigenvalues: Complex, method: str = "rk4") -> Floats:
    """Return the fewest stable steps per unit of time for every eigenvalue.

    It is abs(lambda) over the length of the ray through lambda, and 0 where the real part is
    positive: what grows by itself may grow in the steps.
    """
    reach = METHODS[method].stable_reach
    if reach is None:
        return np.zeros(eigenvalues.shape)
    size = np.abs(eigenvalues)
    ray = reach(np.abs(np.angle(eigenvalues)))
    return np.where(eigenvalues.real <= ROUNDING * size, size / ray, 0.0)


def _demand(matrix: Floats, method: str) -> Floats:
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
        found = np.max(steps_per_time(eigenvalues, method), axis=1, initial=0.0)
    demand[computable] = np.where(np.isfinite(found), found, np.inf)
    return demand[kind]
