"""The curve of a periodic orbit over a parameter, followed past the point where it turns back.

Pseudo-arclength continuation (Keller 1977): state and parameter are unknown together, and a step
goes along the tangent of the curve. At a fold the curve turns back, but has no singular point, so
that the multiplier is seen on both sides of +1 however fast it moves with the parameter.
"""

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.exponents import period_jacobian
from gearchaos.dynamics.orbits import CLOSED, NEWTON_STEPS
from gearchaos.records.period import TOLERANCE, coordinate_scale

FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 1e-3, 0.05, 1e-10
"""Steps along a curve, whose coordinates are measured by their scale, the parameter by the way."""

STRAIGHT = 0.9  # Least cosine between the tangents of successive points: else another branch.

MOST_STEPS = 200

MOST_HALVINGS = 48

APART = 1e-6  # Largest moduli of the multipliers on both sides of a located end differ by no more.

NEAR = 1e-4  # Both sides of a located end are this close along the curve.

DIFFERENCE = 1e-6  # Share of the way over which the map is differenced for its parameter.


HALF_RETURN = 1e-2
"""Return distance after half the period below which a curve ends in an orbit of half the period.

There a multiplier nears +1 with the square of this distance: closer, the error of steps hides it.
"""


class CurvePoint(NamedTuple):
    """A point of a curve.

    ``place`` (states + 1,): the state in its scales, then the share of the way; ``tangent``
    (states + 1,): unit vector in the direction in which the curve is followed; ``multipliers``
    (states,), largest modulus first; ``residual``: return distance, in the scales;
    ``half_return``: that after half the period, infinite for an odd one.
    """

    place: Floats
    tangent: Floats
    multipliers: Complex
    residual: float
    half_return: float

    @property
    def share(self) -> float:
        """The share of the way at which the orbit lies."""
        return float(self.place[-1])

    @property
    def onward(self) -> bool:
        """Whether the curve leads on along the way, and has not turned back."""
        return bool(self.tangent[-1] > 0.0)

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)

    @property
    def before_its_end(self) -> bool:
        """Whether the point lies on the stable part of the curve, before that ends.

        Beyond the place where it was born in an orbit of half the period the curve turns back, or
        a step leads to the curve of that orbit.
        """
        return self.stable and self.onward and self.half_return > TOLERANCE

    @property
    def halved(self) -> bool:
        """Whether the orbit is all but that of half the period in which it was born."""
        return self.half_return <= HALF_RETURN


class End(NamedTuple):
    """How far a curve was followed.

    ``inner``: the last stable point, None where the orbit at the beginning is not found again;
    ``beyond``: the point behind the end of the stable part, None where no end was located.
    """

    inner: CurvePoint | None
    beyond: CurvePoint | None


