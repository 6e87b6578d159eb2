"""Linear control of periodic orbits: linearised period maps, gains, and estimates of the state.

At the beginning of mesh period n a controller adds u to the steady input of the model, the load of
a gear pair. About a periodic orbit r of p mesh periods the section obeys::

    x_n+1 - r_j+1 = J_j (x_n - r_j) + b_j u_n,    j = n mod p

J_j is the Jacobian of the map over mesh period j, b_j its derivative by the input. Both are columns
of the tangent frame of the kernels.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from gearchaos_kernels import Control, LaneSystem, Plan, integrate
from numpy.typing import NDArray

from gearchaos.arrays import Complex, Floats
from gearchaos.errors import ConfigurationError

PROBE = 1e-3
"""Length of the tangent vector with which the input of the tangent frame is 1."""

MOST_DOUBLINGS = 50
"""Largest number of doublings for a Riccati equation; each squares what is left of the error."""

UNCONTROLLABLE = 1e-6
"""Largest share of the input in a mode that counts as none; see `controllability`."""


class PeriodMaps(NamedTuple):
    """The linearised map over each mesh period of a periodic orbit.

    Attributes
    ----------
    points : array, shape (mesh periods, states)
        The orbit at the beginning of its mesh periods.
    jacobians : array, shape (mesh periods, states, states)
        Derivatives of the map by the state.
    responses : array, shape (mesh periods, states)
        Derivatives of the map by the input.
    """

    points: Floats
    jacobians: Floats
    responses: Floats

    @property
    def monodromy(self) -> Floats:
        """The Jacobian of the map over the whole orbit, shape (states, states)."""
        return _product(self.jacobians)

    def transported(self) -> Floats:
        """Return the derivative of the state after the orbit by the input of each period.

        Shape (states, mesh periods).
        """
        after = [_product(self.jacobians[n + 1 :]) for n in range(len(self.points))]
        return np.column_stack([one @ b for one, b in zip(after, self.responses, strict=True)])

    def closed(self, gain: Floats) -> Floats:
        """Return the Jacobian over the whole orbit with gains, shape (mesh periods, states)."""
        return _product(self.jacobians - self.responses[:, :, np.newaxis] * gain[:, np.newaxis])

    def closed_with_delay(self, gain: Floats) -> Floats:
        """Return the Jacobian over the whole orbit with delayed feedback.

        Each gain (mesh periods, states) is multiplied with the difference from the state one orbit
        earlier. The states of the mesh periods of an orbit, and the one before, are the state of
        the loop: the shape is (n, n) with n = states * (mesh periods + 1).
        """
        periods, states = self.points.shape
        steps = np.zeros((periods, states * (periods + 1), states * (periods + 1)))
        forced = self.responses[:, :, np.newaxis] * gain[:, np.newaxis]
        steps[:, :states, :states] = self.jacobians - forced
        steps[:, :states, -states:] += forced
        steps[:, states:, :-states] = np.eye(states * periods)
        return _product(steps)


def _product(matrices: Floats) -> Floats:
    """Return the product of matrices (n, states, states), the first one applied first."""
    product = np.eye(matrices.shape[-1])
    for matrix in matrices:
        product = matrix @ product
    return product


def period_maps(system: LaneSystem, points: Floats, plan: Plan) -> PeriodMaps:
    """Linearise the map over each mesh period of an orbit.

    Parameters
    ----------
    system : LaneSystem
        The system of the only lane.
    points : array, shape (mesh periods, states)
        The orbit at the beginning of its mesh periods.
    plan : Plan
        Method and steps per period.

    Returns
    -------
    PeriodMaps
        The derivatives, from tangent vectors; no differences are taken.
    """
    periods, states = points.shape
    jacobians = np.empty((periods, states, states))
    responses = np.empty((periods, states))
    for first in range(system.repeats_after):
        chosen = np.arange(first, periods, system.repeats_after)
        ends = _tangent_ends(system, points[chosen], plan, first)
        jacobians[chosen] = ends[:, :states].transpose(0, 2, 1)
        responses[chosen] = ends[:, states] - PROBE * ends[:, 0]
    return PeriodMaps(points, jacobians, responses)


def _tangent_ends(system: LaneSystem, points: Floats, plan: Plan, first: int) -> Floats:
    """Return tangent vectors after mesh period ``first``, shape (points, states + 1, states).

    They begin as unit vectors; the last one begins as a short vector along the first state, for
    which a controller demands an input of 1.
    """
    count, states = points.shape
    vectors = np.tile(np.vstack([np.eye(states), PROBE * np.eye(states)[:1]]), (count, 1))
    starts = np.repeat(points, states + 1, axis=0)
    gain = np.zeros((len(starts), 1, states))
    gain[states :: states + 1, 0, 0] = -1.0 / PROBE
    # The input itself stays 0: rounding of a state must not become an input.
    control = Control.of_states(starts[:, np.newaxis], gain, np.full(len(starts), 1e-9))
    outcome = integrate(
        system.of(np.zeros(len(starts), dtype=np.intp)).controlled(control),
        starts,
        plan.over(1)._replace(first_period=first),
        tangent_start=vectors,
    )
    ends = outcome.end_tangent * np.exp(outcome.growth)
    return ends.reshape(count, states + 1, states)


def sorted_multipliers(matrix: Floats) -> Complex:
    """Return the eigenvalues of a matrix, largest modulus first."""
    found = np.linalg.eigvals(matrix).astype(np.complex128)
    return found[np.argsort(-np.abs(found), kind="stable")]


def controllability(maps: PeriodMaps) -> tuple[Complex, Floats]:
    """Return the multipliers of an orbit, and how strongly the input acts on the mode of each.

    The share of the input in a mode is |w b| / (|w| |b|) for its left eigenvector w and all inputs
    b transported over the orbit, 1 at most. Modes without input cannot be controlled (Popov,
    Belevitch, Hautus).
    """
    inputs = maps.transported()
    multipliers, left = scipy.linalg.eig(maps.monodromy, left=True, right=False)
    size = np.linalg.norm(inputs)
    shares = np.linalg.norm(left.conj().T @ inputs, axis=1) / np.linalg.norm(left, axis=0)
    order = np.argsort(-np.abs(multipliers), kind="stable")
    return multipliers[order], (shares / size if size else shares)[order]


def require_controllable(maps: PeriodMaps, what: str) -> None:
    """Raise ConfigurationError if the input does not act on some unstable mode; ``what``: names."""
    multipliers, shares = controllability(maps)
    lost = [
        f"{multiplier:.4g} (share {share:.1e})"
        for multiplier, share in zip(multipliers, shares, strict=True)
        if abs(multiplier) >= 1.0 and share < UNCONTROLLABLE
    ]
    if lost:
        raise ConfigurationError(
            f"{what}: the actuator does not act on the unstable modes with the multipliers "
            f"{', '.join(lost)}; control needs another actuator or orbit"
        )


def lqr_gain(maps: PeriodMaps, state_weight: float, input_weight: float) -> Floats:
    """Return the gains that minimise a quadratic cost, shape (mesh periods, states).

    The cost is the sum of q |x - r|^2 + r u^2 over all mesh periods; the discrete Riccati equation
    of all periods together has a solution for each of them (cyclic form of Bittanti and
    Colaneri 2009).
    """
    a, b = _cyclic(maps.jacobians), _cyclic(maps.responses[:, :, np.newaxis])
    periods, states = maps.points.shape
    weights = input_weight * np.eye(periods)
    cost = riccati(a, b, state_weight * np.eye(periods * states), weights)
    gain = np.linalg.solve(weights + b.T @ cost @ b, b.T @ cost @ a)
    return np.array([gain[n, n * states : (n + 1) * states] for n in range(periods)])


def placed_gain(maps: PeriodMaps) -> Floats:
    """Return gains that move all unstable multipliers to 0, shape (mesh periods, states).

    The input acts in the first mesh period of the orbit only. It depends on the unstable modes
    alone, whose multipliers Ackermann's formula places (Ott, Grebogi, Yorke 1990).
    """
    triangle, basis, count = scipy.linalg.schur(maps.monodromy.T, sort="ouc")
    gain = np.zeros_like(maps.points)
    if count:
        left = basis[:, :count].T
        a, b = triangle[:count, :count].T, left @ maps.transported()[:, 0]
        reached = np.column_stack([np.linalg.matrix_power(a, n) @ b for n in range(count)])
        last = np.linalg.solve(reached.T, np.eye(count)[-1])
        gain[0] = last @ np.linalg.matrix_power(a, count) @ left
    return gain


def estimate_correction(
    maps: PeriodMaps, measured: list[int], noise: Floats, disturbance: Floats
) -> Floats:
    """Return the steady Kalman gains, shape (mesh periods, states, signals).

    Parameters
    ----------
    maps : PeriodMaps
        The linearised maps.
    measured : list of int
        Numbers of the measured states.
    noise : array, shape (signals,)
        Standard deviation of the noise of each signal.
    disturbance : array, shape (states,)
        Standard deviation of what disturbs each state in a mesh period.
    """
    periods, states = maps.points.shape
    a = _cyclic(maps.jacobians)
    c = np.kron(np.eye(periods), np.eye(states)[measured])
    spread = np.kron(np.eye(periods), np.diag(disturbance**2))
    variance = np.kron(np.eye(periods), np.diag(noise**2))
    predicted = riccati(a.T, c.T, spread, variance)
    gains = np.linalg.solve((c @ predicted @ c.T + variance).T, c @ predicted.T).T
    signals = len(measured)
    return np.array(
        [
            gains[n * states : (n + 1) * states, n * signals : (n + 1) * signals]
            for n in range(periods)
        ]
    )


def riccati(a: NDArray[Any], b: NDArray[Any], state: NDArray[Any], inputs: NDArray[Any]) -> Floats:
    """Return the stabilising solution X of a discrete Riccati equation, shape (states, states).

    X = A' X A - A' X B (R + B' X B)^-1 B' X A + Q, by structure-preserving doubling (Chu, Fan and
    Lin 2005). It converges quadratically, also where multipliers are so small that the eigenvectors
    of the equation, from which `scipy.linalg.solve_discrete_are` builds X, cannot be ordered.

    Parameters
    ----------
    a, b : array, shape (states, states) and (states, inputs)
        The matrices A and B of x' = A x + B u.
    state, inputs : array, shape (states, states) and (inputs, inputs)
        The symmetric weights Q and R.

    Raises
    ------
    ConfigurationError
        If no gain stabilises the system.

    Examples
    --------
    >>> riccati(np.array([[2.0]]), np.eye(1), np.eye(1), np.eye(1)).round(6)
    array([[4.236068]])
    """
    identity, solution = np.eye(len(a)), state
    reach = b @ np.linalg.solve(inputs, b.T)
    for _ in range(MOST_DOUBLINGS):
        with np.errstate(all="ignore"):
            step = np.linalg.solve(identity + reach @ solution, np.hstack([a, reach]))
            moved, spread = step[:, : len(a)], step[:, len(a) :]
            change = moved.T @ solution @ a
            a, reach, solution = a @ moved, reach + a @ spread @ a.T, solution + change
        if not np.isfinite(solution).all():
            break
        if np.abs(change).max() <= np.finfo(float).eps * np.abs(solution).max():
            symmetric: Floats = (solution + solution.T) / 2.0
            return symmetric
    rule = "no gain stabilises the orbit or its estimate: the Riccati equation has no solution"
    raise ConfigurationError(f"{rule}; change another input, or measure other states")


def _cyclic(blocks: Floats) -> Floats:
    """Return one matrix for all mesh periods: block n leads from period n to the next one."""
    periods, rows, columns = blocks.shape
    matrix = np.zeros((periods * rows, periods * columns))
    for n, block in enumerate(blocks):
        after = (n + 1) % periods
        matrix[after * rows : (after + 1) * rows, n * columns : (n + 1) * columns] = block
    return matrix
