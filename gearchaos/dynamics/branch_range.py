"""The range of a parameter over which branches of periodic orbits are followed."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem, Plan, steps_taken

from gearchaos.arrays import Floats, Integers
from gearchaos.dynamics.arclength import Curve
from gearchaos.dynamics.curve_defects import DIFFERENCE
from gearchaos.records.branch import LONGEST_GRAZING

LANES_AHEAD, MOST_AHEAD = 64, 4
"""About how many lanes may search the points ahead of one, and the largest number of points."""

WITH_OWN_MAPS = 2
"""Number of points ahead where each has flow maps of its own, which cost more than their lanes."""

LEAST_DIFFERENCE, DIGITS = 1e-10, 1e-12
"""Least share of the way by which values differ, and their least relative difference."""

PLACES = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
"""Shares of the way at which the method is looked at."""


def only_map_parameter(system: LaneSystem) -> int:
    """Return the only parameter of flow maps in which lanes differ, -1 if there are others.

    See `Plan.interpolated`.
    """
    (differ,) = np.nonzero(np.ptp(system.map_parameters(), axis=0))
    return int(differ[0]) if differ.size == 1 else -1


class BranchRange(NamedTuple):
    """The range of a parameter over which branches are followed.

    Attributes
    ----------
    system_of : callable
        Returns the systems of the lanes at values (lanes,) of the parameter.
    low, high : float
        The range; shares of the way run from the first to the second.
    number : int
        Number of the range among others over which branches are followed side by side.
    shared : callable or None
        Returns the systems of lanes from the numbers of their ranges and the shares of the way,
        both (lanes,); None if there is no other range.
    """

    system_of: Callable[[Floats], LaneSystem]
    low: float
    high: float
    number: int = 0
    shared: Callable[[Integers, Floats], LaneSystem] | None = None

    def value(self, share: Floats) -> Floats:
        """Return the values of the parameter at shares of the way."""
        return self.low + share * (self.high - self.low)

    def share(self, value: Floats) -> Floats:
        """Return the shares of the way at values of the parameter."""
        return (value - self.low) / (self.high - self.low)

    def system_at(self, shares: Floats) -> LaneSystem:
        """Return the systems at shares of the way (lanes,)."""
        return self.system_of(self.value(shares))

    def systems_at(self, numbers: Integers, shares: Floats) -> LaneSystem:
        """Return the systems at shares of the way, in the ranges with some numbers, (lanes,)."""
        return self.system_at(shares) if self.shared is None else self.shared(numbers, shares)

    def own_maps(self, method: str) -> bool:
        """Return whether every share of the way has flow maps of its own."""
        return bool(np.ptp(METHODS[method].sharing(self.system_at(PLACES))))

    def steps_of_maps(self, plan: Plan) -> int:
        """Return the steps per period that series of flow maps usually need, at least the plan's.

        With these steps maps are made once; with fewer they are made anew with twice as many.
        """
        if not self.own_maps(plan.method):
            return plan.steps_per_period
        taken = [steps_taken(self.system_at(share), plan) for share in PLACES[:, np.newaxis]]
        return sorted(taken)[len(taken) // 2]

    def curve(self, plan: Plan, period: int, scale: Floats) -> Curve:
        """Return the curve of orbits of a period, with scales (states,) of the states."""
        own_maps, steps = self.own_maps(plan.method), self.steps_of_maps(plan)
        ahead = WITH_OWN_MAPS if own_maps else LANES_AHEAD // (scale.size + 1)
        whole = period * self.system_at(np.zeros(1)).repeats_after
        along = only_map_parameter(self.system_at(PLACES)) if own_maps else -1
        plan = plan._replace(steps_per_period=steps).over(whole)
        plan = plan._replace(contact=whole <= LONGEST_GRAZING, interpolated=along)
        ahead = min(max(ahead, 1), MOST_AHEAD)
        beside = self._difference()
        return Curve(self.systems_at, self.number, plan, period, scale, ahead, own_maps, beside)

    def _difference(self) -> float:
        """Return the share of the way for difference quotients by the parameter.

        Next to grazings, second derivatives are large, the more so where the range is wide. Where
        it is narrow, values have few digits left in which they differ.
        """
        size = max(abs(self.low), abs(self.high)) / abs(self.high - self.low)
        return float(np.clip(DIGITS * size, LEAST_DIFFERENCE, DIFFERENCE))
