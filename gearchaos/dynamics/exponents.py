"""All Lyapunov exponents of a system, and the Jacobian of its map over mesh periods.

The kernels carry one tangent vector per lane. Here every lane is repeated once per state, and each
copy carries a different tangent vector; the copies have bit-identical motions. Lengths and angles
of tangent vectors are Euclidean in the dimensionless states.
"""

from typing import NamedTuple, Self

import numpy as np
from gearchaos_kernels import LANES, LaneSystem, Outcome, Plan, integrate, jacobian
from gearchaos_kernels.recorders.frame import SMALLEST_RESOLVED

from gearchaos.arrays import Floats
from gearchaos.dynamics.modes import memory
from gearchaos.records.lyapunov import largest_exponent


class Exponents(NamedTuple):
    """Lyapunov exponents, largest first, per unit of tau.

    Attributes
    ----------
    values : array, shape (lanes, states)
        Exponents, NaN where they are not resolved; shape (states,) from `System.exponents`.
    standard_errors : array, shape (lanes, states)
        Their standard errors.
    """

    values: Floats
    standard_errors: Floats

    def given(self, exact: Floats) -> Self:
        """Return the exponents with lanes replaced whose first exponent is known exactly.

        ``exact`` (lanes, states): NaN where no exponent is known, or where rounding hides it.
        """
        known = np.broadcast_to(np.isfinite(exact[:, :1]), exact.shape)
        return type(self)(
            np.where(known, exact, self.values),
            np.where(known, np.where(np.isfinite(exact), 0.0, np.nan), self.standard_errors),
        )


def exponents(system: LaneSystem, start: Floats, plan: Plan) -> Exponents:
    """Compute all Lyapunov exponents of every lane.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    start : array, shape (lanes, states)
        States at tau = 0.
    plan : Plan
        Method, steps and periods.

    Returns
    -------
    Exponents
        Per unit of tau; NaN in lanes that diverged, and from the first exponent on that double
        precision does not resolve. Two directions are parallel after one period if their exponents
        times the mesh period differ by more than about 18.

    Notes
    -----
    An orthonormal frame of tangent vectors is orthonormalised after every mesh period, also during
    the transient (Benettin et al. 1980). The logarithms of the stretches are averaged as those of a
    single vector, see `largest_exponent`. `sum_of_exponents` is an exact check.
    """
    lanes, states = start.shape
    logarithms = _stretches(system, start, plan)
    mean, error = largest_exponent(
        logarithms.reshape(lanes * states, -1),
        np.repeat(system.mesh_period, states),
        np.repeat(memory(system), states),
    )
    mean, error = mean.reshape(lanes, states), error.reshape(lanes, states)
    descending = np.argsort(-mean, axis=1, kind="stable")
    return Exponents(*(np.take_along_axis(found, descending, axis=1) for found in (mean, error)))


def _stretches(system: LaneSystem, start: Floats, plan: Plan) -> Floats:
    """Return the logarithms by which a frame stretches, shape (lanes, states, recorded periods).

    They are NaN from the first direction on that double precision does not resolve.
    """
    lanes, states = start.shape
    # The first vector has equal components, as the single vector of the kernels.
    frame, _ = np.linalg.qr(np.column_stack([np.ones(states), np.eye(states)[:, 1:]]))
    if states > LANES:
        return _stretches_by_period(
            system, start, np.broadcast_to(frame, (lanes, *frame.shape)), plan
        )
    lengths = plan.steps_per_period, plan.transient_periods, plan.recorded_periods
    framed = Plan(
        *lengths,
        section_points=0,
        tangent=True,
        resolved=plan.resolved,
        method=plan.method,
        first_period=plan.first_period,
        frame=True,
    )
    outcome = integrate(
        system.repeated(states),
        np.repeat(start, states, axis=0),
        framed,
        tangent_start=np.tile(frame.T, (lanes, 1)),
    )
    return outcome.growth.reshape(lanes, states, -1)


