"""What is integrated, how long, and what comes of it: the records that go in and out."""

import math
from collections import namedtuple
from enum import IntEnum
from fractions import Fraction
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STATES = tuple(f"delta_{n}{kind}" for n in (5, 1, 2, 3, 4) for kind in ("", "_rate"))
"""The states of eq. 13 of Pan 2021 in their one order; a scene has those of its effects."""


class Effects(NamedTuple):
    """Which effects act; what is off is absent from the compiled loop."""

    pitch_error: bool = True
    stiffness_variation: bool = True
    backlash: bool = True
    transverse: bool = True
    axial: bool = True

    @property
    def states(self) -> tuple[str, ...]:
        """The states that there are, in the order of `STATES`."""
        present = np.repeat([True, self.transverse, self.axial], [2, 4, 4])
        return tuple(name for name, there in zip(STATES, present, strict=True) if there)


class Groups(NamedTuple):
    """Dimensionless groups of eqs 8-13, each an array of shape (lanes,).

    Angles are in radians. Groups of an effect that is off are ignored; 1 is a safe filling for the
    mass ratios and 0 for everything else.
    """

    mesh_frequency: Floats
    load: Floats
    damping_ratio: Floats
    base_helix_angle: Floats
    half_backlash: Floats
    error_mean: Floats
    error_amplitude: Floats
    error_phase: Floats
    stiffness_variation_scale: Floats
    mass_ratio_p: Floats
    mass_ratio_g: Floats
    transverse_stiffness_p: Floats
    transverse_damping_p: Floats
    transverse_stiffness_g: Floats
    transverse_damping_g: Floats
    axial_stiffness_p: Floats
    axial_damping_p: Floats
    axial_stiffness_g: Floats
    axial_damping_g: Floats


SPLINE_DEGREE = 5
"""Of the splines between the shares: e'' then has the derivatives that order 4 asks for."""


class Teeth(NamedTuple):
    """Pitch errors tooth by tooth, in place of the sine of eq. 14; see `teeth`.

    ``driving`` (profiles, teeth of the driving gear), ``driven`` (profiles, teeth of the driven
    one): the errors in the order in which teeth come into mesh, positive where the flank lies
    ahead in the direction of rotation, in units of `Groups.error_amplitude`; ``profile`` (lanes,):
    which of these a lane has. ``share`` (cells,): mean share of one tooth pair in the mesh force
    over each cell, of which a mesh period has ``cells_per_period``, from its coming into mesh on:
    pair j, of the teeth j of both gears, comes into mesh at mesh phase j + ``entry``, in periods.
    """

    driving: Floats
    driven: Floats
    profile: NDArray[np.intp]
    share: Floats
    cells_per_period: int
    entry: float

    @property
    def begins(self) -> float:
        """Mesh phase, in periods, at which pair 0 begins to take load.

        The spline of a cell is centred on it and reaches beyond, so that this may lie before 0.
        """
        return self.entry - SPLINE_DEGREE / (2.0 * self.cells_per_period)

    @property
    def ahead(self) -> int:
        """How many pairs beyond the one of its number begin to take load in a mesh period."""
        return -math.floor(self.begins)

    @property
    def most_at_once(self) -> int:
        """Most tooth pairs that share the load at the same time."""
        return math.ceil(self._reach)

    @property
    def _reach(self) -> float:
        """Mesh periods in which a pair has a share."""
        return (self.share.size + SPLINE_DEGREE) / self.cells_per_period

    @property
    def pairs_in_mesh(self) -> int:
        """Most tooth pairs that have a share in the same mesh period."""
        return math.ceil(self._reach + self.begins + self.ahead)


