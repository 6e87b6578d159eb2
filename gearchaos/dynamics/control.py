"""Linear control of periodic orbits: linearised period maps, gains, and estimates of the state.

At the beginning of mesh period n a controller adds u to the steady input of the model, the load of
a gear pair. About a periodic orbit r of p mesh periods the section obeys::

    x_n+1 - r_j+1 = J_j (x_n - r_j) + b_j u_n,    j = n mod p

J_j is the Jacobian of the map over mesh period j, b_j its derivative by the input. Both are columns
of the tangent frame of the kernels.
"""

from collections import deque
from typing import NamedTuple

import numpy as np
import scipy.linalg
from gearchaos_kernels import Control, LaneSystem, Plan, integrate

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.riccati import riccati
from gearchaos.errors import ConfigurationError

PROBE = 1e-3
"""Length of the tangent vector with which the input of the tangent frame is 1."""

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
        after, found = np.eye(self.points.shape[1]), []
        for jacobian, response in zip(self.jacobians[::-1], self.responses[::-1], strict=True):
            found.append(after @ response)
            after = after @ jacobian
        return np.column_stack(found[::-1])

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
        forced = self.responses[:, :, np.newaxis] * gain[:, np.newaxis]
        # The newest state first. Each is given by rows of derivatives by all states before.
        known = deque(np.split(np.eye(states * (periods + 1)), periods + 1))
        for free, change in zip(self.jacobians - forced, forced, strict=True):
            known.appendleft(free @ known[0] + change @ known.pop())
        return np.vstack(known)


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

    The cost is the sum of q |x - r|^2 + r u^2 over all mesh periods (Bittanti and Colaneri 2009).
    """
    a, b, states = maps.jacobians, maps.responses[:, :, np.newaxis], maps.points.shape[1]
    cost = riccati(a, b, state_weight * np.eye(states), input_weight * np.eye(1))
    # The input of a mesh period acts on the states at the end of this period.
    priced = b.transpose(0, 2, 1) @ np.roll(cost, -1, axis=0)
    gain: Floats = priced @ a / (input_weight + priced @ b)
    return gain[:, 0]


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
    # The dual of the gains: transposed maps, backwards in time.
    states = maps.points.shape[1]
    a, c = maps.jacobians[::-1].transpose(0, 2, 1), np.eye(states)[measured]
    variance, signals = np.diag(noise**2), np.broadcast_to(c.T, (len(a), *c.T.shape))
    backwards = riccati(a, signals, np.diag(disturbance**2), variance)
    predicted = np.roll(backwards[::-1], 1, axis=0)
    seen = c @ predicted
    return np.asarray(np.linalg.solve(seen @ c.T + variance, seen).transpose(0, 2, 1))