def _stretches_by_period(system: LaneSystem, state: Floats, frame: Floats, plan: Plan) -> Floats:
    """Return what `_stretches` returns; the kernels have no frames of more than 32 states."""
    lanes, states = state.shape
    logarithms = np.full((lanes, states, plan.recorded_periods), np.nan)
    for period in range(-plan.transient_periods, plan.recorded_periods):
        once = plan._replace(recorded_periods=1, first_period=plan.transient_periods + period)
        state, vectors, growth = _carry(system, state, frame, once)
        frame, triangle = np.linalg.qr(vectors)
        left = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
        resolved = np.logical_and.accumulate(left > SMALLEST_RESOLVED, axis=1)
        if period >= 0:
            logarithms[:, :, period] = growth[:, :, 0] + np.log(np.where(resolved, left, np.nan))
    return logarithms


def sum_of_exponents(system: LaneSystem, contact: Floats | None = None) -> Floats:
    """Return the sum of all Lyapunov exponents of every lane.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    contact : array, shape (lanes, elements), optional
        The share of the time in which each element is in contact. Only dampers that act in contact
        only need it.

    Returns
    -------
    array, shape (lanes,)
        Sum per unit of tau; NaN if it depends on shares of contact that are not given, or with
        friction on the phases of contact.

    Notes
    -----
    The sum is the mean trace of the Jacobian. A damper that always acts has a constant share in it,
    which depends neither on contact nor on stiffness or excitation. For the full scene of eq. 13 of
    Pan, Li, Wang 2021 the trace is::

        -2 xi [cos(beta_b) (1 + m_e/m_p + m_e/m_g) + sin(beta_b) (m_e/m_p + m_e/m_g)]
        -2 (eta_11 + eta_21 + eta_12 + eta_22)

    A damper that acts in contact only has its share in proportion to the time of contact. The jump
    of its force adds nothing: the saltation matrix changes rates in proportion to displacements, so
    that its determinant is 1.
    """
    touching = np.ones((system.lanes, system.elements))
    trace: Floats = np.trace(jacobian(system, touching), axis1=1, axis2=2)
    total = trace.copy()
    for element in np.flatnonzero(system.damped_in_contact):
        apart = touching.copy()
        apart[:, element] = 0.0
        lost = np.trace(jacobian(system, apart), axis1=1, axis2=2) - trace
        share = np.full(system.lanes, np.nan) if contact is None else contact[:, element]
        if system.damping_changes:
            # The phases at which the element is in contact matter, unless it always or never is.
            share = np.where((share > 0.0) & (share < 1.0), np.nan, share)
        total += lost * (1.0 - share)
    return total


def contact_shares(outcome: Outcome, plan: Plan) -> Floats | None:
    """Return the share of the record in which each element is in contact, (lanes, elements).

    None if the record does not contain them.
    """
    if not (plan.contact and outcome.contact.shape[1]):
        return None
    shares: Floats = (outcome.contact[..., 0] + outcome.contact[..., 2]) / plan.recorded_periods
    return shares


def period_jacobian(system: LaneSystem, start: Floats, plan: Plan) -> Floats:
    """Return the Jacobian of the map over the recorded mesh periods, without a transient.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    start : array, shape (lanes, states)
        States at tau = 0.
    plan : Plan
        Method, steps and recorded periods.

    Returns
    -------
    array, shape (lanes, states, states)
        Column j is the derivative by state j; NaN in lanes that diverged. For a periodic orbit over
        its period this is the monodromy matrix; its eigenvalues are the Floquet multipliers.
    """
    lanes, states = start.shape
    frame = np.broadcast_to(np.eye(states), (lanes, states, states))
    _, vectors, growth = _carry(system, start, frame, plan)
    lengths: Floats = np.exp(np.sum(growth, axis=2))
    return vectors * lengths[:, np.newaxis, :]


def _carry(
    system: LaneSystem, start: Floats, frame: Floats, plan: Plan
) -> tuple[Floats, Floats, Floats]:
    """Integrate every lane once for every column of its frame (lanes, states, states).

    Returns end states (lanes, states), unit tangent vectors as columns (lanes, states, states), and
    the logarithms of their growth (lanes, states, periods).
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
