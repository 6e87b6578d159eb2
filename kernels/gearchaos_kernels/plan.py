"""Input and output of an integration: the plan and the outcome."""

from enum import IntEnum
from fractions import Fraction
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


MAP_BYTES = 2**27
"""Bytes of flow maps that are kept in memory by default."""


class Plan(NamedTuple):
    """How long and how finely lanes are integrated, and what is recorded.

    Attributes
    ----------
    steps_per_period : int
        Steps per mesh period. Flow maps take a multiple of it where one step is too long for them,
        Taylor series where recorders read the ends of steps.
    transient_periods, recorded_periods : int
        Mesh periods of the transient and of the record that follows it.
    section_points : int
        Number of section points: the states at the end of the last mesh periods.
    tangent : bool
        Whether a tangent vector is integrated with every lane.
    resolved : bool
        Whether steps that cross a clearance boundary are resolved there. Flow maps resolve every
        crossing.
    history_periods : int
        Number of mesh periods at the end in which every step is recorded.
    method : str
        Name of the method: "rk4", "flow_map" or "taylor".
    first_period : int
        Number of mesh periods before tau = 0, for an excitation that repeats after several.
    contact : bool
        Whether contact times and impacts of every element are recorded; needs resolved crossings.
    loads : bool
        Whether the forces of the elements and the observed signals are recorded.
    states : tuple of str
        Names of the states whose extremes are recorded.
    orders : tuple of Fraction
        Mesh orders at which amplitudes of these states and of the first observed signal are
        recorded. The record must contain whole cycles of each.
    map_bytes : int
        Bytes of flow maps that are kept in memory. The maps of one lane are always kept.
    frame : bool
        Whether lanes that follow each other, as many as states, have the same motion and carry a
        frame of tangent vectors, which is made orthonormal after every mesh period. At most 32
        states.
    interpolated : int
        Number of the parameter, a column of `LaneSystem.map_parameters`, between whose values flow
        maps are interpolated with the accuracy of rounding; -1 if the maps of every value are
        computed. It saves time if there are more than about 100 values.

    Examples
    --------
    200 steps per mesh period, 300 periods of transient, 100 recorded ones, all in the section:

    >>> plan = Plan(200, 300, 100, 100, tangent=True)
    >>> plan._replace(method="flow_map", steps_per_period=12).resolved
    True
    """

    steps_per_period: int
    transient_periods: int
    recorded_periods: int
    section_points: int
    tangent: bool = False
    resolved: bool = True
    history_periods: int = 0
    method: str = "rk4"
    first_period: int = 0
    contact: bool = False
    loads: bool = False
    states: tuple[str, ...] = ()
    orders: tuple[Fraction, ...] = ()
    map_bytes: int = MAP_BYTES
    frame: bool = False
    interpolated: int = -1

    def over(self, periods: int, transient: int = 0) -> Self:
        """Return a plan with the same method and steps that records every mesh period.

        It has a tangent vector, and crossings are resolved. What is computed around an orbit, such
        as its section, its period map and its derivative, then shares one compiled loop.

        Parameters
        ----------
        periods : int
            Recorded mesh periods, each with a section point.
        transient : int, optional
            Mesh periods before them.

        Returns
        -------
        Plan
            The plan.

        Examples
        --------
        >>> Plan(12, 300, 100, 20, loads=True, method="flow_map").over(3).section_points
        3
        """
        return type(self)(
            self.steps_per_period, transient, periods, periods, tangent=True, method=self.method
        )

    @property
    def records_steps(self) -> bool:
        """Whether recorders read the end of every step; flow maps then take shorter steps."""
        return bool(self.states or self.orders)

    def lanes_together(self, states: int) -> int:
        """Return the number of lanes that are not divided among blocks, a frame or one lane."""
        return states if self.frame else 1

    @property
    def more_rows(self) -> int:
        """Rows of a block beyond those of the scene, for extremes and amplitudes."""
        states = len(self.states)
        return 2 * (states + (states + 1) * len(self.orders))


