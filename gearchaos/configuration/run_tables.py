"""The tables of a run, for any model: scene, start, control, sweeps, method, outputs."""

# The unit at the end of a key keeps its capital letter.
# ruff: noqa: N815

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Generic, Literal, Self, TypeAlias, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from gearchaos.configuration.keys import AS_LIST, Numbers, Table, key
from gearchaos.configuration.methods import AUTO, DEFAULT, EXACT_TITLES, METHODS, OWN_STEPS

MOST_RUN_LANES = 100_000_000
"""Largest number of lanes of one run, limited by files and memory."""
MOST_STEPS_PER_PERIOD = 1_000_000
DEFAULT_STEPS = 200
"""Smallest number of steps per period that is chosen for a scene."""
_MOST_VALUES = 10_000_000
_MOST_STARTS = 1_000_000

State = TypeVar("State", bound=str, covariant=True)
"""Names of the states of a model, a ``Literal``."""

ONCE = AfterValidator(lambda given: tuple(dict.fromkeys(given)))
"""Repeated names or values are removed without a message."""

Interval: TypeAlias = Annotated[tuple[float, float], AS_LIST]
Order: TypeAlias = Annotated[
    str,
    BeforeValidator(str, json_schema_input_type=int | str),
    Field(pattern="^[1-9][0-9]{0,5}(/[1-9][0-9]{0,5})?$"),
]


class Scene(Table):
    """The included effects; all others are left out."""

    effects: Annotated[tuple[str, ...], AS_LIST] = key("the effects that exist", default=())

    def refuses_maps(self) -> str:
        """Return the effect that a method with maps cannot compute; by default none, empty."""
        return ""


class Start(Table, Generic[State]):
    """The state in which the lanes start."""

    kind: Literal["rest", "contact", "given", "random", "grid"] = key(default="rest")
    """all zero, on the contact flank, as in `state`, at random, or on a grid"""
    state: dict[State, float] = key(example={"delta_5": 1.0}, default={})
    """start values by state for kind = "given", and beside a box; other states are 0"""
    box: dict[State, Interval] = key(
        example={"delta_5": [-2.0, 2.0], "delta_5_rate": [-1.5, 1.5]}, default={}
    )
    """lowest and highest start value by state: range of a grid, both ends included, or of uniform
    random starts; other states are as in `state`"""
    drawn: dict[State, Interval] = key(example={"delta_1": [-0.5, 0.5]}, default={})
    """for kind = "grid": lowest and highest start value of states that are drawn at random"""
    spread: float = key(units="1", default=1.0, gt=0)
    """for kind = "random" without a box: every state is uniform between minus and plus this"""
    seed: int = key("seed of the random numbers", default=0, ge=0, le=2**32 - 1)
    count: int = key(default=1, ge=1, le=_MOST_STARTS)
    """random starts per parameter value, or points of a grid along each state of its box"""
    carry: Literal["none", "upwards", "downwards", "both"] = key(default="none")
    """whether each value of [sweep] starts from the end state of the one before it, and in which
    direction; both are two sweeps side by side, the axis `direction` of one result"""

    @property
    def size(self) -> int:
        """Number of starts per parameter value."""
        starts: int = self.count ** (len(self.box) if self.kind == "grid" else 1)
        return starts


class Control(Table, Generic[State]):
    """A controller that keeps every lane on a periodic orbit by small changes of an input."""

    period: int = key("period of the target orbit in excitation periods", default=1, ge=1, le=64)
    number: int = key(default=0, ge=0)
    """which orbit of this period, in the order of their largest multipliers, the smallest first"""
    found_at: float | None = key(example=12.47, default=None)
    """value of the swept parameter at which the motion is searched for the orbit, by default the
    one in the middle; from there the orbit is followed to all other values"""
    actuator: str | None = key(example="load", default=None)
    """the input that the controller changes: "load" of a gear pair, the name of a force of a linear
    machine, or the shaft or loaded member whose torque it is; by default the only one there is"""
    gain: Literal["lqr", "placement", "delayed"] = key(default="lqr")
    """linear-quadratic gain; placement of the unstable multipliers at 0; or the linear-quadratic
    gain times the difference from the state one orbit earlier"""
    state_weight: float = key(
        "weight of the squared deviation in the cost of a linear-quadratic gain",
        units="1",
        default=1.0,
        ge=0,
    )
    input_weight: float = key("weight of the squared input in the cost", "1", default=10.0, gt=0)
    gain_factor: float = key("factor of the gain", "1", default=1.0)
    limit: float | None = key(
        "largest change of the input, as a share of it",
        units="1",
        example=0.1,
        default=None,
        ge=0,
    )
    limit_Nm: float | None = key(
        "largest change of the torque", "N m", example=5.0, default=None, ge=0
    )
    limit_force: float | None = key(
        "largest change of the force of a linear machine, in the units of its forces",
        default=None,
        ge=0,
    )
    measured: Annotated[tuple[State, ...], AS_LIST, ONCE] = key(
        "states that are measured, the others are estimated; by default all are known",
        example=["delta_5", "delta_5_rate"],
        default=(),
    )
    noise: float = key(
        "standard deviation of the measurement noise, as a share of the largest value of a state",
        units="1",
        default=0.0,
        ge=0,
    )
    seed: int = key("seed of the noise", default=0, ge=0, le=2**32 - 1)
    begins: int = key(default=0, ge=0, le=1_000_000_000)
    """mesh period in which the controller is switched on, the transient included"""


