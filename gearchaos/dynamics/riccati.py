"""The discrete Riccati equation of a periodic system, which gives its gains and its estimates."""

from functools import reduce
from typing import NamedTuple, Self

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.errors import ConfigurationError

MOST_DOUBLINGS = 50
"""Largest number of doublings for a Riccati equation; each squares what is left of the error."""


class _Steps(NamedTuple):
    """One step of the recursion, or several: X -> H + A' X (I + G X)^-1 A.

    ``transition`` A, ``reach`` G and ``cost`` H: shape (states, states); the last two are
    symmetric.
    """

    transition: Floats
    reach: Floats
    cost: Floats

    def then(self, later: Self) -> Self:
        """Return these steps of a system followed by later ones, as one (Chu, Fan and Lin 2005)."""
        identity, states = np.eye(len(self.cost)), len(self.cost)
        sides = np.hstack([self.transition, self.reach])
        both = np.linalg.solve(identity + self.reach @ later.cost, sides)
        moved, spread = both[:, :states], both[:, states:]
        return type(self)(
            later.transition @ moved,
            later.reach + later.transition @ spread @ later.transition.T,
            self.cost + moved.T @ later.cost @ self.transition,
        )

    def before(self, solution: Floats) -> Floats:
        """Return the solution at the beginning of the steps from that at their end."""
        moved = np.linalg.solve(np.eye(len(solution)) + self.reach @ solution, self.transition)
        return _symmetric(self.cost + moved.T @ solution @ self.transition)


def riccati(a: Floats, b: Floats, state: Floats, inputs: Floats) -> Floats:
    """Return the stabilising solution of a periodic discrete Riccati equation.

    X_k = A_k' X_k+1 A_k - A_k' X_k+1 B_k (R + B_k' X_k+1 B_k)^-1 B_k' X_k+1 A_k + Q, with X_p = X_0
    after p steps.

    Parameters
    ----------
    a, b : array, shape (steps, states, states) and (steps, states, inputs)
        The matrices of x_k+1 = A_k x_k + B_k u_k in each step of a period.
    state, inputs : array, shape (states, states) and (inputs, inputs)
        The symmetric weights Q and R.

    Returns
    -------
    array, shape (steps, states, states)
        X at the beginning of each step.

    Raises
    ------
    ConfigurationError
        If no gain stabilises the system.

    Notes
    -----
    All steps of a period are joined to one, and this one is doubled until X no longer changes
    (structure-preserving doubling, Chu, Fan and Lin 2005). It converges quadratically, also where
    multipliers are so small that the eigenvectors of the equation, from which
    `scipy.linalg.solve_discrete_are` builds X, cannot be ordered. The time is proportional to the
    number of steps.

    Examples
    --------
    >>> riccati(np.array([[[2.0]]]), np.eye(1)[np.newaxis], np.eye(1), np.eye(1)).round(6)
    array([[[4.236068]]])
    """
    reach = b @ np.linalg.solve(inputs, b.transpose(0, 2, 1))
    steps = [_Steps(*one, state) for one in zip(a, reach, strict=True)]
    found = [_of_period(steps)]
    for one in steps[:0:-1]:
        found.append(one.before(found[-1]))
    return np.array(found[:1] + found[:0:-1])


def _of_period(steps: list[_Steps]) -> Floats:
    """Return the solution (states, states) at the beginning of a period of steps."""
    with np.errstate(all="ignore"):
        whole = reduce(_Steps.then, steps)
        for _ in range(MOST_DOUBLINGS):
            before, whole = whole.cost, whole.then(whole)
            if not np.isfinite(whole.cost).all():
                break
            change = np.abs(whole.cost - before).max()
            if change <= np.finfo(float).eps * np.abs(whole.cost).max():
                return _symmetric(whole.cost)
    rule = "no gain stabilises the orbit or its estimate: the Riccati equation has no solution"
    raise ConfigurationError(f"{rule}; change another input, or measure other states")


def _symmetric(matrix: Floats) -> Floats:
    """Return the symmetric part of a matrix."""
    part: Floats = (matrix + matrix.T) / 2.0
    return part
