"""Modes of a system on its contact branches: their decay, and which of them a step damps.

On a contact branch with constant stiffnesses, the equations are linear. The eigenvalues lambda of
their Jacobian are the modes. A disturbance decays as exp(Re lambda tau). In steps of length h it
changes by abs(R(h lambda)) per step, see `stability`. Where damping is constant and also acts out
of contact, the decay of a fast mode is nearly the same on all branches.
"""

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem

from gearchaos.arrays import Complex, Floats, Mask
from gearchaos.dynamics.stability import (
    ROUNDING,
    branch_jacobians,
    contact_jacobian,
    distinct_matrices,
)

MOST_SHIFT = 0.05
"""Largest relative change of a decay rate by half the step that counts as resolved."""


def memory(system: LaneSystem) -> Floats:
    """Return the mesh periods in which the slowest mode in contact decays by a factor e.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.

    Returns
    -------
    array, shape (lanes,)
        Mesh periods, infinite without damping. Modes of independent states are left out, because
        they do not act on other states.
    """
    matrix = contact_jacobian(system.measurable())
    independent = system.independent_states
    acting = [n for n, name in enumerate(system.states) if name not in independent]
    coupled = matrix[:, acting][:, :, acting]
    distinct, kind = distinct_matrices(coupled)
    modes = np.linalg.eigvals(coupled[distinct])
    slowest = -np.max(modes.real, axis=1)[kind] * system.mesh_period
    with np.errstate(divide="ignore"):
        periods: Floats = np.where(slowest > 0.0, 1.0 / slowest, np.inf)
    return periods


def hidden_decay(system: LaneSystem, steps: int, method: str) -> Floats:
    """Return the slowest decay rate among the modes that neither a step nor half of it resolves.

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
    array, shape (lanes,)
        Largest real part of the eigenvalues of these modes over all branches, per unit of tau;
        minus infinity where half the step resolves every mode.

    Notes
    -----
    A comparison of two grids does not show a mode that both damp. A mode is unresolved if its decay
    rate with half the step differs from the true rate by more than `MOST_SHIFT` of it.
    """
    half = system.mesh_period[:, np.newaxis, np.newaxis] / (2 * steps)
    modes = _of_branches(system)
    with np.errstate(divide="ignore"):
        computed = np.log(METHODS[method].amplification(half * modes)) / half
    # The second term: the growth of an undamped mode per step is known up to rounding.
    borne = MOST_SHIFT * np.abs(modes.real) + ROUNDING / half
    hidden: Mask = np.abs(computed - modes.real) > borne
    slowest: Floats = np.max(np.where(hidden, modes.real, -np.inf), axis=(1, 2))
    return slowest


def _of_branches(system: LaneSystem) -> Complex:
    """Return the eigenvalues on every branch, shape (lanes, branches, states)."""
    modes: Complex = np.linalg.eigvals(np.stack(list(branch_jacobians(system)), axis=1)).astype(
        np.complex128
    )
    return modes
