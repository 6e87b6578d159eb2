"""Maps over the periods of orbits, and their Jacobians, of lanes with different periods at once."""

from typing import NamedTuple, Self

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan, integrate

from gearchaos.arrays import Counts, Floats, Integers


class Passage(NamedTuple):
    """Lanes after their periods.

    Attributes
    ----------
    section : array, shape (lanes, points, states)
        States at the end of every excitation period; the points before the first are NaN.
    jacobian : array, shape (lanes, states, states)
        Derivative of the last state by the first; NaN in lanes that diverged.
    aside : array, shape (other starts, points, states)
        Sections from other starts.
    """

    section: Floats
    jacobian: Floats
    aside: Floats


class PeriodMaps(NamedTuple):
    """The maps of lanes over their periods.

    Attributes
    ----------
    system : LaneSystem
        The system of the lanes.
    period : array of int, shape (lanes,)
        Period of each lane in excitation periods.
    plan : Plan
        Records the longest period with a tangent.
    """

    system: LaneSystem
    period: Counts
    plan: Plan

    @classmethod
    def with_method(cls, system: LaneSystem, period: Counts, plan: Plan) -> Self:
        """Return the maps with method and steps of a plan; crossings are always resolved.

        Controllers act from the beginning, without noise.
        """
        system = system.controlled(system.control and system.control.settled())
        # One compiled loop for maps and Jacobians: they agree bit for bit.
        return cls(system, period, plan.over(int(period.max()) * system.repeats_after))

    def of(self, lanes: Integers) -> Self:
        """Return the maps of some lanes."""
        return self._replace(system=self.system.of(lanes), period=self.period[lanes])

    def passed(
        self, points: Floats, aside: Floats | None = None, lanes: Integers | None = None
    ) -> Passage:
        """Map the points of all lanes (lanes, states), with Jacobian, in one integration.

        ``aside`` (starts, states) of ``lanes`` (starts,) are mapped as well, without Jacobian.
        """
        count, states = points.shape
        copies = np.repeat(np.arange(count), states)
        tangents = np.tile(np.eye(states), (count, 1))
        start = points[copies]
        if aside is not None and lanes is not None:
            copies, start = np.concatenate([copies, lanes]), np.concatenate([start, aside])
            tangents = np.concatenate([tangents, np.broadcast_to(np.eye(1, states), aside.shape)])
        outcome = self._integrated(copies, start, tangents)
        framed = outcome.end_tangent[: count * states].reshape(count, states, states)
        lengths = self._growth(outcome, copies)[: count * states].reshape(count, 1, states)
        section = outcome.section
        return Passage(
            section[: count * states : states],
            framed.transpose(0, 2, 1) * np.exp(lengths),
            section[count * states :],
        )

    def _integrated(self, lanes: Integers, start: Floats, tangents: Floats) -> Outcome:
        """Integrate starts of lanes with tangent vectors, (starts, states), over their periods."""
        repeats = self.system.repeats_after
        outcome = integrate(
            self.system.of(lanes),
            start,
            self.plan,
            tangent_start=tangents,
            periods=self.period[lanes] * repeats,
        )
        return outcome.every(repeats)

    def _growth(self, outcome: Outcome, lanes: Integers) -> Floats:
        """Return the logarithm of the growth of every tangent vector, (starts,)."""
        whole = self.period[lanes] * self.system.repeats_after
        growth = np.zeros(lanes.size)
        for n in np.unique(whole).tolist():
            # Without the zeros that follow: the order of a sum depends on its number of terms.
            growth[whole == n] = np.sum(outcome.growth[whole == n, :n], axis=1)
        return growth
