"""Where orbits of a curve come near to grazing a flank without a change of their impacts.

Two grazings of one flank between the same two points may leave the number of impacts unchanged. The
extreme of the gap that comes near to the flank is a test function with an amount. Where two
extremes cross the flank, the values of both show how far apart they do so.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, gaps_along, integrate, steps_taken

from gearchaos.arrays import Floats, Integers
from gearchaos.dynamics.arclength import Curve, CurvePoint
from gearchaos.dynamics.gap_extremes import (
    FINE,
    MOST_NUMBERS,
    about_extremes,
    fine_steps,
    nearest_extremes,
)
from gearchaos.dynamics.pairs_parting import nearly_zero

TestFunction: TypeAlias = Callable[[Sequence[CurvePoint]], Floats]
"""Returns values at some points of a curve, (points,), that are zero at special points."""


class _Orbits(NamedTuple):
    """The orbits of some points: their systems, their plan, and their states at every step."""

    system: LaneSystem
    plan: Plan
    history: Floats

    @classmethod
    def of(cls, curve: Curve, points: Sequence[CurvePoint]) -> "_Orbits":
        """Integrate the orbits of some points of a curve."""
        # Points may lie beyond the ends of the way, where the parameter may be invalid.
        shares = np.clip([one.share for one in points], 0.0, 1.0)
        system = curve.systems_at(np.full(len(points), curve.number), shares)
        steps = steps_taken(system, curve.plan)
        if not curve.own_maps:
            # Between a few long steps, several extremes may lie.
            steps = fine_steps(steps)
        plan = curve.plan._replace(
            history_periods=curve.plan.recorded_periods, steps_per_period=steps
        )
        start = np.array([one.place[:-1] for one in points]) * curve.scale
        return cls(system, plan, integrate(system, start, plan).history)

    def extremes(self, lanes: Integers, flank: int, phases: Floats) -> tuple[Floats, Floats]:
        """Return how far extremes lie beyond a flank, and their phases, as `nearest_extremes`."""
        flanks = np.full(lanes.size, flank)
        return nearest_extremes(
            self.system.of(lanes), self.plan, self.history[lanes], flanks, phases
        )


class _Extreme(NamedTuple):
    """The extreme of a gap at about a phase, and the flank that it comes near to.

    The phase is a share of the period of the orbit.
    """

    curve: Curve
    flank: int
    phase: float

    def beyond(self, points: Sequence[CurvePoint]) -> Floats:
        """Return how far it lies beyond the flank at some points of the curve, (points,)."""
        orbits = _Orbits.of(self.curve, points)
        phases = np.full(len(points), self.phase * (orbits.history.shape[1] - 1))
        return orbits.extremes(np.arange(len(points)), self.flank, phases)[0]


class NearGrazings(NamedTuple):
    """Where orbits of a curve may graze twice between the same two points.

    Attributes
    ----------
    tests : list of (int, TestFunction)
        Points near which one extreme of a gap comes near to a flank, and its test function.
    between : list of (int, float)
        Points after which two extremes cross a flank before the next point, and the share of the
        way at which one of them has crossed it.
    """

    tests: list[tuple[int, TestFunction]]
    between: list[tuple[int, float]]


def near_grazings(curve: Curve, points: Sequence[CurvePoint]) -> NearGrazings:
    """Return where orbits may graze twice; ``points``: those of a curve, in order."""
    found = NearGrazings([], [])
    if not points[0].impacts:
        return found
    samples = curve.plan.recorded_periods * max(curve.plan.steps_per_period, FINE)
    many = max(MOST_NUMBERS // (samples * curve.scale.size), 8)
    for first in range(0, max(len(points) - 2, 1), many):
        # Two more points: each is compared with both of its neighbours.
        some = points[first : first + many + 2]
        orbits = _Orbits.of(curve, some)
        gaps = gaps_along(orbits.system, orbits.history, orbits.plan.steps_per_period)
        for flank in range(len(points[0].impacts)):
            gap = _Gap(curve, orbits, flank, about_extremes(gaps, np.full(len(some), flank)))
            found.tests.extend((first + at, test) for at, test in gap.near(some))
            found.between.extend((first + at, share) for at, share in gap.crossing())
    return found


class _Gap(NamedTuple):
    """A gap along the orbits of some points, beside one of its flanks.

    ``estimates``: how far its extremes lie beyond the flank, (points, samples - 1), as
    `about_extremes`.
    """

    curve: Curve
    orbits: _Orbits
    flank: int
    estimates: Floats

    def near(self, points: Sequence[CurvePoint]) -> Iterator[tuple[int, TestFunction]]:
        """Yield the points near which an extreme comes near to the flank, and its test function."""
        size = np.min(
            np.abs(self.estimates), axis=1, initial=np.inf, where=np.isfinite(self.estimates)
        )
        least = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
        # Estimates may have their least value one point aside.
        beside = least.copy()
        beside[1:] |= least[:-1]
        beside[:-1] |= least[1:]
        chosen = np.flatnonzero(beside) + 1
        if not chosen.size:
            return
        here, phases = self.orbits.extremes(chosen, self.flank, np.full(chosen.size, np.nan))
        before, _ = self.orbits.extremes(chosen - 1, self.flank, phases)
        after, _ = self.orbits.extremes(chosen + 1, self.flank, phases)
        samples = self.orbits.history.shape[1] - 1
        rows = zip(chosen.tolist(), np.column_stack([before, here, after]), phases, strict=True)
        for at, values, phase in rows:
            if nearly_zero(points[at - 1 : at + 2], values):
                yield at, _Extreme(self.curve, self.flank, float(phase) / samples).beyond

    def crossing(self) -> Iterator[tuple[int, float]]:
        """Yield the points after which several extremes cross the flank, and shares of the way.

        At each share, some of them have crossed it.
        """
        of_points = [one[np.isfinite(one)] for one in self.estimates]
        for at, (one, other) in enumerate(pairwise(of_points)):
            # The extremes of neighbouring orbits follow each other in the same order.
            if one.size != other.size:
                continue
            (crossing,) = np.nonzero(one * other < 0.0)
            shares = np.sort(one[crossing] / (one[crossing] - other[crossing]))
            for share in (shares[1:] + shares[:-1]) / 2.0:
                yield at, float(share)
