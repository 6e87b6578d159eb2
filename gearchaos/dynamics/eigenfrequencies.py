"""Eigenfrequencies of a pair in contact, and the static deflection of its mesh."""

import numpy as np
from gearchaos_kernels import System, jacobian

from gearchaos.arrays import Complex, Floats


# Groups that no computation could hold have no eigenvalues.
@np.errstate(all="ignore")
def eigenfrequencies(system: System) -> Floats:
    """Return the eigenfrequencies at the mean mesh stiffness with all teeth in contact.

    They are angular, per unit of tau, and those of the damped pair: the imaginary parts of the
    eigenvalues of the Jacobian of eq. 13. Ascending, shape (lanes, coordinates); NaN, at the end,
    stands for what does not oscillate.
    """
    contact = np.ones(system.lanes)
    matrices = jacobian(system, contact, contact)
    frequencies = np.stack([_eigenvalues(matrix).imag for matrix in matrices])
    # Of a conjugate pair one; the smallest half of the sorted values are the others, or zeros.
    upper = np.sort(frequencies, axis=1)[:, frequencies.shape[1] // 2 :]
    return np.sort(np.where(upper > 0.0, upper, np.nan), axis=1)


def static_deflection(system: System) -> Floats:
    """Return the deflection of the mesh at its mean stiffness under the load, shape (lanes,).

    In units of b', along the transverse line of action: the gap y_1 less its clearance. At rest,
    eq. 13 gives cos(beta_b) N_y = f_n, so that y_1 - b cos(beta_b) = f_n / cos(beta_b).
    """
    deflection: Floats = system.groups.load / np.cos(system.groups.base_helix_angle)
    return deflection


def _eigenvalues(matrix: Floats) -> Complex:
    try:
        return np.linalg.eigvals(matrix).astype(np.complex128)
    except np.linalg.LinAlgError:
        return np.full(len(matrix), np.nan + 1j * np.nan)
