"""What a sweep yields: name, dimensions, type, unit and wording of every variable, in one place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.gear.tooth_deviations import REALISATION
from gearchaos.records.teeth import CONTACT, CONTACT_STATES, FORCES, LOADS

START = "start"
DIRECTION = "direction"
REPEATS = (REALISATION, START)
"""Axes of drawn gear pairs and of starts of one parameter value."""
UNSWEPT = (*REPEATS, DIRECTION)
"""Axes along which no parameter is swept."""
WAYS = ("upwards", "downwards")
"""Meanings of a direction in which a sweep carries its states."""
SECTION_POINT = "section_point"
STATE = "state"
EXPONENT_NUMBER = "exponent"
ORDER = "order"
HARMONIC = "harmonic"
"""Dimensions: the start of a lane is one of its axes, the others belong to single variables."""

SECTION = "section_"
"""What the names of section variables begin with."""

AMPLITUDE = "amplitude_"
"""What the names of amplitudes begin with."""
EXTREMES = ("smallest", "largest", "peak_to_peak")
"""What the names of those of a state end with."""

LARGEST_EXPONENT = "lyapunov_exponent"
ALL_EXPONENTS = "lyapunov_exponents"
STANDARD_ERROR = "_standard_error"
STEP_ERROR = "exponent_step_error"
RECORD = "record"
LABELS = ("motion", "period")
BANDS = "bands"
CROSSINGS = "crossings_per_period"
STATUS = "status"
DIRECTIONS = ("tangential", "axial")
"""Directions in which teeth have a clearance."""

KEPT_BY = {
    "loads = true": (*LOADS, *FORCES),
    "contact = true": (*CONTACT, "contact_state"),
    "orders = [1, 2]": (AMPLITUDE,),
    "lyapunov = true": (LARGEST_EXPONENT,),
}
"""Keys of [outputs], and how the names begin of what a sweep keeps with them."""

STATE_WORDING: dict[str, tuple[str, str]] = {
    "delta_5": ("relative torsional displacement", r"$\delta_5$"),
    "delta_5_rate": ("relative torsional velocity", r"$\delta_5'$"),
    "delta_1": ("transverse displacement of the driving gear", r"$\delta_1$"),
    "delta_1_rate": ("transverse velocity of the driving gear", r"$\delta_1'$"),
    "delta_2": ("transverse displacement of the driven gear", r"$\delta_2$"),
    "delta_2_rate": ("transverse velocity of the driven gear", r"$\delta_2'$"),
    "delta_3": ("axial displacement of the driving gear", r"$\delta_3$"),
    "delta_3_rate": ("axial velocity of the driving gear", r"$\delta_3'$"),
    "delta_4": ("axial displacement of the driven gear", r"$\delta_4$"),
    "delta_4_rate": ("axial velocity of the driven gear", r"$\delta_4'$"),
}
"""Long name and mathtext symbol of each state (all dimensionless), in the one order of states."""


@dataclass(frozen=True, eq=False)
class Variable:
    """One named array of a result.

    The dimensions of what differs from lane to lane begin with all axes; the type is ``"float64"``,
    ``"int32"`` or ``"uint8"``, the unit ``"1"`` where dimensionless, the symbol
    mathtext. The fill value stands for "none here", None where every value means something; flags
    are the meanings of 0, 1, 2, ... of an enumeration, one word each, errors the variables that
    tell how exact this one is. Values, of the shape of the
    dimensions, are there where they are known before the sweep, as those of coordinates are.
    """

    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str
    long_name: str
    symbol: str = ""
    fill_value: float | int | None = None
    flags: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()
    values: Any = None

    @property
    def attributes(self) -> dict[str, Any]:
        """Everything a file says about the variable beside its values."""
        attributes: dict[str, Any] = {"units": self.units, "long_name": self.long_name}
        if self.symbol:
            attributes["symbol"] = self.symbol
        if self.flags:
            attributes["flag_values"] = np.arange(len(self.flags), dtype=self.dtype)
            attributes["flag_meanings"] = " ".join(self.flags)
        if self.errors:
            attributes["ancillary_variables"] = " ".join(self.errors)
        return attributes


def coordinate(
    name: str,
    units: str,
    long_name: str,
    symbol: str,
    values: NDArray[Any],
    flags: tuple[str, ...] = (),
) -> Variable:
    """Give a variable that is a dimension of its own, such as an axis: its values ascend."""
    dtype = {"i": "int32", "f": "float64"}[values.dtype.kind]
    return Variable(name, (name,), dtype, units, long_name, symbol, flags=flags, values=values)


def axis_name(parameter: str) -> str:
    """Give the name of the axis of a swept parameter, e.g. ``operation_speed_rpm``."""
    return parameter.replace(".", "_")


def start_axis(count: int) -> Variable:
    """Give the axis of several starts of each parameter value."""
    text = "number of the start among those of one parameter value"
    return coordinate(START, "1", text, "", np.arange(count))


def pair_axis(numbers: NDArray[Any]) -> Variable:
    """Give the axis of several drawn gear pairs, of these numbers."""
    return coordinate(REALISATION, "1", "drawn gear pair", "", numbers)


def direction_axis() -> Variable:
    """Give the axis of both directions in which a sweep carries its states."""
    text = "direction in which each value starts from the end state of its neighbour"
    return coordinate(DIRECTION, "1", text, "", np.arange(len(WAYS)), WAYS)


def coordinate_text(axis: str, value: float, digits: int = 12) -> str:
    """Word a coordinate; that of a direction is its name."""
    named = axis == DIRECTION and value in range(len(WAYS))
    return WAYS[int(value)] if named else f"{value:.{digits}g}"


def diagram_axis(axes: Sequence[str]) -> str:
    """Name the axis along which a diagram runs: the first swept parameter, "" without axes."""
    return ([*axes[:1]] + [name for name in axes if name not in UNSWEPT])[-1] if axes else ""


def lane_axes(variables: Sequence[Variable]) -> tuple[str, ...]:
    """Name the axes of a result: the dimensions of ``status``, which every lane has."""
    return next(variable.dims for variable in variables if variable.name == STATUS)


def sweep_variables(
    axes: Sequence[Variable],
    *,
    states: Sequence[str],
    section: Sequence[str],
    section_points: int,
    lyapunov: bool,
    status_meanings: Sequence[str],
    crossings: bool = False,
    contact: Sequence[str] = (),
    loads: Sequence[str] = (),
    chosen: Sequence[str] = (),
    orders: Sequence[Fraction] = (),
    exponents: bool = False,
    check_meanings: Sequence[str] = (),
    motion_meanings: Sequence[str] = (),
    record_meanings: Sequence[str] = (),
    excitation_period: int = 1,
) -> list[Variable]:
    """List the variables of a sweep in the order of the file.

    The axes are second swept parameter, first swept parameter, realisation, start, direction, those
    there are; ``states`` those of the scene in its order, ``section`` those recorded at so many
    section points, ``contact`` and ``loads`` the ways of which they are told, ``chosen`` the
    states of which extremes are told, ``orders`` those of their amplitudes. Meanings are those
    of 0, 1, ...: of ``status``, of ``motion_changed`` where lanes are computed twice to measure
    their error, and of ``motion`` and ``record`` where they are labelled. A motion repeats after
    whole excitation periods, of so many mesh periods each.
    """
    names = tuple(axis.name for axis in axes)
    variables = list(axes)

    def add(dtype: str, name: str, text: str, symbol: str = "", *dims: str, **more: Any) -> None:
        variables.append(Variable(name, (*names, *dims), dtype, "1", text, symbol, **more))

    def real(name: str, text: str, symbol: str = "", *dims: str) -> None:
        add("float64", name, text, symbol, *dims, fill_value=float("nan"))

    def kind(name: str, text: str, meanings: Sequence[str]) -> None:
        add("uint8", name, text, flags=tuple("_".join(meaning.split()) for meaning in meanings))

    if section and section_points > 0:
        text = "number of the section point, one mesh period apart; the last one ends the lane"
        variables.append(coordinate(SECTION_POINT, "1", text, "", np.arange(section_points)))
        for state in section:
            text, symbol = STATE_WORDING[state]
            real(SECTION + state, f"{text} at the stroboscopic section", symbol, SECTION_POINT)
    if lyapunov:
        name, text = LARGEST_EXPONENT, "largest Lyapunov exponent"
        real(name, text, r"$\lambda_1$")
        text = f"standard error of the {text}, 0 where it is that of a periodic orbit"
        real(name + STANDARD_ERROR, text, r"$s_{\lambda_1}$")
    if motion_meanings:
        kind("motion", "kind of motion", motion_meanings)
        of_teeth = f"periods of the excitation, {excitation_period} mesh periods each,"
        text = "mesh periods" if excitation_period == 1 else of_teeth
        text += " after which the motion repeats, 0 where it is not periodic"
        add("int32", "period", text, "$n$")
        text = "smallest distance after which the motion returns, of all states, scaled"
        real("return_distance", text)
        text = "bands a chaotic or quasi-periodic section hops between in turn, 0 for other motions"
        add("int32", BANDS, text)
    if record_meanings:
        text = "whether the record holds one kind of motion, or another one before the labelled one"
        kind(RECORD, text, record_meanings)
    if exponents:
        text = "number of the Lyapunov exponent, the largest first"
        numbers = np.arange(1, len(states) + 1)
        variables.append(coordinate(EXPONENT_NUMBER, "1", text, "$i$", numbers))
        real(ALL_EXPONENTS, "all Lyapunov exponents", r"$\lambda_i$", EXPONENT_NUMBER)
        text = "standard error of each Lyapunov exponent"
        real(ALL_EXPONENTS + STANDARD_ERROR, text, "", EXPONENT_NUMBER)
        text = "sum of all Lyapunov exponents as the damping gives it, exactly"
        real("lyapunov_sum", text, r"$\sum\lambda_i$")
    if crossings:
        text = "clearance boundaries crossed per mesh period, tangential and axial together"
        real(CROSSINGS, text)
        real("slowest_crossing", "smallest speed of a gap at a crossing of its clearance boundary")
        add("int32", "unsplit_steps", "steps with more crossings than they were split at")
    for way in contact:
        for name, text in CONTACT.items():
            real(f"{name}_{way}", f"{text}, {way}")
        kind(f"contact_state_{way}", f"kind of {way} contact", CONTACT_STATES)
    for way in loads:
        for name, text in FORCES.items():
            real(f"{name}_{way}", f"{text}, {way}")
    for name, text in LOADS.items() if loads else ():
        real(name, text)
    for state in chosen:
        for name in EXTREMES:
            real(f"{state}_{name}", f"{name.replace('_', ' ')} {STATE_WORDING[state][0]}")
    if orders:
        numbers = np.array(orders, dtype=np.float64)
        variables.append(coordinate(ORDER, "1", "frequency over mesh frequency", "", numbers))
        for state in (*chosen, "transmission_error"):
            text, symbol = STATE_WORDING.get(state, ("transmission error", ""))
            real(AMPLITUDE + state, f"amplitude of the {text}", symbol, ORDER)
    if check_meanings:
        halved = "when the step is halved"
        real("section_error", f"change of the section of a periodic lane {halved}")
        real(STEP_ERROR, f"change of the largest Lyapunov exponent {halved}")
        kind("motion_changed", f"whether the lane moves in another way {halved}", check_meanings)
    kind(STATUS, "status of the lane", status_meanings)
    text = "mesh period in which the lane diverged, -1 where it did not"
    add("int32", "diverged_period", text, fill_value=-1)
    text = "number of the state variable, which its meaning names"
    variables.append(coordinate(STATE, "1", text, "", np.arange(len(states)), tuple(states)))
    for end in ("start", "end"):
        real(f"{end}_state", f"state at the {end} of the lane", "", STATE)
    errors = {
        LARGEST_EXPONENT: (LARGEST_EXPONENT + STANDARD_ERROR, STEP_ERROR),
        ALL_EXPONENTS: (ALL_EXPONENTS + STANDARD_ERROR,),
        **dict.fromkeys((SECTION + state for state in section), ("section_error",)),
    }
    there = {variable.name for variable in variables}
    told = {name: tuple(one for one in found if one in there) for name, found in errors.items()}
    return [replace(variable, errors=told.get(variable.name, ())) for variable in variables]


def step_choice_variables(
    steps: Sequence[int], measured: Mapping[str, Sequence[float]]
) -> list[Variable]:
    """List what was measured to choose the number of steps, one value per candidate.

    The last candidate was taken; ``measured`` has the keys below.
    """
    name = "candidate_steps"
    wording = {
        "section_error": "error of the section of periodic lanes against four times as many steps",
        "exponent_error": "error of their exponent against four times as many steps",
        "changed_share": "share of lanes that move in another way with four times as many steps",
        "periodic_share": "share of lanes that move periodically: errors are measured on these",
    }
    text = "steps per period that were tried before the sweep; the last number was taken"
    variables = [coordinate(name, "1", text, "$N$", np.asarray(steps, dtype=np.int32))]
    for key, row in measured.items():
        told = f"candidate_{key}", (name,), "float64", "1", wording[key]
        variables.append(Variable(*told, values=np.asarray(row, dtype=np.float64)))
    return variables
