"""The equations of a boundary: an orbit closes, and a test function of it is zero.

Unknown are the state at mesh phase 0 and two parameters. Their derivatives are differences between
lanes of one call of the kernel; only the derivative of the map by the state is that of the tangent
flow.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from gearchaos_kernels import (
    LaneSystem,
    Outcome,
    Plan,
    gap_polynomials,
    gaps_along,
    integrate,
)

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.arclength import DIFFERENCE, ROUNDING
from gearchaos.dynamics.orbits import CLOSED
from gearchaos.records.branch import FOLD, GRAZING, NEIMARK_SACKER, PERIOD_DOUBLING

STATE_DIFFERENCE = 1e-7
"""Difference of a state, in its scale, with which the test function is differentiated."""

STEPS, CONTRACTION = 12, 0.1
"""Most Newton steps, and the ratio of two lengths above which derivatives are computed anew."""

SHORT = 1e-10
"""Length of a Newton step below which a point is accepted."""

NEARLY = 1e-7
"""Length of a Newton step after which a point may be accepted without another orbit."""

NEAR_ENOUGH = 1e-3
"""Distance from a guess up to which its derivatives are used for the tangent."""

NEAR_CIRCLE = 0.5
"""Largest distance of the product of a pair of multipliers from 1."""

PARAMETERS = 2


class Reference(NamedTuple):
    """Values at a neighbouring point, from which a test function is continued.

    Attributes
    ----------
    left, right : array, shape (states,)
        Null vectors of the monodromy matrix less the multiplier 1 (fold) or -1 (period doubling).
    cosine : float
        Mean of the pair of multipliers on the unit circle (Neimark-Sacker).
    phase : float
        Where the gap has its extreme, in steps since mesh phase 0 (grazing).
    """

    left: Floats = np.zeros(0)
    right: Floats = np.zeros(0)
    cosine: float = 0.0
    phase: float = 0.0


class OnBoundary(NamedTuple):
    """A point of a boundary.

    Attributes
    ----------
    place : array, shape (states + 2,)
        The state in its scales, then the shares of both ranges.
    tangent : array, shape (states + 2,)
        Unit vector in the direction in which the boundary is followed.
    multipliers : array of complex, shape (states,)
        Floquet multipliers, largest modulus first.
    section : array, shape (periods, states)
        States at the ends of the excitation periods, dimensionless.
    halfway : array, shape (states,) or (0,)
        State after half the period minus the state, in the scales; empty for an odd period.
    slopes : array, shape (states, 2)
        Derivatives of the map by both shares.
    reference : Reference
        What the test function is continued from.
    """

    place: Floats
    tangent: Floats
    multipliers: Complex
    section: Floats
    halfway: Floats
    slopes: Floats
    reference: Reference

    @property
    def shares(self) -> Floats:
        """Shares of both ranges, (2,)."""
        return self.place[-PARAMETERS:]


class _Passed(NamedTuple):
    """Orbits from some places: defects (places, states), monodromies, motions and systems."""

    defect: Floats
    monodromy: Floats
    outcome: Outcome
    system: LaneSystem


class Equations(NamedTuple):
    """The equations of a boundary.

    Attributes
    ----------
    system_at : callable
        Returns the system of the lanes at shares of both ranges, (lanes, 2).
    plan : Plan
        Records the period of the orbit with a tangent, for a grazing also every step.
    periods : int
        Period in excitation periods.
    scale : array, shape (states,)
        Scales of the states.
    kind : str
        One of `BOUNDARY_KINDS`.
    flank : int
        For a grazing, number of the flank as in `CurvePoint.impacts`; otherwise -1.
    fixed : int
        Number of the parameter on which flow maps depend, -1 if they depend on both or on none.
    """

    system_at: Callable[[Floats], LaneSystem]
    plan: Plan
    periods: int
    scale: Floats
    kind: str
    flank: int = -1
    fixed: int = -1

    def begun(self, place: Floats, direction: Floats) -> OnBoundary | None:
        """Find the point of the boundary next to a special point of a branch.

        ``place`` and ``direction``: shape (states + 2,).
        """
        passed = self._passed(place[np.newaxis], np.ones(1, dtype=bool))
        if not np.isfinite(passed.monodromy).all():
            return None
        reference = self._reference(passed, None)
        return None if reference is None else self.corrected(place, direction, reference)

    def corrected(
        self, guess: Floats, direction: Floats, reference: Reference
    ) -> OnBoundary | None:
        """Find the point of the boundary next to a guess, in the plane normal to a direction.

        ``guess`` and ``direction``: shape (states + 2,). Newton's method; its derivatives are kept
        while steps shrink fast. None where it does not converge.
        """
        place, last, slopes, where = guess, np.inf, None, guess
        for _ in range(STEPS):
            if slopes is None:
                passed, value, slopes = self._differentiated(place, reference)
                where = place
            else:
                passed = self._passed(place[np.newaxis], np.ones(1, dtype=bool))
                value = float(self._tests(passed, reference)[0])
            defect = np.append(passed.defect[0], value)
            if not (np.isfinite(defect).all() and np.isfinite(slopes).all()):
                return None
            try:
                step = -np.linalg.solve(np.vstack([slopes, direction]), np.append(defect, 0.0))
            except np.linalg.LinAlgError:
                return None
            length = float(np.linalg.norm(step))
            closed = max(CLOSED, ROUNDING * float(np.max(np.abs(passed.monodromy[0]))))
            # In the second case the next step would be shorter than SHORT.
            if (length <= SHORT and float(np.max(np.abs(defect[:-1]))) <= closed) or (
                length <= NEARLY and length**2 <= SHORT * last
            ):
                place = place + step
                if np.linalg.norm(place - where) > NEAR_ENOUGH:
                    slopes = self._differentiated(place, reference)[2]
                return self._point(place, slopes, direction, passed, reference)
            if not length < 0.9 * last:
                return None
            slopes = slopes if length < CONTRACTION * last or length < SHORT else None
            place, last = place + step, length
            if np.linalg.norm(place - guess) > 1.0:
                return None
        return None

    def nearest_flank(self, place: Floats) -> float:
        """Return the least distance of an extreme of a gap from a flank, in half clearances.

        ``place``: shape (states + 2,). Infinite if no gap has an extreme.
        """
        plan = self.plan._replace(history_periods=self.plan.recorded_periods)
        passed = self._replace(plan=plan)._passed(place[np.newaxis], np.zeros(1, dtype=bool))
        gaps = gaps_along(passed.system, passed.outcome.history, plan.steps_per_period)
        found = np.inf
        for element, half in enumerate(gaps.half_clearance[0]):
            for flank in (2 * element, 2 * element + 1):
                equations = self._replace(kind=GRAZING, flank=flank, plan=plan)
                beyond, _ = _nearest_extreme(equations, passed, None)
                away = float(np.nan_to_num(np.abs(beyond[0]), nan=np.inf))
                found = min(found, away / (half or 1.0))
        return found

    def _differentiated(self, place: Floats, reference: Reference) -> tuple[_Passed, float, Floats]:
        """Return the orbit of a place, its test function, and all derivatives.

        The derivatives have the shape (states + 1, states + 2).
        """
        count = place.size
        steps = np.full(count, STATE_DIFFERENCE)
        shares = np.clip(place[-PARAMETERS:], 0.0, 1.0)
        steps[-PARAMETERS:] = np.where(shares < 0.5, DIFFERENCE, -DIFFERENCE)
        places = np.vstack([place, place + np.diag(steps)])
        places[1:, -PARAMETERS:] = shares + np.diag(steps)[:, -PARAMETERS:]
        # A grazing is differentiated without the tangent flow of the displaced orbits.
        whole = np.full(count + 1, self.kind != GRAZING)
        whole[0] = True
        passed = self._passed(places, whole)
        values = self._tests(passed, reference)
        states = self.scale.size
        slopes = np.zeros((states + 1, count))
        slopes[:states, :states] = passed.monodromy[0] - np.eye(states)
        slopes[:states, states:] = (
            (passed.defect[-PARAMETERS:] - passed.defect[0]) / steps[-PARAMETERS:, np.newaxis]
        ).T
        slopes[-1] = (values[1:] - values[0]) / steps
        return passed, float(values[0]), slopes

    def _passed(self, places: Floats, whole: Any) -> _Passed:
        """Integrate the orbits of places; ``whole`` (places,): whether the monodromy is needed."""
        states = self.scale.size
        counts = np.where(whole, states, 1)
        first = np.cumsum(counts) - counts
        shares = np.clip(places[:, -PARAMETERS:], 0.0, 1.0)
        lanes = np.repeat(np.arange(len(places)), counts)
        tangents = np.eye(states)[np.arange(lanes.size) - first[lanes]]
        of_places = self.system_at(shares)
        system = of_places.of(lanes)
        start = places[lanes, :states] * self.scale
        outcome = integrate(system, start, self.plan, tangent_start=tangents)
        outcome = outcome.every(system.repeats_after)
        ends = outcome.section[first, -1] / self.scale
        columns = outcome.end_tangent * np.exp(np.sum(outcome.growth, axis=1))[:, np.newaxis]
        monodromy = np.full((len(places), states, states), np.nan)
        for number in np.flatnonzero(whole):
            of = columns[first[number] : first[number] + states]
            monodromy[number] = of.T * self.scale / self.scale[:, np.newaxis]
        some = outcome._replace(section=outcome.section[first], history=outcome.history[first])
        return _Passed(ends - places[:, :states], monodromy, some, of_places)

    def _tests(self, passed: _Passed, reference: Reference) -> Floats:
        """Return the test function of each place, (places,)."""
        if self.kind == GRAZING:
            return _nearest_extreme(self, passed, reference.phase)[0]
        if self.kind == NEIMARK_SACKER:
            pairs = [_pair(np.linalg.eigvals(one), reference.cosine) for one in passed.monodromy]
            return np.array([(one * other).real - 1.0 for one, other in pairs])
        return np.array([self._bordered(one, reference)[-1] for one in passed.monodromy])

    def _bordered(
        self, monodromy: Floats, reference: Reference, transposed: bool = False
    ) -> Floats:
        """Return the solution of the bordered equations: a null vector and the test function."""
        states = self.scale.size
        border = np.zeros((states + 1, states + 1))
        border[:states, :states] = monodromy - self.multiplier * np.eye(states)
        border[:states, -1], border[-1, :states] = reference.left, reference.right
        try:
            return np.linalg.solve(border.T if transposed else border, np.eye(states + 1)[-1])
        except np.linalg.LinAlgError:
            return np.full(states + 1, np.nan)

    @property
    def multiplier(self) -> float:
        """The multiplier at a fold or a period doubling."""
        return {FOLD: 1.0, PERIOD_DOUBLING: -1.0}.get(self.kind, np.nan)

    def _reference(self, passed: _Passed, before: Reference | None) -> Reference | None:
        """Return what the test function is continued from beyond an orbit; None if there is none.

        ``before``: the reference of a neighbouring point, None at the beginning of a boundary.
        """
        monodromy = passed.monodromy[0]
        if self.kind in (FOLD, PERIOD_DOUBLING):
            left, _, right = np.linalg.svd(monodromy - self.multiplier * np.eye(self.scale.size))
            vectors = [left[:, -1], right[-1]]
            if before is not None:
                vectors = [
                    one * (np.sign(one @ other) or 1.0)
                    for one, other in zip(vectors, before[:2], strict=True)
                ]
            return Reference(*vectors)
        if self.kind == NEIMARK_SACKER:
            one, other = _pair(
                np.linalg.eigvals(monodromy), None if before is None else before.cosine
            )
            return None if np.isnan(one) else Reference(cosine=float((one + other).real / 2.0))
        phase = None if before is None else before.phase
        values, phases = _nearest_extreme(self, passed, phase)
        return Reference(phase=float(phases[0])) if np.isfinite(values[0]) else None

    def _point(
        self,
        place: Floats,
        slopes: Floats,
        direction: Floats,
        passed: _Passed,
        before: Reference,
    ) -> OnBoundary | None:
        """Return the point at a place where all equations hold."""
        states = self.scale.size
        tangent = np.linalg.svd(slopes)[2][-1]
        tangent = tangent * (np.sign(tangent @ direction) or 1.0)
        reference = self._reference(passed, before)
        if reference is None:
            return None
        multipliers = np.linalg.eigvals(passed.monodromy[0]).astype(np.complex128)
        multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
        section = passed.outcome.section[0]
        halfway = np.zeros(0)
        if self.periods % 2 == 0:
            halfway = section[self.periods // 2 - 1] / self.scale - place[:states]
        return OnBoundary(
            place, tangent, multipliers, section, halfway, slopes[:states, states:], reference
        )

    def grazing(self, flank: int, steps: int) -> Self:
        """Return the equations of the grazing of a flank, with the steps that the method takes."""
        whole = self.plan.recorded_periods
        plan = self.plan._replace(history_periods=whole, steps_per_period=steps)
        return self._replace(kind=GRAZING, flank=flank, plan=plan)


def _pair(multipliers: Any, cosine: float | None) -> tuple[complex, complex]:
    """Return the pair of multipliers, complex or real, whose product is nearest to 1.

    ``cosine``: their mean at a neighbouring point; None for the first point, where the pair is
    complex. NaN if no pair has a product near 1.
    """
    values = sorted(np.asarray(multipliers, dtype=np.complex128), key=lambda one: one.imag)
    best, found = np.inf, (complex(np.nan), complex(np.nan))
    for number, one in enumerate(values):
        for other in values[:number]:
            conjugate = one.imag != 0.0 and abs(one - other.conjugate()) <= 1e-9 * abs(one)
            real = one.imag == 0.0 and other.imag == 0.0 and cosine is not None
            away = abs((one * other).real - 1.0)
            if not (conjugate or real) or away > NEAR_CIRCLE:
                continue
            distance = away + (0.0 if cosine is None else abs((one + other).real / 2.0 - cosine))
            if distance < best:
                best, found = distance, (one, other)
    return found


def _nearest_extreme(
    equations: Equations, passed: _Passed, phase: float | None
) -> tuple[Floats, Floats]:
    """Return how far the extreme of a gap lies beyond a flank, and its phase, (lanes,) each.

    Of several extremes that is the one nearest to a phase in steps; without a phase, the one
    nearest to the flank. NaN where the gap has no extreme.
    """
    plan, system, history = equations.plan, passed.system, passed.outcome.history
    gaps = gaps_along(system, history, plan.steps_per_period)
    element, back = divmod(equations.flank, 2)
    flank = (-1.0 if back else 1.0) * gaps.half_clearance[:, element]
    rate, value = gaps.rate[:, :, element], gaps.value[:, :, element]
    turns = rate[:, :-1] * rate[:, 1:] <= 0.0
    numbers = np.arange(turns.shape[1])
    if phase is None:
        away = np.abs(value[:, :-1] - flank[:, np.newaxis])
    else:
        away = np.abs(numbers + 0.5 - phase)[np.newaxis]
        away = np.broadcast_to(np.minimum(away, turns.shape[1] - away), turns.shape)
    samples = np.argmin(np.where(turns, away, np.inf), axis=1)
    terms = gap_polynomials(system, plan, history, gaps, (samples, element))
    slopes = terms[:, 1:] * np.arange(1, terms.shape[1])
    bends = slopes[:, 1:] * np.arange(1, slopes.shape[1])
    begin, end = (rate[np.arange(samples.size), samples + n] for n in (0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.clip(np.nan_to_num(-(end + begin) / (end - begin)), -1.0, 1.0)
        for _ in range(6):
            bend = np.polynomial.polynomial.polyval(at, bends.T, tensor=False)
            slope = np.polynomial.polynomial.polyval(at, slopes.T, tensor=False)
            at = np.clip(at - np.nan_to_num(slope / bend), -1.5, 1.5)
    beyond = np.polynomial.polynomial.polyval(at, terms.T, tensor=False) - flank
    there = turns.any(axis=1)
    return np.where(there, beyond, np.nan), samples + 0.5 * (at + 1.0)
