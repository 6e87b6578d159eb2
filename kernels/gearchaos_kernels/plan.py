"""How a batch is integrated, and what comes of it: the records that go in and out."""

from collections import namedtuple
from enum import IntEnum
from fractions import Fraction
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Plan(NamedTuple):
    """How long and how finely a batch is integrated, and what is recorded of it.

    Attributes
    ----------
    steps_per_period : int
        Steps per mesh period.
    transient_periods, recorded_periods : int
        Mesh periods before the record, and of the record.
    section_points : int
        The section is kept at the end of the last ``section_points`` mesh periods.
    tangent : bool
        Whether a tangent vector is integrated with every lane.
    resolved : bool
        Whether steps that cross a clearance boundary are resolved there; otherwise they are plain
        ones. Flow maps resolve every crossing.
    history_periods : int
        Of the last ``history_periods`` mesh periods every step is kept.
    method : str
        Name of the method: "rk4" or "flow_map".
    first_period : int
        Mesh periods that have passed before tau = 0.
    contact : bool
        Whether the contact of every element is recorded, where crossings are resolved.
    loads : bool
        Whether the forces of the elements and the observed signals are recorded.
    states : tuple of str
        States of which the extremes are recorded.
    orders : tuple of Fraction
        Mesh orders at which amplitudes of these states and of the first observed signal are
        recorded; the record has whole cycles of each.
    map_bytes : int
        Memory in which flow maps are kept, unless those of one group of lanes take more.
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
    map_bytes: int = 2**27

    @property
    def records_steps(self) -> bool:
        """Whether recorders read every step; flow maps then take short ones."""
        return bool(self.loads or self.states or self.orders)


Schedule = namedtuple(
    "Schedule",
    "steps_per_period transient_periods recorded_periods first_period more_rows",
)
"""What the compiled loop over the periods has to know of a plan."""


class Status(IntEnum):
    """Outcome of the integration of one lane; the values are those of the result file."""

    OK = 0
    DIVERGED = 1
    TOO_FAST = 2


STATUS_TEXTS = {
    Status.OK: "integrated to the end",
    Status.DIVERGED: "left the range of numbers (or became not a number) and was stopped",
    Status.TOO_FAST: "moves faster than so few flow maps can follow, and was stopped",
}


class Outcome(NamedTuple):
    """What a batch yields; states are those of the system.

    Attributes
    ----------
    section : array, shape (lanes, section points, states)
        States at the end of the last mesh periods.
    growth : array, shape (lanes, recorded periods) or (lanes, 0)
        Logarithm of the growth of the tangent vector over each recorded period.
    end_state, end_tangent : arrays, shape (lanes, states)
        Last state and tangent vector.
    status : array of `Status`, shape (lanes,)
        How each lane ended.
    diverged_period : array of int, shape (lanes,)
        Number of the period in which a lane diverged, or -1.
    crossings : array of int, shape (lanes,)
        Clearance boundaries crossed in the recorded periods; 0 where steps are plain.
    slowest_crossing : array, shape (lanes,)
        Smallest speed of a gap at one of them per unit of tau, or infinity.
    overflows : array of int, shape (lanes,)
        Steps that crossed more often than they were split, in all periods.
    contact : array, shape (lanes, elements, 6) or (lanes, 0, 6)
        Of each element in the recorded periods: mesh periods on the driving flank and impacts
        there, the same of the back flank, sum and largest of the speeds of approach.
    loads : array, shape (lanes, signals, 4) or (lanes, 0, 4)
        Largest and smallest value, mean and mean square of the forces of all elements and then of
        the observed signals, in the recorded periods.
    extremes : array, shape (lanes, states of the plan, 2)
        Smallest and largest value of each of these states.
    amplitudes : array, shape (lanes, states of the plan + 1, orders)
        Amplitudes of these states and of the first observed signal.
    history : array, shape (lanes, history periods times steps + 1, states) or (lanes, 0, states)
        The state at every step of the last periods.
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
    history: Floats

    def every(self, periods: int) -> Self:
        """Return it with the section once every so many mesh periods, up to the end."""
        return self._replace(section=self.section[:, ::-periods][:, ::-1])
