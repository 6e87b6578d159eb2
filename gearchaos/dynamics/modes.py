"""Modes of a system on its contact branches: how long they last, and which ones a step damps.

On a contact branch with the stiffnesses of its elements held, the equations are linear. Their
eigenvalues lambda are the modes: a disturbance decays as exp(Re lambda tau), and in computed steps
of length h as abs(R(h lambda)) a step, see `stability`. Where damping is constant and also acts
out of contact, the decay of a fast mode is nearly the same on all branches.
"""

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem, jacobian

from gearchaos.arrays import Complex, Floats, Mask
from gearchaos.dynamics.stability import ROUNDING, in_contact

MOST_SHIFT = 0.05
"""Largest change of a decay by half the step, relative to it, that a comparison bears."""


def memory(system: LaneSystem) -> Floats:
    """Return the mesh periods in which the slowest mode in contact falls by a factor e.

    Shape (lanes,); infinite without damping. Modes of independent states are left out: they act on
    no other one.
    """
    matrix = jacobian(system.measurable(), in_contact(system))
    independent = system.independent_states
    acting = [n for n, name in enumerate(system.states) if name not in independent]
    modes = np.linalg.eigvals(matrix[:, acting][:, :, acting])
    slowest = -np.max(modes.real, axis=1) * system.mesh_period
    with np.errstate(divide="ignore"):
        periods: Floats = np.where(slowest > 0.0, 1.0 / slowest, np.inf)
    return periods


def hidden_decay(system: LaneSystem, steps: int, method: str) -> Floats:
    """Return the slowest decay rate among the modes that neither a step nor half of it computes.

    Comparing two grids does not show what both damp away. A mode belongs to them if half the step
    still changes its rate of decay by more than `MOST_SHIFT` of it. Returned is the largest real
    part of their eigenvalues over all branches, per unit of tau, shape (lanes,), and minus infinity
    where half the step is right about every mode.
    """
    half = system.mesh_period[:, np.newaxis, np.newaxis] / (2 * steps)
    modes = _of_branches(system)
    with np.errstate(divide="ignore"):
        computed = np.log(METHODS[method].amplification(half * modes)) / half
    # The second term: an undamped mode is computed up to the rounding of its growth in a step.
    borne = MOST_SHIFT * np.abs(modes.real) + ROUNDING / half
    hidden: Mask = np.abs(computed - modes.real) > borne
    slowest: Floats = np.max(np.where(hidden, modes.real, -np.inf), axis=(1, 2))
    return slowest


def _of_branches(system: LaneSystem) -> Complex:
    """Return the eigenvalues on every branch, shape (lanes, branches, states)."""
    system = system.measurable()
    held = [jacobian(system, stiffnesses) for stiffnesses in system.branch_stiffnesses()]
    modes: Complex = np.linalg.eigvals(np.stack(held, axis=1)).astype(np.complex128)
    return modes
