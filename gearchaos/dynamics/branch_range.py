"""The range of a parameter over which branches of periodic orbits are followed."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Plan

from gearchaos.arrays import Floats, Integers
from gearchaos.dynamics.arclength import Curve


class BranchRange(NamedTuple):
    """The range of a parameter over which branches are followed.

    Attributes
    ----------
    system_of : callable
        Returns the systems of the lanes at values (lanes,) of the parameter.
    low, high : float
        The range; shares of the way run from the first to the second.
    """

    system_of: Callable[[Floats], LaneSystem]
    low: float
    high: float

    def value(self, share: Floats) -> Floats:
        """Return the values of the parameter at shares of the way."""
        return self.low + share * (self.high - self.low)

    def share(self, value: Floats) -> Floats:
        """Return the shares of the way at values of the parameter."""
        return (value - self.low) / (self.high - self.low)

    def system_at(self, shares: Floats) -> LaneSystem:
        """Return the systems at shares of the way (lanes,)."""
        return self.system_of(self.value(shares))

    def systems_at(self, _numbers: Integers, shares: Floats) -> LaneSystem:
        """Return the systems at shares of the way (lanes,): the same for all curves."""
        return self.system_at(shares)

    def curve(self, plan: Plan, period: int, scale: Floats) -> Curve:
        """Return the curve of orbits of a period, with scales (states,) of the states."""
        whole = period * self.system_at(np.zeros(1)).repeats_after
        steps, method = plan.steps_per_period, plan.method
        plan = Plan(steps, 0, whole, whole, tangent=True, contact=True, method=method)
        return Curve(self.systems_at, 0, plan, period, scale)
