"""The smallest number of steps per mesh period with which an integration is stable.

On a contact branch with constant stiffnesses, the equations of motion are linear. If an eigenvalue
of their Jacobian lies outside the stable region of the method, the computed motion grows where the
true motion decays, see `gearchaos_kernels.methods.protocol.Method.stable_reach`.
"""

from collections.abc import Iterator

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem, jacobian

from gearchaos.arrays import Complex, Floats, Integers
from gearchaos.configuration.methods import DEFAULT

STEPS_CEILING = 2**53
"""Largest number of steps that is returned; it also represents all larger numbers."""

ROUNDING = 1e-9
"""Relative error of eigenvalues: undamped modes lie on the imaginary axis up to this error."""


def fewest_stable_steps(system: LaneSystem, method: str = DEFAULT.name) -> Integers:
    """Return the smallest number of steps per period that is stable on every branch.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    method : str
        Method of integration.

    Returns
    -------
    array of int, shape (lanes,)
        Steps per mesh period; every larger number is stable, too.

    Notes
    -----
    The branches have all elements in contact, with the stiffness at its minimum or at its maximum,
    or none, see `LaneSystem.branch_stiffnesses`. A motion that visits a branch only for part of the
    time may need fewer steps. Eigenvalues with a positive real part grow by themselves and set no
    limit.
    """
    demand = np.max([_demand(matrix, method) for matrix in branch_jacobians(system)], axis=0)
    with np.errstate(over="ignore"):
        steps: Floats = np.ceil(demand * (1.0 - ROUNDING) * system.mesh_period)
    return np.clip(steps, 1.0, STEPS_CEILING).astype(np.intp)


def branch_jacobians(system: LaneSystem) -> Iterator[Floats]:
    """Yield the Jacobian of each contact branch, shape (lanes, states, states).

    The branches are those of `LaneSystem.branch_stiffnesses`, and parameters are `measurable`.
    """
    system = system.measurable()
    for stiffnesses in system.branch_stiffnesses():
        yield jacobian(system, stiffnesses)


def contact_jacobian(system: LaneSystem) -> Floats:
    """Return the Jacobian with all elements in contact at their mean stiffness.

    Shape (lanes, states, states), per unit of tau.
    """
    return jacobian(system, np.ones((system.lanes, system.elements)))


def exponent_bias(system: LaneSystem, steps: int, method: str) -> tuple[Floats, Floats]:
    """Return the shift of the largest exponent in contact by the step alone.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    steps : int
        Steps per mesh period.
    method : str
        Method of integration.

    Returns
    -------
    bias, true : array, shape (lanes,)
        Largest computed growth rate minus the true rate, and the true rate, per unit of tau.

    Notes
    -----
    With constant stiffnesses, the equations are linear. In each step the method multiplies the mode
    of an eigenvalue lambda by R(h lambda) instead of exp(h lambda).
    """
    step = system.mesh_period[:, np.newaxis] / steps
    eigenvalues = np.linalg.eigvals(contact_jacobian(system)).astype(np.complex128)
    true = np.max(eigenvalues.real, axis=1)
    computed = np.max(np.log(METHODS[method].amplification(step * eigenvalues)) / step, axis=1)
    return computed - true, true


def steps_per_time(eigenvalues: Complex, method: str = DEFAULT.name) -> Floats:
    """Return the smallest stable number of steps per unit of time for every eigenvalue.

    This is abs(lambda) divided by the length of the ray through lambda within the stable region. It
    is 0 where the real part is positive, because such a mode grows by itself.
    """
    reach = METHODS[method].stable_reach
    if reach is None:
        return np.zeros(eigenvalues.shape)
    size = np.abs(eigenvalues)
    ray = reach(np.abs(np.angle(eigenvalues)))
    return np.where(eigenvalues.real <= ROUNDING * size, size / ray, 0.0)


def distinct_matrices(matrix: Floats) -> tuple[Integers, Integers]:
    """Find the matrices that differ, because many lanes have the same one.

    Parameters
    ----------
    matrix : array, shape (lanes, rows, columns)
        One matrix per lane.

    Returns
    -------
    distinct : array of int, shape (kinds,)
        One lane of each kind.
    kind : array of int, shape (lanes,)
        The kind of every lane.
    """
    # Sorted as bytes: much faster than rows of numbers.
    rows = np.ascontiguousarray(matrix).reshape(matrix.shape[0], -1)
    every = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1])))[:, 0]
    _, distinct, kind = np.unique(every, return_index=True, return_inverse=True)
    return distinct, kind


def _demand(matrix: Floats, method: str) -> Floats:
    """Return the smallest stable number of steps per unit of tau of every matrix, (lanes,)."""
    distinct, kind = distinct_matrices(matrix)
    # Where parameters are so large that their products overflow, no number of steps is enough.
    demand = np.full(distinct.size, np.inf)
    computable = np.isfinite(matrix[distinct]).all(axis=(1, 2))
    eigenvalues = np.linalg.eigvals(matrix[distinct][computable]).astype(np.complex128)
    with np.errstate(invalid="ignore", over="ignore"):
        found = np.max(steps_per_time(eigenvalues, method), axis=1, initial=0.0)
    demand[computable] = np.where(np.isfinite(found), found, np.inf)
    return demand[kind]
