"""Periodic orbits and their Floquet multipliers, found by Newton's method on the resolved map."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Complex, Counts, Floats, Mask
from gearchaos.dynamics.exponents import period_jacobian
from gearchaos.records.period import TOLERANCE, coordinate_scale

CLOSED = 1e-12
"""Return distance, relative to the scale of each coordinate, at which an orbit is closed."""

NEIGHBOURHOOD = 0.1
"""An orbit further from its guess than this, in the same measure, is another one."""

NEWTON_STEPS = 10

_SHARES = (1.0, 0.5, 0.25)


class Orbits(NamedTuple):
    """Periodic orbits of some lanes.

    ``points`` (lanes, states): the state at tau = 0; ``multipliers`` (lanes, states), complex: the
    Floquet multipliers, largest modulus first; ``monodromy`` (lanes, states, states): the Jacobian
    of the map over one period of the orbit, whose eigenvalues they are; all three are not a number
    where no orbit was found. ``residual`` (lanes,): largest distance after one period of the orbit,
    relative to the scale of each coordinate; ``converged`` (lanes,).
    """

    points: Floats
    multipliers: Complex
    monodromy: Floats
    residual: Floats
    converged: Mask

    @property
    def stable(self) -> Mask:
        """Whether there is an orbit, and all its multipliers lie inside the unit circle."""
        inside: Mask = np.abs(self.multipliers[:, 0]) < 1.0
        return inside


def polish(system: LaneSystem, guess: Floats, period: Counts, plan: Plan) -> Orbits:
    """Find the periodic orbit next to the guess of every lane.

    Newton's method on the map over ``period`` excitation periods, with its Jacobian from the
    tangent flow. A step is halved until the return distance falls and the point stays near the
    guess. A coordinate is measured by its largest magnitude on the section of the guess, or by a
    thousandth of that of the largest coordinate where this is more.

    ``guess`` (lanes, states): states of eq. 13 at tau = 0; ``period`` (lanes,) in excitation
    periods, see `LaneSystem.repeats_after`, 0 where there is no orbit to look for; of the ``plan``
    only method and steps per period count, which are resolved. Not converged is a lane in which
    Newton's method does not close the orbit or leads out of the neighbourhood of the guess, in
    which the orbit found repeats after a divisor of the period, or whose period is 0.
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
        # With a tangent, so that map and Jacobian are compiled once and agree bit for bit.
        whole = n * system.repeats_after
        once = Plan(plan.steps_per_period, 0, whole, whole, tangent=True, method=plan.method)
        polished = _polish(system.of(chosen), guess[chosen], once)
        for all_lanes, some in zip(found, polished, strict=True):
            all_lanes[chosen] = some
    return found


def _polish(system: LaneSystem, guess: Floats, plan: Plan) -> Orbits:
    """Polish lanes of one period."""
    lanes = np.arange(guess.shape[0])
    start, points = guess, guess.copy()
    repeats = system.repeats_after
    section = integrate(system, points, plan).every(repeats).section
    scale = coordinate_scale(section)
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
            # Half of what the tangent promises: beyond a fold the distance falls, but not to 0.
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
    """Solve (1 - J) step = returned, with NaN where that has no solution."""
    matrix = np.eye(jacobian.shape[-1]) - jacobian
    soluble = np.abs(np.linalg.det(matrix)) > 0.0
    step = np.full(returned.shape, np.nan)
    step[soluble] = np.linalg.solve(matrix[soluble], returned[soluble, :, np.newaxis])[..., 0]
    return step


def _distance(one: Floats, other: Floats, scale: Floats) -> Floats:
    distance: Floats = np.max(np.abs(one - other) / scale, axis=1)
    return distance


def _repeats_earlier(section: Floats, points: Floats, scale: Floats) -> Mask:
    """Whether a point comes back after a proper divisor of the period."""
    periods = section.shape[1]
    repeats = np.zeros(points.shape[0], dtype=np.bool_)
    for divisor in range(1, periods // 2 + 1):
        if periods % divisor == 0:
            repeats |= _distance(section[:, divisor - 1], points, scale) <= TOLERANCE
    return repeats
