"""The equations of a boundary: an orbit closes, and a test function of it is zero.

Unknown are the state at mesh phase 0 and two parameters.
"""

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, gaps_along, integrate, steps_taken

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.arclength import ROUNDING, is_exact
from gearchaos.dynamics.boundary_passages import (
    PARAMETERS,
    Following,
    Passed,
    Passing,
    passed_of,
)
from gearchaos.dynamics.boundary_tests import CRITICAL, Reference, pairs
from gearchaos.dynamics.gap_extremes import fine_steps, nearest_extremes
from gearchaos.dynamics.orbits import CLOSED
from gearchaos.dynamics.side_by_side import run
from gearchaos.records.branch import GRAZING, NEIMARK_SACKER

ACROSS = 4
"""Factor by which steps are shortened where the nearest of all extremes is searched."""

STEPS, CONTRACTION = 12, 0.1
"""Most Newton steps, and the ratio of two lengths above which derivatives are computed anew."""

STRAIGHT = 1e-5
"""Length of a Newton step after which derivatives have hardly changed."""

SHORT = 1e-10
"""Length of a Newton step below which a point is accepted."""

LAST = 1e-12
"""Predicted length of the next Newton step below which a point is accepted without it."""

NEARLY = 1e-7
"""Length of a Newton step after which a point may be accepted without another orbit."""

BLURRED = 1e-8
"""Length of Newton steps below which errors of a method may keep them from becoming shorter.

Where RK4 begins to see a contact, its map jumps.
"""

NEAR_ENOUGH = 1e-3
"""Distance from a guess up to which its derivatives are used for the tangent."""


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
        (passed,) = yield [Passing(self, place)]
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
        self,
        guess: Floats,
        direction: Floats,
        reference: Reference,
        nearly: float = NEARLY,
        reach: float = 1.0,
    ) -> Following[OnBoundary | None]:
        """Return the search of `corrected`; None also where it leads farther away than a reach.

        ``nearly``: length of a step after which a point may be accepted without another orbit; its
        multipliers are those before the step.
        """
        place, last, where = guess, np.inf, guess
        slopes: Floats | None = None
        # With the parameter of the flow maps fixed, derivatives take no further maps.
        moves = self.fixed < 0 or direction[self.fixed - PARAMETERS] ** 2 != 1.0
        for _ in range(STEPS):
            (passed,) = yield [Passing(self, place, reference, direction, slopes)]
            where = place if slopes is None else where
            slopes, step, defect = passed.slopes, passed.step, passed.defect
            length = float(np.linalg.norm(step))
            closed = max(CLOSED, ROUNDING * float(np.max(np.abs(passed.monodromy))))
            # The length is NaN where the motion diverged, or the equations are singular.
            stalled = not length < 0.9 * last
            # In the second case the next step would be shorter than LAST.
            if (
                (length <= SHORT and float(np.max(np.abs(defect[:-1]))) <= closed)
                or (length <= nearly and length**2 <= LAST * last)
                or (stalled and length <= BLURRED and not is_exact(self.plan))
            ):
                place = place + step
                if np.linalg.norm(place - where) > NEAR_ENOUGH:
                    (there,) = yield [Passing(self, place, reference, direction)]
                    slopes = there.slopes
                return self._point(place, slopes, direction, passed, reference)
            if stalled:
                return None
            near = length < (CONTRACTION * last if moves else STRAIGHT)
            slopes = slopes if near or length < SHORT else None
            place, last = place + step, length
            if np.linalg.norm(place - guess) > reach:
                return None
        return None

    def nearest_flank(self, place: Floats) -> float:
        """Return the least distance of an extreme of a gap from a flank, in half clearances.

        ``place``: shape (states + 2,). Infinite if no gap has an extreme.
        """
        states = self.scale.size
        system = self.system_at(np.clip(place[np.newaxis, states:], 0.0, 1.0))
        # Flow maps take shorter steps at some values of the parameters.
        plan = self.plan._replace(
            history_periods=self.plan.recorded_periods,
            steps_per_period=ACROSS * fine_steps(steps_taken(system, self.plan)),
        )
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

    def _reference(self, passed: Passed, before: Reference | None) -> Reference | None:
        """Return what the test function is continued from beyond an orbit; None if there is none.

        ``before``: the reference of a neighbouring point, None at the beginning of a boundary.
        """
        if self.kind in CRITICAL:
            left, right = passed.left, passed.right
            if before is not None:
                left = left * (np.sign(left @ before.left) or 1.0)
                right = right * (np.sign(right @ before.right) or 1.0)
            return Reference(left, right)
        if self.kind == NEIMARK_SACKER:
            cosine = np.array([np.nan if before is None else before.cosine])
            one, other = pairs(passed.multipliers[np.newaxis], cosine)[0]
            return None if np.isnan(one) else Reference(cosine=float((one + other).real / 2.0))
        return Reference(phase=passed.phase) if np.isfinite(passed.beyond) else None

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
        section = passed.section
        halfway = np.zeros(0)
        if self.periods % 2 == 0:
            halfway = section[self.periods // 2 - 1] / self.scale - place[:states]
        return OnBoundary(
            place,
            tangent,
            passed.multipliers,
            section,
            halfway,
            slopes[:states, states:],
            reference,
        )

    def grazing(self, flank: int, steps: int) -> Self:
        """Return the equations of the grazing of a flank, with the steps that the method takes.

        Within a few long steps, a gap may have several extremes: there are more.
        """
        whole, steps = self.plan.recorded_periods, fine_steps(steps)
        plan = self.plan._replace(history_periods=whole, steps_per_period=steps)
        return self._replace(kind=GRAZING, flank=flank, plan=plan)
