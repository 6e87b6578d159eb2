"""Eigenfrequencies of a system with all its elements in contact, or with none."""

import numpy as np
from gearchaos_kernels import LaneSystem, jacobian

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.stability import contact_jacobian


# Parameters so large that the matrix overflows have no eigenvalues.
@np.errstate(all="ignore")
def eigenfrequencies(system: LaneSystem, *, free: bool = False) -> Floats:
    """Return the eigenfrequencies at the mean stiffness with all elements in contact.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    free : bool
        Whether no element is in contact instead.

    Returns
    -------
    array, shape (lanes, coordinates)
        Angular frequencies of the damped system per unit of tau, ascending: the imaginary parts of
        the eigenvalues of its Jacobian. Modes that do not oscillate are NaN and come last.
    """
    apart = np.zeros((system.lanes, system.elements))
    matrices = jacobian(system, apart) if free else contact_jacobian(system)
    frequencies = np.stack([_eigenvalues(matrix).imag for matrix in matrices])
    # One of each conjugate pair: the lower half of the sorted values are the others, or zeros.
    upper = np.sort(frequencies, axis=1)[:, frequencies.shape[1] // 2 :]
    # A motion without restoring force has eigenvalues of zero, up to rounding.
    rounding = 1e-7 * np.max(upper, axis=1, keepdims=True)
    return np.sort(np.where(upper > rounding, upper, np.nan), axis=1)


def _eigenvalues(matrix: Floats) -> Complex:
    """Return the eigenvalues (states,) of a matrix, NaN where they cannot be computed."""
    try:
        return np.linalg.eigvals(matrix).astype(np.complex128)
    except np.linalg.LinAlgError:
        return np.full(len(matrix), np.nan + 1j * np.nan)