class Schedule(NamedTuple):
    """The part of a plan that the compiled loop over the periods reads.

    Attributes
    ----------
    steps_per_period, transient_periods, first_period : int
        See `Plan`.
    more_rows : int
        Rows of a block beyond those of the scene, for extremes and amplitudes.
    """

    steps_per_period: int
    transient_periods: int
    first_period: int
    more_rows: int


class Status(IntEnum):
    """How the integration of a lane ended; the values are those of the result file.

    Attributes
    ----------
    OK
        The lane was integrated to the end.
    DIVERGED
        A state left the range of numbers, or became NaN, and the lane was stopped.
    TOO_FAST
        Flow maps do not converge for the lane even with the largest number of steps.
    """

    OK = 0
    DIVERGED = 1
    TOO_FAST = 2


STATUS_TEXTS = {
    Status.OK: "integrated to the end",
    Status.DIVERGED: "left the range of numbers (or became not a number) and was stopped",
    Status.TOO_FAST: "moves faster than so few flow maps can follow, and was stopped",
}
"""Meaning of each status in words."""


class Outcome(NamedTuple):
    """The result of integrating a batch, in the units of the equations.

    Arrays of what the plan does not request have an axis of length 0.

    Attributes
    ----------
    section : array, shape (lanes, section points, states)
        States at the end of the last mesh periods.
    growth : array, shape (lanes, recorded periods) or (lanes, 0)
        Logarithm of the growth of the tangent vector over each recorded period. In a frame, the
        stretch of its direction; NaN from the first direction on that rounding hides.
    end_state, end_tangent : arrays, shape (lanes, states)
        Last state and tangent vector.
    status : array of `Status`, shape (lanes,)
        How each lane ended.
    diverged_period : array of int, shape (lanes,)
        Number of the mesh period in which a lane diverged, or -1.
    crossings : array of int, shape (lanes,)
        Number of clearance boundaries crossed in the recorded periods; 0 without resolution.
    slowest_crossing : array, shape (lanes,)
        Smallest speed of a gap at a crossing per unit of tau, or infinity.
    overflows : array of int, shape (lanes,)
        Number of steps in which not all crossings were resolved, in all periods.
    contact : array, shape (lanes, elements, quantities) or (lanes, 0, quantities)
        For each element in the recorded periods, in the order of `recorders.contact`: mesh periods
        on the driving flank, impacts on it, both for the back flank, impact speeds per unit of tau.
    loads : array, shape (lanes, signals, 4) or (lanes, 0, 4)
        Maximum, minimum, mean and mean square in the recorded periods, of the forces of all
        elements and then of the observed signals.
    extremes : array, shape (lanes, states of the plan, 2)
        Minimum and maximum of each of these states in the recorded periods.
    amplitudes : array, shape (lanes, states of the plan + 1, orders)
        Amplitudes of these states and then of the first observed signal.
    inputs : array, shape (lanes, all periods) or (lanes, 0)
        The input of a controller in every mesh period, transient included.
    history : array, shape (lanes, history periods times steps + 1, states) or (lanes, 0, states)
        The state at every step of the last mesh periods.
    """

    section: Floats
    growth: Floats
    end_state: Floats
    end_tangent: Floats
    status: NDArray[np.uint8]
    diverged_period: NDArray[np.int32]
    crossings: NDArray[np.int64]
    slowest_crossing: Floats
    overflows: NDArray[np.int64]
    contact: Floats
    loads: Floats
    extremes: Floats
    amplitudes: Floats
    inputs: Floats
    history: Floats

    def every(self, periods: int) -> Self:
        """Return the outcome with every n-th section point, counted back from the last one.

        Parameters
        ----------
        periods : int
            Mesh periods between two points that are kept.

        Returns
        -------
        Outcome
            The outcome with fewer section points.

        Examples
        --------
        ::

            once_per_excitation_period = outcome.every(system.repeats_after)
        """
        return self._replace(section=self.section[:, ::-periods][:, ::-1])
