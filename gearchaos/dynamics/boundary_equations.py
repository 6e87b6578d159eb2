"""The equations of a boundary: an orbit closes, and a test function of it is zero.

Unknown are the state at mesh phase 0 and two parameters. Their derivatives are differences between
lanes of one call of the kernel; only the derivative of the map by the state is that of the tangent
flow.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, gaps_along, integrate

from gearchaos.arrays import Complex, Floats, Mask
from gearchaos.dynamics.arclength import ROUNDING
from gearchaos.dynamics.boundary_passages import (
    PARAMETERS,
    Following,
    Passed,
    Passing,
    nearest_extremes,
    passed_of,
)
from gearchaos.dynamics.curve_defects import DIFFERENCE
from gearchaos.dynamics.orbits import CLOSED
from gearchaos.dynamics.side_by_side import run
from gearchaos.records.branch import FOLD, GRAZING, NEIMARK_SACKER, PERIOD_DOUBLING

STATE_DIFFERENCE = 1e-7
"""Difference of a state, in its scale, with which the test function is differentiated."""

STEPS, CONTRACTION = 12, 0.1
"""Most Newton steps, and the ratio of two lengths above which derivatives are computed anew."""

STRAIGHT = 1e-5
"""Length of a Newton step after which derivatives have hardly changed."""

SHORT = 1e-10
"""Length of a Newton step below which a point is accepted."""

NEARLY = 1e-7
"""Length of a Newton step after which a point may be accepted without another orbit."""

NEAR_ENOUGH = 1e-3
"""Distance from a guess up to which its derivatives are used for the tangent."""

NEAR_CIRCLE = 0.5
"""Largest distance of the product of a pair of multipliers from 1."""


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
        return run(self.beginning(place, direction), passed_of)

    def beginning(self, place: Floats, direction: Floats) -> Following[OnBoundary | None]:
        """Return the search of `begun`."""
        passed = yield from self._passing(place[np.newaxis], np.ones(1, dtype=bool))
        if not np.isfinite(passed.monodromy).all():
            return None
        reference = self._reference(passed, None)
        if reference is None:
            return None
        return (yield from self.correcting(place, direction, reference))

    def corrected(
        self, guess: Floats, direction: Floats, reference: Reference
    ) -> OnBoundary | None:
        """Find the point of the boundary next to a guess, in the plane normal to a direction.

        ``guess`` and ``direction``: shape (states + 2,). Newton's method; its derivatives are kept
        while steps shrink fast. None where it does not converge.
        """
        return run(self.correcting(guess, direction, reference), passed_of)

    def correcting(
        self, guess: Floats, direction: Floats, reference: Reference, nearly: float = NEARLY
    ) -> Following[OnBoundary | None]:
        """Return the search of `corrected`.

        ``nearly``: length of a step after which a point may be accepted without another orbit; its
        multipliers are those before the step.
        """
        place, last, where = guess, np.inf, guess
        slopes: Floats | None = None
        # With the parameter of the flow maps fixed, derivatives take no further maps.
        moves = self.fixed < 0 or direction[self.fixed - PARAMETERS] ** 2 != 1.0
        for _ in range(STEPS):
            if slopes is None:
                passed, value, slopes = yield from self._differentiated(place, reference)
                where = place
            else:
                alone = np.ones(1, dtype=bool)
                passed = yield from self._passing(place[np.newaxis], alone, reference.phase)
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
                length <= nearly and length**2 <= SHORT * last
            ):
                place = place + step
                if np.linalg.norm(place - where) > NEAR_ENOUGH:
                    _, _, slopes = yield from self._differentiated(place, reference)
                return self._point(place, slopes, direction, passed, reference)
            if not length < 0.9 * last:
                return None
            near = length < (CONTRACTION * last if moves else STRAIGHT)
            slopes = slopes if near or length < SHORT else None
            place, last = place + step, length
            if np.linalg.norm(place - guess) > 1.0:
                return None
        return None

    def nearest_flank(self, place: Floats) -> float:
        """Return the least distance of an extreme of a gap from a flank, in half clearances.

        ``place``: shape (states + 2,). Infinite if no gap has an extreme.
        """
        states = self.scale.size
        plan = self.plan._replace(history_periods=self.plan.recorded_periods)
        system = self.system_at(np.clip(place[np.newaxis, states:], 0.0, 1.0))
        start = (place[:states] * self.scale)[np.newaxis]
        history = integrate(system, start, plan).history
        halves = gaps_along(system, history, plan.steps_per_period).half_clearance[0]
        found = np.inf
        for flank in range(2 * halves.size):
            at = np.array([flank]), np.full(1, np.nan)
            beyond, _ = nearest_extremes(system, plan, history, *at)
            away = float(np.nan_to_num(np.abs(beyond[0]), nan=np.inf))
            found = min(found, away / (halves[flank // 2] or 1.0))
        return found

    def _passing(self, places: Floats, whole: Mask, phase: float = np.nan) -> Following[Passed]:
        """Search the orbits of places; ``whole`` (places,): whether the monodromy is needed."""
        (passed,) = yield [Passing(self, places, whole, phase)]
        return passed

    def _differentiated(
        self, place: Floats, reference: Reference
    ) -> Following[tuple[Passed, float, Floats]]:
        """Search the orbit of a place, its test function, and all derivatives.

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
        passed = yield from self._passing(places, whole, reference.phase)
        values = self._tests(passed, reference)
        states = self.scale.size
        slopes = np.zeros((states + 1, count))
        slopes[:states, :states] = passed.monodromy[0] - np.eye(states)
        slopes[:states, states:] = (
            (passed.defect[-PARAMETERS:] - passed.defect[0]) / steps[-PARAMETERS:, np.newaxis]
        ).T
        slopes[-1] = (values[1:] - values[0]) / steps
        return passed, float(values[0]), slopes

    def _tests(self, passed: Passed, reference: Reference) -> Floats:
        """Return the test function of each place, (places,)."""
        if self.kind == GRAZING:
            return passed.beyond
        if not np.isfinite(passed.monodromy).all():
            return np.full(len(passed.monodromy), np.nan)
        if self.kind == NEIMARK_SACKER:
            pairs = _pairs(np.linalg.eigvals(passed.monodromy), reference.cosine)
            return np.asarray((pairs[:, 0] * pairs[:, 1]).real - 1.0)
        return self._bordered(passed.monodromy, reference)

    def _bordered(self, monodromy: Floats, reference: Reference) -> Floats:
        """Return the last unknown of the bordered equations of each matrix, (places,)."""
        states = self.scale.size
        border = np.zeros((len(monodromy), states + 1, states + 1))
        border[:, :states, :states] = monodromy - self.multiplier * np.eye(states)
        border[:, :states, -1], border[:, -1, :states] = reference.left, reference.right
        try:
            return np.asarray(np.linalg.solve(border, np.eye(states + 1)[:, -1:])[:, -1, 0])
        except np.linalg.LinAlgError:
            return np.full(len(monodromy), np.nan)

    @property
    def multiplier(self) -> float:
        """The multiplier at a fold or a period doubling."""
        return {FOLD: 1.0, PERIOD_DOUBLING: -1.0}.get(self.kind, np.nan)

    def _reference(self, passed: Passed, before: Reference | None) -> Reference | None:
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
            cosine = None if before is None else before.cosine
            one, other = _pairs(np.linalg.eigvals(monodromy[np.newaxis]), cosine)[0]
            return None if np.isnan(one) else Reference(cosine=float((one + other).real / 2.0))
        there = np.isfinite(passed.beyond[0])
        return Reference(phase=float(passed.phase[0])) if there else None

    def _point(
        self,
        place: Floats,
        slopes: Floats,
        direction: Floats,
        passed: Passed,
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
        section = passed.section[0]
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


def _pairs(multipliers: Any, cosine: float | None) -> Complex:
    """Return the pairs of multipliers, complex or real, with products nearest to 1, (places, 2).

    ``multipliers``: shape (places, states); ``cosine``: their mean at a neighbouring point; None
    for the first point, where the pair is complex. NaN if no pair has a product near 1.
    """
    values = np.asarray(multipliers, dtype=np.complex128)
    values = np.take_along_axis(values, np.argsort(values.imag, axis=1, kind="stable"), axis=1)
    second, first = np.tril_indices(values.shape[1], -1)
    one, other = values[:, second], values[:, first]
    allowed = (one.imag != 0.0) & (np.abs(one - other.conj()) <= 1e-9 * np.abs(one))
    if cosine is not None:
        allowed |= (one.imag == 0.0) & (other.imag == 0.0)
    distance = np.abs((one * other).real - 1.0)
    allowed &= distance <= NEAR_CIRCLE
    if cosine is not None:
        distance = distance + np.abs((one + other).real / 2.0 - cosine)
    distance = np.where(allowed, distance, np.inf)
    rows, best = np.arange(len(values)), np.argmin(distance, axis=1)
    found = np.stack([one[rows, best], other[rows, best]], axis=1)
    found[~allowed.any(axis=1)] = np.nan
    return found