class Sweep(Table):
    """A swept parameter and its values, from/to/count or a list."""

    parameter: str = key(example="pitch_error")
    """a group by its name, or a physical key by its path such as operation.speed_rpm"""
    from_: float | None = key("first value", example=0.0, default=None, alias="from")
    to: float | None = key("last value", example=15.0, default=None)
    count: int | None = key(example=1501, default=None, ge=1, le=_MOST_VALUES)
    """number of values, evenly spaced"""
    values: Annotated[Numbers, ONCE] | None = key(example=[1.0, 2.0], default=None, min_length=1)
    """the values themselves, instead of from, to and count"""

    @model_validator(mode="after")
    def _has_values(self) -> Self:
        """Require either a list of values, or a range of distinct ascending values."""
        first, last, count = self.from_, self.from_ if self.count == 1 else self.to, self.count
        if self.values is not None and (first, self.to, count) == (None, None, None):
            return self
        if self.values is not None or first is None or last is None or count is None:
            raise ValueError("give either `values`, or `from`, `to` and `count`")
        if count > 1 and last <= first:
            rule = f"to = {last} must be greater than from = {first}; exchange the two"
            raise ValueError(f"{rule}; start.carry says in which direction a sweep runs")
        if count > 1 and (last - first) / count < 2 * math.ulp(last):
            rule = f"{count} values between from and to would coincide"
            raise ValueError(f"{rule}; lower the count or widen the sweep")
        return self

    @property
    def size(self) -> int:
        """Number of values."""
        return (self.count or 0) if self.values is None else len(self.values)


if TYPE_CHECKING:
    MethodName: TypeAlias = str
else:
    MethodName = Literal[tuple(METHODS)]


class Integration(Table):
    """The method, on a fixed grid over the mesh period."""

    method: MethodName = key("; ".join(one.words for one in METHODS.values()), default=DEFAULT.name)
    steps_per_period: int | None = key(
        f"steps per mesh period; by default {DEFAULT_STEPS}, doubled until the scene is resolved, "
        f'{OWN_STEPS}; with method = "{AUTO}" a given number is for {DEFAULT.title}',
        example=400,
        default=None,
        ge=1,
        le=MOST_STEPS_PER_PERIOD,
    )
    tolerance: float | None = key(
        "largest error of section and exponent; steps_per_period are doubled until trial lanes of "
        "the sweep reach it, and transient_periods are raised where the section is still settling; "
        f"{EXACT_TITLES} are tried once",
        example=1e-6,
        default=None,
        gt=0,
    )
    error_check: float = key(units="1", default=0.0, ge=0, le=1)
    """share of the lanes that are computed again with half the step, to measure their error"""
    crossings: Literal["resolved", "plain"] = key(
        "whether a step that crosses a clearance boundary is split there, which keeps the order of "
        f"the method, or is a plain step; {EXACT_TITLES} resolve every crossing",
        default="resolved",
    )
    unstable: Literal["refuse", "raise"] = key(
        "whether a number of steps below the stability limit of a lane is refused, or raised to "
        f"it; {EXACT_TITLES} have no such limit",
        default="refuse",
    )
    transient_periods: int = key(default=500, ge=0, le=1_000_000_000)
    """mesh periods discarded before anything is recorded"""
    recorded_periods: int = key(default=500, ge=1, le=1_000_000_000)
    """mesh periods recorded after the transient; both lengths are raised to whole periods of the
    excitation where these are longer than a mesh period"""

    @property
    def fixed_steps(self) -> int | None:
        """Steps per mesh period as given, or those of the method; None if they are chosen."""
        given = self.steps_per_period
        return METHODS[self.method].steps if given is None else given


class Outputs(Table, Generic[State]):
    """The kept outputs of every lane."""

    section: Annotated[tuple[State, ...], AS_LIST, ONCE] = key(
        "states recorded once per mesh period", example=["delta_5"], default=()
    )
    section_points: int = key("last mesh periods of the section that are kept", default=100, ge=1)
    lyapunov: bool = key("whether the largest Lyapunov exponent is computed", default=True)
    motion: bool = key(default=True)
    """whether the motion is labelled: its kind, its period, and the distance of its return"""
    contact: bool = key(default=False)
    """whether the shares of time in contact and the impacts are kept, for each flank"""
    loads: bool = key(default=False)
    """whether mesh forces, load factors and the transmission error are kept"""
    states: Annotated[tuple[State, ...], AS_LIST, ONCE] = key(example=["delta_5"], default=())
    """states whose extremes, and amplitudes at the orders, are kept"""
    orders: Annotated[tuple[Order, ...], Field(strict=False, max_length=1000)] = key(
        "multiples of the mesh frequency, whole or fractions of two whole numbers, at which "
        "amplitudes of the transmission error are kept; the record has whole cycles of them",
        example=["1/3", "1/2", 1, 2],
        default=(),
    )
    exponents: bool = key(default=False)
    """whether all Lyapunov exponents are computed, at about ten times the cost"""
    allowed_diverged_share: float = key(units="1", default=0.0, ge=0, le=1)
    """share of diverged lanes above which the command reports failure"""

    @property
    def mesh_orders(self) -> tuple[Fraction, ...]:
        """The orders, ascending, each once."""
        return tuple(sorted({Fraction(order) for order in self.orders}))
