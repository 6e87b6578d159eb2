"""The equations of the boundaries of a map, with the steps and flow maps that suit all of it."""

from functools import cached_property

import numpy as np
from gearchaos_kernels import steps_taken

from gearchaos.arrays import Floats
from gearchaos.dynamics.boundary_equations import Equations
from gearchaos.dynamics.boundary_passages import PARAMETERS
from gearchaos.dynamics.branch_range import only_map_parameter
from gearchaos.engine.map_lines import Ranges
from gearchaos.engine.run_plan import RunPlan
from gearchaos.records.branch import GRAZING


class MapEquations:
    """The equations of boundaries over the ranges of a map.

    ``scale``: scales of the states, (states,), the same for all boundaries.
    """

    def __init__(self, over: Ranges, run: RunPlan, scale: Floats) -> None:
        self.over, self.run, self.scale = over, run, scale

    def of(self, period: int, kind: str, flank: int = -1) -> Equations:
        """Return the equations of a boundary."""
        usual, most = self.steps
        plan = self.run.plan._replace(steps_per_period=usual)
        plan = plan.over(period * self.run.lanes.repeats_after)
        plan = plan._replace(interpolated=self.interpolated)
        equations = Equations(self.over.system_at, plan, period, self.scale, kind, fixed=self.fixed)
        return equations.grazing(flank, most) if kind == GRAZING else equations

    def along(self, number: int) -> Floats:
        """Return the direction in which a parameter alone grows, (states + 2,)."""
        direction = np.zeros(self.scale.size + PARAMETERS)
        direction[self.scale.size + number] = 1.0
        return direction

    @cached_property
    def steps(self) -> tuple[int, int]:
        """The usual number of steps per period that the method takes, and the largest."""
        places = [np.array([[a, b]]) for a in (0.0, 0.3, 0.6, 1.0) for b in (0.0, 1.0)]
        taken = [steps_taken(self.over.system_at(one), self.run.plan) for one in places]
        return sorted(taken)[len(taken) // 2], max(taken)

    @cached_property
    def fixed(self) -> int:
        """The only parameter on which flow maps depend, -1 if they depend on both or on none."""
        depend = self.over.maps_depend(self.run.plan.method)
        return depend.index(True) if sum(depend) == 1 else -1

    @cached_property
    def interpolated(self) -> int:
        """The parameter between whose values flow maps are interpolated; see `Plan`."""
        if self.fixed < 0:
            return -1
        shares = np.full((2, PARAMETERS), 0.5)
        shares[1, self.fixed] = 0.75
        return only_map_parameter(self.over.system_at(shares))
