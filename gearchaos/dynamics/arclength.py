"""The curve of a periodic orbit over a parameter, continued around its folds.

Pseudo-arclength continuation (Keller 1977): state and parameter are unknown together, and a step
follows the tangent of the curve. A fold is a regular point of the curve. The multiplier is
therefore found on both sides of +1, however fast it changes with the parameter.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, Self

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem, Plan, integrate

from gearchaos.arrays import Complex, Floats, Integers
from gearchaos.dynamics.curve_defects import DIFFERENCE, Defect, Finding, Request, defects_of
from gearchaos.dynamics.orbits import CLOSED, NEWTON_STEPS, ROUNDING_OF_STATES
from gearchaos.dynamics.side_by_side import run
from gearchaos.records.period import TOLERANCE, coordinate_scale

FIRST_STEP, LONGEST_CURVE_STEP, SHORTEST_STEP = 1e-3, 0.05, 1e-10
"""Lengths of steps along a curve: states in their scales, the parameter in shares of the way."""

STRAIGHT = 0.9
"""Least cosine between tangents of successive points; below it they are on different curves."""

MOST_CURVE_STEPS = 200
"""Largest number of points computed along one curve."""

MOST_HALVINGS = 48
"""Largest number of halvings with which the end of a curve is located."""

APART = 1e-6
"""Largest difference of the largest multiplier moduli on both sides of a located end."""

NEAR_ON_CURVE = 1e-4
"""Largest distance along the curve between both sides of a located end."""

ROUNDING = 1e-15
"""Return distance that rounding leaves, relative to the largest entry of the Jacobian."""

NEAR_ENOUGH = 1e-5
"""Longest step of Newton's method after which the derivative by the parameter is used again."""

UPRIGHT = 0.1
"""Least component of a tangent by a parameter that stays fixed while a point is corrected."""

CONTRACTION = 0.1
"""Largest ratio of successive distances with which the derivative is used again."""

HALF_RETURN = 1e-2
"""Half-period return distance below which a curve ends in an orbit of half the period.

There a multiplier approaches +1 with the square of this distance. At smaller distances the error
of the steps is larger than the deviation from +1.
"""


def is_exact(plan: Plan) -> bool:
    """Whether the method of a plan has no errors but rounding."""
    return METHODS[plan.method].always_resolved


SHORTER = 1e-6
"""Return distance after a part of the period below which an orbit is one of a shorter period."""


class CurvePoint(NamedTuple):
    """A point of a curve.

    Attributes
    ----------
    place : array, shape (states + 1,)
        The state in its scales, then the share of the way.
    tangent : array, shape (states + 1,)
        Unit vector in the direction in which the curve is followed.
    multipliers : array of complex, shape (states,)
        Floquet multipliers, largest modulus first.
    residual : float
        Return distance, in the scales of the states.
    halfway : array, shape (states,) or (0,)
        State after half the period minus the state, in the scales; empty for an odd period.
    impacts : tuple of int
        Impacts in a period of the orbit, on both flanks of each element in turn; empty if the curve
        does not count them.
    section : array, shape (periods, states)
        States at the ends of the excitation periods of the orbit, dimensionless; the last one is
        the state of the place.
    by_share : array, shape (states,)
        Derivative of the map over the period by the share of the way, in the scales.
    """

    place: Floats
    tangent: Floats
    multipliers: Complex
    residual: float
    halfway: Floats
    impacts: tuple[int, ...]
    section: Floats
    by_share: Floats

    @property
    def half_return(self) -> float:
        """Return distance after half the period, infinite for an odd period."""
        return float(np.max(np.abs(self.halfway))) if self.halfway.size else np.inf

    @property
    def share(self) -> float:
        """Share of the way at which the orbit lies."""
        return float(self.place[-1])

    @property
    def onward(self) -> bool:
        """Whether the curve advances along the way, that is, has not turned back."""
        return bool(self.tangent[-1] > 0.0)

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)

    @property
    def before_its_end(self) -> bool:
        """Whether the point lies on the stable part of the curve, before its end.

        Beyond its birth from an orbit of half the period the curve turns back, or a step leads to
        the curve of that orbit.
        """
        return self.stable and self.onward and self.half_return > TOLERANCE

    @property
    def halved(self) -> bool:
        """Whether the orbit nearly coincides with the orbit of half the period."""
        return self.half_return <= HALF_RETURN


