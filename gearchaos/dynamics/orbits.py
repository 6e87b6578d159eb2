"""Periodic orbits and their Floquet multipliers, found by Newton's method on the resolved map."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import STATE_ROWS, Model, Plan, Scene, integrate
from numpy.typing import NDArray

from gearchaos.dynamics.exponents import period_jacobian, state_columns
from gearchaos.records.period import TOLERANCE, coordinate_scale

Floats = NDArray[np.float64]

CLOSED = 1e-12
"""Return distance, relative to the scale of each coordinate, at which an orbit is closed."""

NEIGHBOURHOOD = 0.1
"""An orbit further from its guess than this, in the same measure, is another one."""

NEWTON_STEPS = 10

_SHARES = (1.0, 0.5, 0.25)


class Orbits(NamedTuple):
    """Periodic orbits of some lanes.

    ``points`` (lanes, 10): the state at tau = 0, columns as in `STATE_ROWS`; ``multipliers``
    (lanes, states), complex: the Floquet multipliers, largest modulus first; both are not a number
    where no orbit was found. ``residual`` (lanes,): largest distance after one period of the orbit,
    relative to the scale of each coordinate; ``converged`` (lanes,).
    """

    points: Floats
    multipliers: NDArray[np.complex128]
    residual: Floats
    converged: NDArray[np.bool_]

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether there is an orbit, and all its multipliers lie inside the unit circle."""
        inside: NDArray[np.bool_] = np.abs(self.multipliers[:, 0]) < 1.0
        return inside


class _Map(NamedTuple):
    """The map over a number of mesh periods, for some lanes."""

    scene: Scene
    model: Model
    stiffness_cosine: Floats
    stiffness_sine: Floats
    plan: Plan
    rederived: bool

    def of(self, lanes: NDArray[np.intp]) -> _Map:
        return self._replace(model=Model(*(group[lanes] for group in self.model)))

    def section(self, start: Floats) -> Floats:
        """Return the states after each mesh period, shape (lanes, periods, 10)."""
        return integrate(*self._arguments(start), rederived=self.rederived).section

    def jacobian(self, start: Floats) -> Floats:
        return period_jacobian(*self._arguments(start), rederived=self.rederived)

    def _arguments(self, start: Floats) -> tuple[Scene, Model, Floats, Floats, Floats, Plan]:
        scene, model, cosine, sine, plan, _ = self
        return scene, model, cosine, sine, start, plan


def polish(
    scene: Scene,
    model: Model,
    stiffness_cosine: Floats,
    stiffness_sine: Floats,
    guess: Floats,
    period: NDArray[np.int32],
    steps_per_period: int,
    *,
    rederived: bool = False,
) -> Orbits:
    """Find the periodic orbit next to the guess of every lane.

    Newton's method on the map over ``period`` mesh periods, with its Jacobian from the tangent
    flow. A step is halved until the return distance falls and the point stays near the guess. A
    coordinate is measured by its largest magnitude on the section of the guess, or by a thousandth
    of that of the largest coordinate where this is more.

    Parameters
    ----------
    scene, model, stiffness_cosine, stiffness_sine, rederived
        As for `gearchaos_kernels.integrate`.
    guess : ndarray, shape (lanes, 10)
        States of eq. 13 at tau = 0, columns as in `STATE_ROWS`.
    period : ndarray of int, shape (lanes,)
        In mesh periods; 0 where there is no orbit to look for.
    steps_per_period : int
        Resolved steps per mesh period.

    Returns
    -------
    Orbits
        ``converged`` is false where Newton's method does not close the orbit, where it leads out
        of the neighbourhood of the guess, where the orbit found repeats after a divisor of
        ``period`` already, and where the period is 0.
    """
    lanes, columns = guess.shape[0], state_columns(scene)
    found = Orbits(
        points=np.full(guess.shape, np.nan),
        multipliers=np.full((lanes, len(columns)), np.nan, dtype=np.complex128),
        residual=np.full(lanes, np.nan),
        converged=np.zeros(lanes, dtype=np.bool_),
    )
    # With a tangent, so that map and Jacobian are compiled once and agree bit for bit.
    plan = Plan(steps_per_period, 0, 0, 0, tuple(STATE_ROWS), tangent=True)
    for n in np.unique(period[period > 0]):
        chosen = np.flatnonzero(period == n)
        plan = plan._replace(recorded_periods=int(n), section_points=int(n))
        every = _Map(scene, model, stiffness_cosine, stiffness_sine, plan, rederived)
        group = _polish(every.of(chosen), guess[chosen], columns)
        for whole, part in zip(found, group, strict=True):
            whole[chosen] = part
    return found


def orbit_exponent(
    multipliers: NDArray[np.complex128], period: NDArray[np.int32], mesh_period: Floats
) -> Floats:
    """Return the largest Lyapunov exponent of periodic orbits, per unit of tau.

    Parameters
    ----------
    multipliers : ndarray, shape (lanes, states)
        As in `Orbits`.
    period : ndarray of int, shape (lanes,)
        Period of the orbit in mesh periods; 0 only where the multipliers are not a number.
    mesh_period : ndarray, shape (lanes,)
        In units of tau.

    Returns
    -------
    ndarray, shape (lanes,)
        Not a number where the multipliers are not.
    """
    exponent: Floats = np.log(np.abs(multipliers[:, 0])) / (np.maximum(period, 1) * mesh_period)
    return exponent


def _polish(system: _Map, guess: Floats, columns: list[int]) -> Orbits:
    """Polish lanes of one period."""
    lanes = np.arange(guess.shape[0])
    points = np.zeros_like(guess)
    points[:, columns] = guess[:, columns]
    start, section = points.copy(), system.section(points)
    scale = coordinate_scale(section)
    residual = _distance(section[:, -1], points, scale)
    searching = np.isfinite(residual)
    for _ in range(NEWTON_STEPS):
        searching &= residual > CLOSED
        rest = lanes[searching]
        if not rest.size:
            break
        step = np.zeros_like(points)
        step[rest[:, np.newaxis], columns] = _newton_step(
            system.of(rest).jacobian(points[rest]),
            (section[rest, -1] - points[rest])[:, columns],
        )
        for share in _SHARES:
            trial = points[rest] + share * step[rest]
            passed = system.of(rest).section(trial)
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
    multipliers = np.full((lanes.size, len(columns)), np.nan, dtype=np.complex128)
    if closed.size:
        multipliers[closed] = _multipliers(system.of(closed).jacobian(points[closed]))
    return Orbits(points, multipliers, residual, converged)


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


def _repeats_earlier(section: Floats, points: Floats, scale: Floats) -> NDArray[np.bool_]:
    """Whether a point comes back after a proper divisor of the period."""
    periods = section.shape[1]
    repeats = np.zeros(points.shape[0], dtype=np.bool_)
    for divisor in range(1, periods // 2 + 1):
        if periods % divisor == 0:
            repeats |= _distance(section[:, divisor - 1], points, scale) <= TOLERANCE
    return repeats


def _multipliers(jacobian: Floats) -> NDArray[np.complex128]:
    multipliers = np.linalg.eigvals(jacobian).astype(np.complex128)
    order = np.argsort(-np.abs(multipliers), axis=1, kind="stable")
    return np.take_along_axis(multipliers, order, axis=1)
