"""Periodic orbits and their Floquet multipliers, found by Newton's method on the resolved map."""

from typing import Any, NamedTuple, Self

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Complex, Counts, Floats, Integers, Mask
from gearchaos.dynamics.period_maps import PeriodMaps
from gearchaos.records.period import TOLERANCE, coordinate_scale

CLOSED = 1e-12
"""Return distance, relative to the scale of each state, below which an orbit is closed."""

ROUNDING_OF_STATES = 1e-13
"""Return distance, relative to the largest state, below which an orbit is closed as well.

Rounding errors of a large state reach all others. They may exceed `CLOSED` times a small scale.
"""

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
    system: LaneSystem,
    guess: Floats,
    period: Counts,
    plan: Plan,
    scale: Floats | None = None,
    reach: float = NEIGHBOURHOOD,
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
    reach : float
        Largest distance between an orbit and its guess, in these scales.

    Returns
    -------
    Orbits
        Those of the closed loop, without noise, if the system has controllers. A lane has no orbit
        if its period is 0, if its controller has an estimate or a delay, which the state lacks, if
        Newton's method does not close the orbit within the neighbourhood of the guess, or if the
        orbit repeats after a divisor of the period.

    Notes
    -----
    Newton's method solves P(x) = x, P the map over the period; its Jacobian is integrated with the
    motion. A step is halved until the return distance falls. A state is measured by its largest
    magnitude on the section, or by a thousandth of the largest state if that is more. An orbit is
    closed if the return distance is below `CLOSED` in this measure, or below `ROUNDING_OF_STATES`
    times the largest state.
    """
    remembers = system.control is not None and system.control.remembers
    chosen = np.flatnonzero((period > 0) & (not remembers))
    orbits = Orbits(
        points=np.full(guess.shape, np.nan),
        multipliers=np.full(guess.shape, np.nan, dtype=np.complex128),
        monodromy=np.full((*guess.shape, guess.shape[1]), np.nan),
        residual=np.full(guess.shape[0], np.nan),
        converged=np.zeros(guess.shape[0], dtype=np.bool_),
    )
    if chosen.size:
        maps = PeriodMaps.with_method(system.of(chosen), period[chosen], plan)
        search = _Search(maps, guess[chosen], scale, reach)
        for all_lanes, some in zip(orbits, search.found(), strict=True):
            all_lanes[chosen] = some
    return orbits


class _Search:
    """Newton's method for the orbits of some lanes.

    ``guess`` (lanes, states); ``scale`` (states,): scales of the states, or None for those of the
    section of each lane; ``reach``: largest distance from the guess.
    """

    def __init__(self, maps: PeriodMaps, guess: Floats, scale: Floats | None, reach: float) -> None:
        self._maps, self._guess, self._points, self._reach = maps, guess, guess.copy(), reach
        passage = maps.passed(guess)
        self._section, self._jacobian = passage.section, passage.jacobian
        # The points before the first are NaN.
        recorded = np.where(np.isnan(self._section), self._section[:, -1:], self._section)
        given = None if scale is None else np.tile(scale, (guess.shape[0], 1))
        self._scale = coordinate_scale(recorded) if given is None else given
        self._residual = _distance(self._section[:, -1], guess, self._scale)
        # Where a part of a step is taken, the Jacobian is computed before the next step.
        self._known = np.ones(guess.shape[0], dtype=np.bool_)

    def found(self) -> Orbits:
        """Search, and return the orbits."""
        searching = np.isfinite(self._residual)
        for _ in range(NEWTON_STEPS):
            searching &= self._residual > CLOSED
            lanes = np.flatnonzero(searching)
            if not lanes.size:
                break
            searching[lanes] = self._take_step(lanes)
        converged = (self._residual <= CLOSED) | self._closed_to_rounding()
        converged &= ~_repeats_earlier(self._section, self._points, self._scale, self._maps.period)
        closed = np.flatnonzero(converged)
        self._complete(closed)
        self._points[~converged] = np.nan
        self._jacobian[~converged] = np.nan
        multipliers = np.full(self._points.shape, np.nan, dtype=np.complex128)
        if closed.size:
            found = np.linalg.eigvals(self._jacobian[closed])
            order = np.argsort(-np.abs(found), axis=1, kind="stable")
            multipliers[closed] = np.take_along_axis(found, order, axis=1)
        return Orbits(self._points, multipliers, self._jacobian, self._residual, converged)

    def _closed_to_rounding(self) -> Mask:
        """Whether the last point returns as closely as rounding allows, (lanes,)."""
        largest = np.max(np.abs(self._points), axis=1, keepdims=True)
        largest = np.maximum(largest, np.finfo(np.float64).tiny)
        distance = _distance(self._section[:, -1], self._points, largest)
        closed: Mask = np.isfinite(self._residual) & (distance <= ROUNDING_OF_STATES)
        return closed

    def _take_step(self, lanes: Integers) -> Mask:
        """Take the largest share of a Newton step that closes lanes better; return where any does.

        All shares are tried side by side, the whole step together with its Jacobian.
        """
        self._complete(lanes)
        points, section = self._points[lanes], self._section[lanes]
        step = _newton_step(self._jacobian[lanes], section[:, -1] - points)
        trials = points + np.multiply.outer(np.array(_SHARES), step)
        maps, parts = self._maps.of(lanes), np.tile(np.arange(lanes.size), len(_SHARES) - 1)
        whole = maps.passed(trials[0], np.concatenate(trials[1:]), parts)
        passed = np.concatenate([whole.section, whole.aside]).reshape(-1, *section.shape)
        taken = np.zeros(lanes.size, dtype=np.bool_)
        for number, share in enumerate(_SHARES):
            distance = _distance(passed[number, :, -1], trials[number], self._scale[lanes])
            # At least half of the predicted decrease: beyond a fold it falls, but not to 0.
            better = ~taken & (distance < (1.0 - share / 2.0) * self._residual[lanes])
            away = _distance(trials[number], self._guess[lanes], self._scale[lanes])
            better &= away < self._reach
            one = lanes[better]
            self._points[one], self._section[one] = trials[number, better], passed[number, better]
            self._jacobian[one], self._known[one] = whole.jacobian[better], number == 0
            self._residual[one] = distance[better]
            taken |= better
        return taken

    def _complete(self, lanes: Integers) -> None:
        """Compute missing Jacobians at the points of lanes."""
        lanes = lanes[~self._known[lanes]]
        if lanes.size:
            self._jacobian[lanes] = self._maps.of(lanes).passed(self._points[lanes]).jacobian
            self._known[lanes] = True


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


def _repeats_earlier(section: Floats, points: Floats, scale: Floats, period: Counts) -> Mask:
    """Whether an orbit returns after a proper divisor of its period, (lanes,)."""
    repeats = np.zeros(points.shape[0], dtype=np.bool_)
    for divisor in range(1, int(period.max(initial=0)) // 2 + 1):
        lanes = np.flatnonzero((period % divisor == 0) & (period > divisor))
        returned = section[lanes, divisor - 1 - period[lanes]]
        repeats[lanes] |= _distance(returned, points[lanes], scale[lanes]) <= TOLERANCE
    return repeats


def exponents_of(
    system: LaneSystem, plan: Plan, points: Floats, multipliers: Complex, period: int
) -> Floats:
    """Return the largest Lyapunov exponent of orbits of one period, per unit of tau, (lanes,).

    ``points`` (lanes, states): their states at mesh phase 0; ``multipliers`` (lanes, states):
    largest modulus first. Where the multipliers of long orbits are smaller than the smallest
    number, a tangent vector is followed instead.
    """
    size, duration = np.abs(multipliers[:, 0]), period * system.excitation_period
    with np.errstate(divide="ignore"):
        found: Floats = np.log(size) / duration
    (vanished,) = np.nonzero(size == 0.0)
    if vanished.size:
        whole = period * system.repeats_after
        # During the first turn the vector takes the direction that decays most slowly.
        turns = plan.over(whole, whole)._replace(tangent=True)
        growth = integrate(system.of(vanished), points[vanished], turns).growth
        found[vanished] = growth.sum(axis=1) / duration[vanished]
    return found
