"""Where orbits of a curve come near to grazing a flank without a change of their impacts.

Two grazings of one flank between the same two points leave the number of impacts unchanged. The
extreme of the gap that comes near to the flank is a test function with an amount.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate, steps_taken

from gearchaos.arrays import Floats
from gearchaos.dynamics.arclength import Curve, CurvePoint
from gearchaos.dynamics.gap_extremes import nearest_extremes
from gearchaos.dynamics.pairs_parting import nearly_zero

TestFunction: TypeAlias = Callable[[Sequence[CurvePoint]], Floats]
"""Returns values at some points of a curve, (points,), that are zero at special points."""

MOST_NUMBERS = 4_000_000
"""Largest number of values in the histories of some orbits."""


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
        plan = curve.plan._replace(
            history_periods=curve.plan.recorded_periods,
            steps_per_period=steps_taken(system, curve.plan),
        )
        start = np.array([one.place[:-1] for one in points]) * curve.scale
        return cls(system, plan, integrate(system, start, plan).history)

    def extremes(self, lanes: slice, flank: int, phases: Floats) -> tuple[Floats, Floats]:
        """Return how far extremes lie beyond a flank, and their phases, as `nearest_extremes`."""
        numbers = np.arange(len(self.history))[lanes]
        flanks = np.full(numbers.size, flank)
        return nearest_extremes(
            self.system.of(numbers), self.plan, self.history[lanes], flanks, phases
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
        return orbits.extremes(slice(None), self.flank, phases)[0]


def near_grazings(curve: Curve, points: Sequence[CurvePoint]) -> Iterator[tuple[int, TestFunction]]:
    """Yield the points near which orbits may graze twice, and the test function of each.

    ``points``: those of a curve, in order.
    """
    if not points[0].impacts:
        return
    samples = curve.plan.recorded_periods * curve.plan.steps_per_period
    many = max(MOST_NUMBERS // (samples * curve.scale.size), 8)
    for first in range(0, len(points) - 2, many):
        # Two more points: each is compared with both of its neighbours.
        for at, test in _near_grazings(curve, points[first : first + many + 2]):
            yield first + at, test


def _near_grazings(
    curve: Curve, points: Sequence[CurvePoint]
) -> Iterator[tuple[int, TestFunction]]:
    """Yield some of the points of `near_grazings`."""
    orbits = _Orbits.of(curve, points)
    samples = orbits.history.shape[1] - 1
    inner = slice(1, -1)
    for flank in range(len(points[0].impacts)):
        here, phases = orbits.extremes(inner, flank, np.full(len(points) - 2, np.nan))
        before, _ = orbits.extremes(slice(None, -2), flank, phases)
        after, _ = orbits.extremes(slice(2, None), flank, phases)
        for at, values in enumerate(np.column_stack([before, here, after])):
            if nearly_zero(points[at : at + 3], values):
                yield at + 1, _Extreme(curve, flank, float(phases[at]) / samples).beyond