class System(NamedTuple):
    """Everything that defines the right-hand side of eq. 13 for a batch of lanes.

    ``stiffness_cosine`` and ``stiffness_sine``, shape (harmonics,), are the Fourier coefficients of
    the mesh stiffness relative to its mean (eq. 19); ``physical`` says whether delta_5 + e enters
    the gaps, as eq. 1 gives, instead of delta_5 as eqs 6 and 7 are printed. With ``teeth`` the
    pitch error is not that of eq. 14.
    """

    effects: Effects
    groups: Groups
    stiffness_cosine: Floats
    stiffness_sine: Floats
    physical: bool = True
    teeth: Teeth | None = None

    @property
    def states(self) -> tuple[str, ...]:
        """The states that there are, in the order of `STATES`."""
        return self.effects.states

    @property
    def lanes(self) -> int:
        """Number of lanes."""
        return int(self.groups.mesh_frequency.size)

    @property
    def mesh_period(self) -> Floats:
        """Duration of a mesh period in units of tau, shape (lanes,)."""
        return 2.0 * np.pi / self.groups.mesh_frequency

    @property
    def repeats_after(self) -> int:
        """Mesh periods after which the excitation repeats: 1, or until the same teeth meet."""
        if self.teeth is None or not self.effects.pitch_error:
            return 1
        return math.lcm(self.teeth.driving.shape[1], self.teeth.driven.shape[1])

    @property
    def excitation_period(self) -> Floats:
        """Duration of `repeats_after` mesh periods in units of tau, shape (lanes,)."""
        return self.repeats_after * self.mesh_period

    def of(self, lanes: slice | NDArray[np.intp] | list[int]) -> Self:
        """Return the system of some lanes, in the order given."""
        teeth = self.teeth and self.teeth._replace(profile=self.teeth.profile[lanes])
        groups = Groups(*(group[lanes] for group in self.groups))
        return self._replace(groups=groups, teeth=teeth)

    def repeated(self, times: int) -> Self:
        """Return the system with every lane so many times in a row."""
        return self.of(np.repeat(np.arange(self.lanes), times))


class Plan(NamedTuple):
    """How long and how finely a batch is integrated, and what is kept of it.

    The section is kept at the end of the last ``section_points`` mesh periods. ``resolved`` splits
    the steps that cross a clearance boundary; without it they are plain steps. Of the last
    ``history_periods`` every step is kept. ``method``: "rk4" or "flow_map", which resolves every
    crossing and whose steps are exact. ``first_period``: mesh periods that the teeth have turned
    before tau = 0. ``contact``: whether crossings are told by flank, where they are resolved.
    ``loads``: whether mesh forces and transmission error are told; and so are the
    extremes of these ``states``, and at these mesh ``orders``, of which the record has whole
    cycles, amplitudes of them and of the transmission error. ``map_bytes``: memory in which flow
    maps are kept, unless those of one group of lanes take more.
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
    def told_by_steps(self) -> bool:
        """Whether something is told to which every step adds; flow maps then take short ones."""
        return bool(self.loads or self.states or self.orders)


Schedule = namedtuple(
    "Schedule",
    "steps_per_period transient_periods recorded_periods section_points history_periods "
    "first_period",
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
    """What a batch yields; lanes first, states those of the system.

    ``section`` (lanes, section points, states); ``growth`` (lanes, recorded periods): the
    logarithm of the tangent vector's growth over each recorded period, or (lanes, 0);
    ``end_state``, ``end_tangent`` (lanes, states); ``status`` (lanes,) of `Status`;
    ``diverged_period`` (lanes,): number of the period in which a lane diverged, or -1;
    ``crossings`` (lanes,): clearance boundaries crossed in the recorded periods;
    ``slowest_crossing`` (lanes,): smallest speed of y_1 or y_2 at one of them, or infinity;
    ``overflows`` (lanes,): steps that crossed more often than they were split, in all periods;
    these three stay as they began in scenes without backlash and with plain steps; ``contact``
    (lanes, 12), or (lanes, 0) where the plan does not ask for it: tangential and then axial, mesh
    periods on and impacts on the driving flank and on the back flank, sum and largest of the speeds
    of approach, in the recorded periods; ``loads`` (lanes, 3, 4), or (lanes, 0, 4): largest and
    smallest value, mean and mean square of N_y, N_z and delta_5 + e there; ``extremes`` (lanes,
    states of the plan, 2): smallest and largest value, ``amplitudes`` (lanes, states + 1, orders);
    ``history`` (lanes, history periods times steps + 1, states): the state at every step, if kept.
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


class MeshMotion(NamedTuple):
    """Forces, contact and accelerations along a motion.

    ``force_tangential``, ``force_axial`` (lanes, samples): N_y and N_z of eq. 13;
    ``contact_tangential``, ``contact_axial`` (lanes, samples): 0 apart, 1 on the driving flank, 2
    on the back flank; ``accelerations`` (lanes, samples, coordinates): delta_5'' and, where the
    system has them, delta_1'' to delta_4''; ``pitch_error`` (lanes, samples): e. Without an axial
    pair its force and contact are 0.
    """

    force_tangential: Floats
    force_axial: Floats
    contact_tangential: NDArray[np.uint8]
    contact_axial: NDArray[np.uint8]
    accelerations: Floats
    pitch_error: Floats
