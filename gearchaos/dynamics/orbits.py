"""Periodic orbits and their Floquet multipliers, found by Newton's method on the resolved map."""

from typing import Any, NamedTuple, Self

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Complex, Counts, Floats, Mask
from gearchaos.dynamics.exponents import period_jacobian
from gearchaos.records.period import TOLERANCE, coordinate_scale

CLOSED = 1e-12
"""Return distance, relative to the scale of each state, below which an orbit is closed."""

NEIGHBOURHOOD = 0.1
"""Largest distance between an orbit and its guess, in the same measure."""

NEWTON_STEPS = 10
"""Largest number of Newton steps."""

_SHARES = (1.0, 0.5, 0.25)
"""Shares of a Newton step that are tried in turn."""


class Orbits(NamedTuple):
    """Periodic orbits of some lanes.

    Attributes
    ----------
    points : array, shape (lanes, states)
        State at tau = 0, NaN where no orbit was found.
    multipliers : array of complex, shape (lanes, states)
        Floquet multipliers, largest modulus first, NaN where no orbit was found.
    monodromy : array, shape (lanes, states, states)
        Jacobian of the map over one period of the orbit, whose eigenvalues are the multipliers; NaN
        where no orbit was found.
    residual : array, shape (lanes,)
        Largest distance after one period of the orbit, relative to the scale of each state.
    converged : array of bool, shape (lanes,)
        Whether an orbit was found.
    """

    points: Floats
    multipliers: Complex
    monodromy: Floats
    residual: Floats
    converged: Mask

    def of(self, lanes: Any) -> Self:
        """Return the orbits of some lanes; a single number gives one lane."""
        chosen = np.atleast_1d(lanes)
        return type(self)(*(array[chosen] for array in self))

    @property
    def stable(self) -> Mask:
        """Whether there is an orbit whose multipliers all lie inside the unit circle, (lanes,)."""
        inside: Mask = np.abs(self.multipliers[:, 0]) < 1.0
        return inside


def polish(
    system: LaneSystem, guess: Floats, period: Counts, plan: Plan, scale: Floats | None = None
) -> Orbits:
    """Find the periodic orbit next to the guess of every lane.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    guess : array, shape (lanes, states)
        States at tau = 0.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 for lanes without a search.
    plan : Plan
        Method and steps per period; crossings are always resolved.
    scale : array, shape (states,), optional
        Scales of the states; by default those of the section of each lane, see the notes.

    Returns
    -------
    Orbits
        A lane has no orbit if its period is 0, if Newton's method does not close the orbit within
        the neighbourhood of the guess, or if the orbit repeats after a divisor of the period.

    Notes
    -----
    Newton's method solves P(x) = x, P the map over the period; its Jacobian is integrated with the
    motion. A step is halved until the return distance falls. A state is measured by its largest
    magnitude on the section, or by a thousandth of the largest state if that is more.
    """
    found = Orbits(
        points=np.full(guess.shape, np.nan),
        multipliers=np.full(guess.shape, np.nan, dtype=np.complex128),
        monodromy=np.full((*guess.shape, guess.shape[1]), np.nan),
        residual=np.full(guess.shape[0], np.nan),
        converged=np.zeros(guess.shape[0], dtype=np.bool_),
    )
    for n in np.unique(period[period > 0]).tolist():
        chosen = np.flatnonzero(period == n)
        # With a tangent: map and Jacobian then share one kernel and agree bit for bit.
        whole = n * system.repeats_after
        once = Plan(plan.steps_per_period, 0, whole, whole, tangent=True, method=plan.method)
        polished = _polish(system.of(chosen), guess[chosen], once, scale)
        for all_lanes, some in zip(found, polished, strict=True):
            all_lanes[chosen] = some
    return found


def _polish(system: LaneSystem, guess: Floats, plan: Plan, given: Floats | None) -> Orbits:
    """Find the orbits of lanes with one period; ``guess`` (lanes, states), ``given`` scales."""
    lanes = np.arange(guess.shape[0])
    start, points = guess, guess.copy()
    repeats = system.repeats_after
    section = integrate(system, points, plan).every(repeats).section
    scale = coordinate_scale(section) if given is None else np.tile(given, (lanes.size, 1))
    residual = _distance(section[:, -1], points, scale)
    searching = np.isfinite(residual)
    for _ in range(NEWTON_STEPS):
        searching &= residual > CLOSED
        rest = lanes[searching]
        if not rest.size:
            break
        step = np.zeros_like(points)
        step[rest] = _newton_step(
            period_jacobian(system.of(rest), points[rest], plan), section[rest, -1] - points[rest]
        )
        for share in _SHARES:
            trial = points[rest] + share * step[rest]
            passed = integrate(system.of(rest), trial, plan).every(repeats).section
            distance = _distance(passed[:, -1], trial, scale[rest])
            # At least half of the predicted decrease: beyond a fold it falls, but not to 0.
            better = distance < (1.0 - share / 2.0) * residual[rest]
            better &= _distance(trial, start[rest], scale[rest]) < NEIGHBOURHOOD
            taken = rest[better]
            points[taken], section[taken] = trial[better], passed[better]
            residual[taken] = distance[better]
            rest = rest[~better]
            if not rest.size:
                break
        searching[rest] = False
    converged = (residual <= CLOSED) & ~_repeats_earlier(section, points, scale)
    closed = lanes[converged]
    points[~converged] = np.nan
    multipliers = np.full(points.shape, np.nan, dtype=np.complex128)
    monodromy = np.full((*points.shape, points.shape[1]), np.nan)
    if closed.size:
        monodromy[closed] = period_jacobian(system.of(closed), points[closed], plan)
        found = np.linalg.eigvals(monodromy[closed])
        order = np.argsort(-np.abs(found), axis=1, kind="stable")
        multipliers[closed] = np.take_along_axis(found, order, axis=1)
    return Orbits(points, multipliers, monodromy, residual, converged)


def _newton_step(jacobian: Floats, returned: Floats) -> Floats:
    """Solve (1 - J) step = returned, (lanes, states); NaN where there is no solution."""
    matrix = np.eye(jacobian.shape[-1]) - jacobian
    soluble = np.abs(np.linalg.det(matrix)) > 0.0
    step = np.full(returned.shape, np.nan)
    step[soluble] = np.linalg.solve(matrix[soluble], returned[soluble, :, np.newaxis])[..., 0]
    return step


def _distance(one: Floats, other: Floats, scale: Floats) -> Floats:
    """Return the largest scaled difference of states (lanes, states), shape (lanes,)."""
    distance: Floats = np.max(np.abs(one - other) / scale, axis=1)
    return distance


def _repeats_earlier(section: Floats, points: Floats, scale: Floats) -> Mask:
    """Whether an orbit returns after a proper divisor of its period, (lanes,)."""
    periods = section.shape[1]
    repeats = np.zeros(points.shape[0], dtype=np.bool_)
    for divisor in range(1, periods // 2 + 1):
        if periods % divisor == 0:
            repeats |= _distance(section[:, divisor - 1], points, scale) <= TOLERANCE
    return repeats
