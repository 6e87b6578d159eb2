"""All Lyapunov exponents of a system, and the Jacobian of its map over mesh periods.

The kernels carry one tangent vector per lane. Here every lane is repeated once per state, each copy
with a tangent vector of its own; the copies see the same motion bit for bit. Lengths and angles of
tangent vectors are the Euclidean ones of the states of eq. 13.
"""

from typing import NamedTuple, Self

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate, jacobian

from gearchaos.arrays import Floats
from gearchaos.dynamics.modes import memory
from gearchaos.records.lyapunov import largest_exponent

SMALLEST_RESOLVED = 1e-8
"""Share of a tangent vector that must be left when those before it are taken out."""


class Exponents(NamedTuple):
    """Lyapunov exponents and their standard errors, shape (lanes, states), largest first."""

    values: Floats
    standard_errors: Floats

    def given(self, exact: Floats) -> Self:
        """Return them with all of a lane replaced of which the first one is known exactly.

        ``exact`` (lanes, states): not a number where none is known, or where rounding hides it.
        """
        known = np.broadcast_to(np.isfinite(exact[:, :1]), exact.shape)
        return type(self)(
            np.where(known, exact, self.values),
            np.where(known, np.where(np.isfinite(exact), 0.0, np.nan), self.standard_errors),
        )


def exponents(system: LaneSystem, start: Floats, plan: Plan) -> Exponents:
    """Compute all Lyapunov exponents of every lane, per unit of tau.

    An orthonormal frame of tangent vectors is carried along and made orthonormal again after every
    mesh period, from the transient on (Benettin et al. 1980). The logarithms of the stretches of
    the recorded periods are averaged as those of a single vector are, see `largest_exponent`; the
    first vector of the frame is that single vector.

    ``start`` (lanes, states) at tau = 0; of the plan only steps and periods count. Exponents are
    not a number in lanes that diverged, and from the first one on that the numbers do not resolve:
    two directions whose exponents times the mesh period differ by more than about 18 are parallel
    in double precision after one period. `sum_of_exponents` is an exact check.
    """
    lanes, states = start.shape
    logarithms = np.full((lanes, states, plan.recorded_periods), np.nan)
    # The first vector is an equal share of every state, as a single vector is.
    frame, _ = np.linalg.qr(np.column_stack([np.ones(states), np.eye(states)[:, 1:]]))
    frame, state = np.broadcast_to(frame, (lanes, states, states)), start
    for period in range(-plan.transient_periods, plan.recorded_periods):
        once = plan._replace(recorded_periods=1, first_period=plan.transient_periods + period)
        state, vectors, growth = _carry(system, state, frame, once)
        frame, triangle = np.linalg.qr(vectors)
        left = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
        resolved = np.logical_and.accumulate(left > SMALLEST_RESOLVED, axis=1)
        if period >= 0:
            logarithms[:, :, period] = growth[:, :, 0] + np.log(np.where(resolved, left, np.nan))
    mean, error = largest_exponent(
        logarithms.reshape(lanes * states, -1),
        np.repeat(system.mesh_period, states),
        np.repeat(memory(system), states),
    )
    mean, error = mean.reshape(lanes, states), error.reshape(lanes, states)
    descending = np.argsort(-mean, axis=1, kind="stable")
    return Exponents(*(np.take_along_axis(found, descending, axis=1) for found in (mean, error)))


def sum_of_exponents(system: LaneSystem) -> Floats:
    """Return the sum of all Lyapunov exponents of every lane, per unit of tau, shape (lanes,).

    It is the trace of the Jacobian. The damping is constant and also acts out of contact, so that
    the trace depends neither on contact nor on stiffness or excitation. For the full scene of
    eq. 13 it is::

        -2 xi [cos(beta_b) (1 + m_e/m_p + m_e/m_g) + sin(beta_b) (m_e/m_p + m_e/m_g)]
        -2 (eta_11 + eta_21 + eta_12 + eta_22)
    """
    apart = np.zeros((system.lanes, system.elements))
    trace: Floats = np.trace(jacobian(system, apart), axis1=1, axis2=2)
    return trace


def period_jacobian(system: LaneSystem, start: Floats, plan: Plan) -> Floats:
    """Return the Jacobian of the map over the recorded mesh periods, with no transient before.

    On a periodic orbit over its own number of periods this is the monodromy matrix, whose
    eigenvalues are the Floquet multipliers. Of shape (lanes, states, states), column j the
    derivative with respect to state j; not a number in lanes that diverged.
    """
    lanes, states = start.shape
    frame = np.broadcast_to(np.eye(states), (lanes, states, states))
    _, vectors, growth = _carry(system, start, frame, plan)
    lengths: Floats = np.exp(np.sum(growth, axis=2))
    return vectors * lengths[:, np.newaxis, :]


def _carry(
    system: LaneSystem, start: Floats, frame: Floats, plan: Plan
) -> tuple[Floats, Floats, Floats]:
    """Integrate every lane over its recorded periods for every column of its frame, at once.

    The frame is of shape (lanes, states, states). Return end states (lanes, states), unit tangent
    vectors as columns, logarithms of their growth.
    """
    lanes, states, _ = frame.shape
    outcome = integrate(
        system.repeated(states),
        np.repeat(start, states, axis=0),
        plan._replace(transient_periods=0, section_points=0, history_periods=0, tangent=True),
        tangent_start=frame.transpose(0, 2, 1).reshape(-1, states),
    )
    vectors = outcome.end_tangent.reshape(lanes, states, states).transpose(0, 2, 1)
    return outcome.end_state[::states], vectors, outcome.growth.reshape(lanes, states, -1)