class End(NamedTuple):
    """The last stable point of a followed curve, and the point beyond.

    Attributes
    ----------
    inner : CurvePoint or None
        Last stable point; None where the orbit at the beginning is not found again.
    beyond : CurvePoint or None
        Point beyond the end of the stable part; None where no end was located.
    """

    inner: CurvePoint | None
    beyond: CurvePoint | None


class Curve(NamedTuple):
    """The orbits of one period over a parameter.

    Attributes
    ----------
    systems_at : callable
        Returns the system of lanes from the numbers of their curves and the shares of the way, both
        (lanes,). Curves that advance side by side have the same one.
    number : int
        The number of the curve.
    plan : Plan
        Records the period of the orbit with a tangent.
    periods : int
        Period in excitation periods.
    scale : array, shape (states,)
        Scales of the states.
    ahead : int
        Number of points that are predicted and corrected side by side.
    own_maps : bool
        Whether every value of the parameter has flow maps of its own.
    difference : float
        Share of the way used on either side for the difference quotient by the parameter.
    """

    systems_at: Callable[[Integers, Floats], LaneSystem]
    number: int
    plan: Plan
    periods: int
    scale: Floats
    ahead: int = 1
    own_maps: bool = False
    difference: float = DIFFERENCE

    @property
    def exact(self) -> bool:
        """Whether orbits are exact up to rounding."""
        return is_exact(self.plan)

    def through(self, point: Floats, share: float) -> Self:
        """Return the curve with the scales of the orbit with state ``point`` at a share of it."""
        system = self.systems_at(np.array([self.number]), np.array([share]))
        passed = integrate(system, point[np.newaxis], self.plan)
        section = passed.every(system.repeats_after).section
        return self._replace(scale=coordinate_scale(section)[0])

    def corrected(self, guess: Floats, direction: Floats) -> CurvePoint | None:
        """Find the point of the curve next to a guess, in the plane normal to a direction.

        ``guess`` and ``direction``: shape (states + 1,). Newton's method; None where it does not
        converge.
        """
        return run(self.correcting(guess, direction), defects_of)

    def _closed_to_rounding(self, place: Floats, defect: Floats) -> bool:
        """Whether the defect (states,) of a place (states + 1,) is the rounding of its states."""
        largest = float(np.max(np.abs(place[:-1] * self.scale)))
        return float(np.max(np.abs(defect * self.scale))) <= ROUNDING_OF_STATES * largest

    def plane(self, direction: Floats, *tangents: Floats) -> Floats:
        """Return the normal (states + 1,) of the plane in which a point of the curve is searched.

        ``direction`` is that of the curve, ``tangents`` are those nearby. Where every share has
        flow maps of its own, the share stays fixed, unless the curve is nearly normal to it. All
        steps of Newton's method then have the same maps.
        """
        along = np.array([direction[-1], *(one[-1] for one in tangents)])
        if not self.own_maps or np.min(along * np.sign(along[0])) < UPRIGHT:
            return direction
        return along_the_way(direction.size - 1)

    def correcting(
        self,
        guess: Floats,
        direction: Floats,
        normal: Floats | None = None,
        by_share: Floats | None = None,
        reach: float = np.inf,
    ) -> Finding["CurvePoint | None"]:
        """Return the search of `corrected`; None also where it leads farther away than a reach.

        ``normal`` (states + 1,): that of the plane, by default ``direction``; ``by_share``
        (states,): derivative of the map by the share near the guess, if it is known.
        """
        normal = direction if normal is None else normal
        place, last = guess, np.inf
        for _ in range(NEWTON_STEPS):
            (defect,) = yield [Request(self, place, normal, by_share)]
            # The size is also NaN where the motion diverged.
            stalled = not defect.size < 0.5 * last
            if self._closed(place, defect, stalled):
                if not (np.isfinite(defect.slopes).all() and np.isfinite(defect.along).all()):
                    break
                return self._point(place, defect, direction)
            if stalled:
                if by_share is None:
                    break
                # An old derivative is not enough where the equations are nearly singular.
                last, by_share = np.inf, None
                continue
            # After a short step the derivative by the parameter has changed little. To compute it
            # takes another map if the parameter changes the flow maps.
            near = np.linalg.norm(defect.step) <= NEAR_ENOUGH and defect.size < CONTRACTION * last
            by_share = defect.slopes[:, -1] if self.own_maps and near else None
            place, last = place - defect.step, defect.size
            # The step is NaN where the equations are singular.
            if not np.linalg.norm(place - guess) <= reach:
                break
        return None

    def _closed(self, place: Floats, defect: Defect, stalled: bool) -> bool:
        """Whether an orbit is closed, up to rounding if Newton's method makes no progress."""
        if defect.size <= CLOSED:
            return True
        # Rounding of the state grows with the largest multiplier.
        if defect.size <= ROUNDING * float(np.max(np.abs(defect.slopes))):
            return True
        return stalled and self._closed_to_rounding(place, defect.distance)

    def doubled(self) -> Self:
        """Return the curve of orbits of twice the period, with the same scales."""
        whole = 2 * self.plan.recorded_periods
        plan = self.plan._replace(recorded_periods=whole, section_points=whole)
        return self._replace(periods=2 * self.periods, plan=plan)

    def jacobian(self, place: Floats) -> Finding[Floats]:
        """Search the Jacobian of the map over the period, in the scales, (states, states)."""
        states = self.scale.size
        (defect,) = yield [Request(self, place, along_the_way(states), np.zeros(states))]
        return defect.slopes[:, :-1] + np.eye(states)

    def _point(self, place: Floats, defect: Defect, direction: Floats) -> CurvePoint:
        """Return the point of the curve at a place with a closed orbit."""
        slopes, section = defect.slopes, defect.section
        tangent = defect.along / np.linalg.norm(defect.along)
        tangent = tangent * np.sign(tangent @ direction)
        multipliers = np.linalg.eigvals(slopes[:, :-1] + np.eye(self.scale.size))
        order = np.argsort(-np.abs(multipliers), kind="stable")
        halfway = np.zeros(0)
        if self.periods % 2 == 0:
            halfway = section[self.periods // 2 - 1] / self.scale - place[:-1]
        return CurvePoint(
            place,
            tangent,
            multipliers[order].astype(np.complex128),
            defect.size,
            halfway,
            tuple(defect.contact[:, [1, 3]].astype(int).ravel().tolist()),
            section,
            slopes[:, -1],
        )


def end_of_curve(
    curve: Curve, point: Floats, share: float, limit: float, width: float
) -> Finding[End]:
    """Follow a curve from a stable orbit onwards to where it loses stability or turns back.

    Parameters
    ----------
    curve : Curve
        The curve.
    point : array, shape (states,)
        State of the orbit at tau = 0.
    share : float
        Share of the way at which the orbit lies.
    limit : float
        Share up to which the curve is followed. If the curve is stable up to there, the inner point
        of the result lies there.
    width : float
        Largest difference in share between both sides of the end.
    """
    guess = np.append(point / curve.scale, share)
    here = yield from curve.correcting(guess, along_the_way(point.size))
    step = FIRST_STEP
    for _ in range(MOST_CURVE_STEPS if here is not None else 0):
        assert here is not None
        trial = yield from curve.correcting(here.place + step * here.tangent, here.tangent)
        bends = trial is None or trial.tangent @ here.tangent < STRAIGHT
        if trial is None or bends:
            step /= 2.0
            if step < SHORTEST_STEP:
                break
            continue
        end = End(trial, None)
        if not trial.before_its_end:
            end = yield from _located(curve, here, trial, width)
        assert end.inner is not None
        if end.inner.share >= limit:
            return End((yield from _at_share(curve, here, end.inner, limit)), None)
        if end.beyond is not None:
            return end
        here, step = end.inner, min(2.0 * step, LONGEST_CURVE_STEP)
    return End(here, None)


def along_the_way(states: int) -> Floats:
    """Return the unit vector (states + 1,) in which only the parameter changes."""
    return np.append(np.zeros(states), 1.0)


class OnCurve(Protocol):
    """A point of a curve: its place, and the unit vector in which the curve is followed.

    ``halfway``: how far the orbit is from itself after half the period, empty for odd periods;
    ``section``: its states at the ends of the excitation periods, (periods, states).
    """

    @property
    def place(self) -> Floats: ...
    @property
    def tangent(self) -> Floats: ...
    @property
    def halfway(self) -> Floats: ...
    @property
    def section(self) -> Floats: ...


def extended(last: Sequence[OnCurve], distances: Floats) -> tuple[Floats, Floats]:
    """Extend a curve beyond its last one or two points.

    The cubic through two points and their tangents is extended; one point has its tangent only.

    Parameters
    ----------
    last : sequence of OnCurve
        The last one or two points of the curve.
    distances : array, shape (distances,)
        Distances from the last point.

    Returns
    -------
    places, tangents : array, shape (distances, n)
        Places of the extension, and its unit tangents there.
    """
    *before, here = last
    step = distances[:, np.newaxis]
    ahead = here.place + step * here.tangent
    if not before:
        return ahead, np.broadcast_to(here.tangent, ahead.shape)
    chord = here.place - before[0].place
    length = np.linalg.norm(chord)
    slope, old = chord / length, before[0].tangent
    square = (2.0 * here.tangent + old - 3.0 * slope) / length
    cube = (here.tangent + old - 2.0 * slope) / length**2
    tangents = here.tangent + 2.0 * step * square + 3.0 * step**2 * cube
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    return ahead + step**2 * square + step**3 * cube, tangents


def passes_half(here: OnCurve, trial: OnCurve) -> bool:
    """Whether the orbit of half the period lies between two points: beyond it, phases swap.

    The second point may also be such an orbit.
    """
    if not here.halfway.size:
        return False
    return bool(np.max(np.abs(trial.halfway)) < SHORTER or here.halfway @ trial.halfway <= 0.0)


def meets_half(here: OnCurve, trial: OnCurve) -> bool:
    """Whether a curve meets that of the orbits of half the period between two points.

    There the difference of both halves of the orbit shrinks to zero and changes its sign, while
    their mean hardly changes. Otherwise a long step has led to another phase of the orbit.
    """
    if not passes_half(here, trial):
        return False
    moved = np.linalg.norm(trial.place - here.place)
    return bool(moved <= np.linalg.norm(trial.halfway - here.halfway))


def repeats_sooner(section: Floats, scale: Floats) -> bool:
    """Whether an orbit is one of a shorter period.

    ``section``: its section points in successive periods of the excitation, (periods, states);
    ``scale``: scales of the states (states,).
    """
    periods = len(section)
    return any(
        float(np.max(np.abs(section - np.roll(section, shorter, axis=0)) / scale)) < SHORTER
        for shorter in range(1, periods // 2 + 1)
        if periods % shorter == 0
    )


def stalls(points: Sequence[OnCurve], least: tuple[int, float]) -> bool:
    """Whether the last points of a curve lead nowhere.

    ``least``: a number of successive points, and the distance that they cover at least.
    """
    many, distance = least
    if len(points) < many:
        return False
    return bool(np.linalg.norm(points[-1].place - points[-many].place) < distance)


def cubic(one: OnCurve, other: OnCurve, share: Floats) -> Floats:
    """Return the cubic through two points and their tangents at shares of the way, (shares, n)."""
    length = np.linalg.norm(other.place - one.place)
    t = share[:, np.newaxis]
    return np.asarray(
        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * one.place
        + t**2 * (3.0 - 2.0 * t) * other.place
        + length * t * (1.0 - t) * ((1.0 - t) * one.tangent - t * other.tangent)
    )


def _at_share(
    curve: Curve, one: CurvePoint, other: CurvePoint, share: float
) -> Finding[CurvePoint | None]:
    """Return the point of the curve at a share between the shares of two points."""
    part = (share - one.share) / (other.share - one.share)
    guess = one.place + part * (other.place - one.place)
    guess[-1] = share
    return (yield from curve.correcting(guess, along_the_way(guess.size - 1)))


def _located(curve: Curve, inner: CurvePoint, beyond: CurvePoint, width: float) -> Finding[End]:
    """Bisect the stretch of a curve in which it loses stability or turns back."""
    for _ in range(MOST_HALVINGS):
        chord = beyond.place - inner.place
        moduli = abs(abs(beyond.multipliers[0]) - abs(inner.multipliers[0]))
        if np.linalg.norm(chord) <= NEAR_ON_CURVE and moduli <= APART and abs(chord[-1]) <= width:
            break
        guess = (inner.place + beyond.place) / 2.0
        middle = yield from curve.correcting(guess, chord / np.linalg.norm(chord))
        if middle is None:
            break
        if middle.before_its_end:
            inner = middle
        else:
            beyond = middle
    return End(inner, beyond)
