"""Eigenfrequencies of a system with all its elements in contact."""

import numpy as np
from gearchaos_kernels import LaneSystem, jacobian

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.stability import in_contact


# Parameters that no computation could hold have no eigenvalues.
@np.errstate(all="ignore")
def eigenfrequencies(system: LaneSystem) -> Floats:
    """Return the eigenfrequencies at the mean stiffness with all elements in contact.

    They are angular, per unit of tau, and those of the damped system: the imaginary parts of the
    eigenvalues of its Jacobian. Ascending, shape (lanes, coordinates); NaN, at the end,
    stands for what does not oscillate.
    """
    matrices = jacobian(system, in_contact(system))
    frequencies = np.stack([_eigenvalues(matrix).imag for matrix in matrices])
    # Of a conjugate pair one; the smallest half of the sorted values are the others, or zeros.
    upper = np.sort(frequencies, axis=1)[:, frequencies.shape[1] // 2 :]
    return np.sort(np.where(upper > 0.0, upper, np.nan), axis=1)


def _eigenvalues(matrix: Floats) -> Complex:
    try:
        return np.linalg.eigvals(matrix).astype(np.complex128)
    except np.linalg.LinAlgError:
        return np.full(len(matrix), np.nan + 1j * np.nan)