class Curve(NamedTuple):
    """The orbits of one period over a parameter.

    ``system_at`` gives the systems at shares of the way, (lanes,); ``plan`` records ``periods``
    excitation periods with a tangent; ``scale`` (states,) measures the coordinates.
    """

    system_at: Callable[[Floats], LaneSystem]
    plan: Plan
    periods: int
    scale: Floats

    @classmethod
    def through(
        cls,
        system_at: Callable[[Floats], LaneSystem],
        plan: Plan,
        periods: int,
        point: Floats,
        share: float,
    ) -> Self:
        """Return the curve through an orbit at a share of the way, with the scales of the orbit."""
        system = system_at(np.array([share]))
        whole = periods * system.repeats_after
        plan = Plan(plan.steps_per_period, 0, whole, whole, tangent=True, method=plan.method)
        section = integrate(system, point[np.newaxis], plan).every(system.repeats_after).section
        return cls(system_at, plan, periods, coordinate_scale(section)[0])

    def corrected(self, guess: Floats, direction: Floats) -> CurvePoint | None:
        """Find the point of the curve next to a guess, in the plane normal to a direction.

        Newton's method; None where it does not converge.
        """
        place, last = guess, np.inf
        for _ in range(NEWTON_STEPS):
            defect, slopes, half_return = self._defect(place)
            size = float(np.max(np.abs(defect)))
            if size <= CLOSED:
                if not np.isfinite(slopes).all():
                    break
                return self._point(place, slopes, direction, (size, half_return))
            # Not a number, too, where the motion diverged.
            if not size < 0.5 * last:
                break
            try:
                bordered = np.vstack([slopes, direction])
                place = place - np.linalg.solve(bordered, np.append(defect, 0.0))
            except np.linalg.LinAlgError:
                break
            last = size
        return None

    def _defect(self, place: Floats) -> tuple[Floats, Floats, float]:
        """Return P(x) - x in the scales, its derivatives by place, and the half return distance."""
        point = place[:-1] * self.scale
        # Beyond the way a parameter may have values that no system has.
        shares = np.clip(place[-1] + DIFFERENCE * np.array([0.0, -1.0, 1.0]), 0.0, 1.0)
        system = self.system_at(shares)
        start = np.repeat(point[np.newaxis], 3, axis=0)
        section = integrate(system, start, self.plan).every(system.repeats_after).section
        ends = section[:, -1] / self.scale
        jacobian = period_jacobian(system.of([0]), point[np.newaxis], self.plan)[0]
        by_state = jacobian * self.scale / self.scale[:, np.newaxis] - np.eye(self.scale.size)
        with np.errstate(invalid="ignore", divide="ignore"):
            by_share = (ends[2] - ends[1]) / (shares[2] - shares[1])
        half_return = np.inf
        if self.periods % 2 == 0:
            halfway = section[0, self.periods // 2 - 1] / self.scale
            half_return = float(np.max(np.abs(halfway - place[:-1])))
        return ends[0] - place[:-1], np.column_stack([by_state, by_share]), half_return

    def _point(
        self, place: Floats, slopes: Floats, direction: Floats, distances: tuple[float, float]
    ) -> CurvePoint:
        """Return the point of the curve at a place where the orbit is closed."""
        tangent = np.linalg.svd(slopes)[2][-1]
        tangent = tangent * np.sign(tangent @ direction)
        multipliers = np.linalg.eigvals(slopes[:, :-1] + np.eye(self.scale.size))
        order = np.argsort(-np.abs(multipliers), kind="stable")
        return CurvePoint(place, tangent, multipliers[order].astype(np.complex128), *distances)


def end_of_curve(curve: Curve, point: Floats, share: float, limit: float, width: float) -> End:
    """Follow a curve from a stable orbit onwards to where it loses stability or turns back.

    ``point`` (states,), ``share``: the orbit; ``limit``: the share to which the curve is followed
    at most, and where the inner point lies if it is stable up to there; ``width``: both sides of
    the end differ by no more in their shares.
    """
    here = curve.corrected(np.append(point / curve.scale, share), _along_the_way(point.size))
    step = FIRST_STEP
    for _ in range(MOST_STEPS if here is not None else 0):
        assert here is not None
        trial = curve.corrected(here.place + step * here.tangent, here.tangent)
        bends = trial is None or trial.tangent @ here.tangent < STRAIGHT
        if trial is None or bends:
            step /= 2.0
            if step < SHORTEST_STEP:
                break
            continue
        end = End(trial, None)
        if not trial.before_its_end:
            end = _located(curve, here, trial, width)
        assert end.inner is not None
        if end.inner.share >= limit:
            return End(_at_share(curve, here, end.inner, limit), None)
        if end.beyond is not None:
            return end
        here, step = end.inner, min(2.0 * step, LONGEST_STEP)
    return End(here, None)


def _along_the_way(states: int) -> Floats:
    """Return the direction in which the parameter alone changes."""
    return np.append(np.zeros(states), 1.0)


def _at_share(curve: Curve, one: CurvePoint, other: CurvePoint, share: float) -> CurvePoint | None:
    """Return the point of the curve at a share between those of two points."""
    part = (share - one.share) / (other.share - one.share)
    guess = one.place + part * (other.place - one.place)
    guess[-1] = share
    return curve.corrected(guess, _along_the_way(guess.size - 1))


def _located(curve: Curve, inner: CurvePoint, beyond: CurvePoint, width: float) -> End:
    """Halve the stretch of a curve in which it loses stability or turns back."""
    for _ in range(MOST_HALVINGS):
        chord = beyond.place - inner.place
        moduli = abs(abs(beyond.multipliers[0]) - abs(inner.multipliers[0]))
        if np.linalg.norm(chord) <= NEAR and moduli <= APART and abs(chord[-1]) <= width:
            break
        middle = curve.corrected((inner.place + beyond.place) / 2.0, chord / np.linalg.norm(chord))
        if middle is None:
            break
        if middle.before_its_end:
            inner = middle
        else:
            beyond = middle
    return End(inner, beyond)
