"""What a sweep yields: name, dimensions, type, unit and wording of every variable, in one place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

SECTION_POINT = "section_point"
STATE = "state"
EXPONENT = "exponent"
HARMONIC = "harmonic"

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
"""Long name and mathtext symbol of each state (all dimensionless), in the order of the kernels."""


@dataclass(frozen=True)
class Variable:
    """One named array of a sweep.

    Parameters
    ----------
    name : str
    dims : tuple of str
        Names of the dimensions; the first one of everything that differs from lane to lane is
        the axis of the sweep.
    dtype : str
        ``"float64"``, ``"int32"``, ``"uint8"`` or ``"str"``.
    units, long_name, symbol : str
        Unit (``"1"`` where dimensionless), wording and mathtext symbol for axis labels.
    fill_value : float or int, optional
        The value that stands for "none here"; ``None`` where every value means something.
    flags : tuple of str
        Meanings of the values 0, 1, 2, ... of an enumeration, one word each.
    values : tuple, optional
        The values themselves where they are known before the sweep (``section_point``, ``state``).
    """

    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str
    long_name: str
    symbol: str = ""
    fill_value: float | int | None = None
    flags: tuple[str, ...] = ()
    values: tuple[int, ...] | tuple[float, ...] | tuple[str, ...] | None = None

    @property
    def attributes(self) -> dict[str, Any]:
        """Everything a file says about the variable beside its values."""
        attributes: dict[str, Any] = {"units": self.units, "long_name": self.long_name}
        if self.symbol:
            attributes["symbol"] = self.symbol
        if self.flags:
            attributes["flag_values"] = np.arange(len(self.flags), dtype=self.dtype)
            attributes["flag_meanings"] = " ".join(self.flags)
        return attributes


def axis_name(parameter: str) -> str:
    """Give the name of the dimension of a swept parameter, e.g. ``operation_speed_rpm``."""
    return parameter.replace(".", "_")


def sweep_variables(
    axis: str,
    *,
    units: str,
    long_name: str,
    symbol: str,
    states: Sequence[str],
    section: Sequence[str],
    section_points: int,
    lyapunov: bool,
    several_starts: bool,
    status_meanings: Sequence[str],
    crossings: bool = False,
    spectrum: bool = False,
    check_meanings: Sequence[str] = (),
    motion_meanings: Sequence[str] = (),
) -> list[Variable]:
    """List the variables of a sweep in the order of the file.

    Parameters
    ----------
    axis : str
        The swept parameter, bare or as a dotted path.
    units, long_name, symbol : str
        Of the swept parameter.
    states : sequence of str
        States of the scene, in the order of the kernels.
    section : sequence of str
        States recorded once a mesh period.
    section_points : int
        Mesh periods recorded.
    lyapunov : bool
        Whether the largest Lyapunov exponent is computed.
    crossings : bool
        Whether steps are split at clearance boundaries, and their crossings counted.
    spectrum : bool
        Whether all Lyapunov exponents are computed.
    check_meanings : sequence of str
        Meanings of ``motion_changed`` where lanes are computed twice to measure their error.
    motion_meanings : sequence of str
        Meanings of ``motion`` where lanes are labelled.
    several_starts : bool
        Whether each parameter value has several lanes that differ in their start.
    status_meanings : sequence of str
        Meanings of the lane status 0, 1, ...

    Returns
    -------
    list of Variable
    """
    lane = axis_name(axis)
    nan = float("nan")
    variables = [Variable(lane, (lane,), "float64", units, long_name, symbol)]
    if several_starts:
        start = "number of the start among those of one parameter value"
        variables.append(Variable("start", (lane,), "int32", "1", start))
    if section and section_points > 0:
        points = tuple(range(section_points))
        text = "number of the section point, one mesh period apart; the last one ends the lane"
        dims: tuple[str, ...] = (SECTION_POINT,)
        variables.append(Variable(SECTION_POINT, dims, "int32", "1", text, values=points))
        dims = (lane, SECTION_POINT)
        for state in section:
            text, mark = STATE_WORDING[state]
            text += " at the stroboscopic section"
            variables.append(Variable(f"section_{state}", dims, "float64", "1", text, mark, nan))
    if lyapunov:
        name, text = "lyapunov_exponent", "largest Lyapunov exponent"
        error, error_text = f"{name}_standard_error", f"standard error of the {text}"
        variables += [
            Variable(name, (lane,), "float64", "1", text, r"$\lambda_1$", nan),
            Variable(error, (lane,), "float64", "1", error_text, r"$s_{\lambda_1}$", nan),
        ]
    if motion_meanings:
        text = "smallest distance after which the motion returns, of all states, scaled"
        kind, meanings = "kind of motion", tuple(motion_meanings)
        period = "mesh periods after which the motion repeats, 0 where it is not periodic"
        variables += [
            Variable("motion", (lane,), "uint8", "1", kind, flags=meanings),
            Variable("period", (lane,), "int32", "1", period, "$n$"),
            Variable("return_distance", (lane,), "float64", "1", text, "", nan),
        ]
    if spectrum:
        numbers = tuple(range(1, len(states) + 1))
        text = "number of the Lyapunov exponent, the largest first"
        variables.append(Variable(EXPONENT, (EXPONENT,), "int32", "1", text, "$i$", values=numbers))
        dims, name = (lane, EXPONENT), "lyapunov_spectrum"
        error, error_text = f"{name}_standard_error", "standard error of each Lyapunov exponent"
        total = "sum of all Lyapunov exponents as the damping gives it, exactly"
        variables += [
            Variable(name, dims, "float64", "1", "all Lyapunov exponents", r"$\lambda_i$", nan),
            Variable(error, dims, "float64", "1", error_text, "", nan),
            Variable("lyapunov_sum", (lane,), "float64", "1", total, r"$\sum\lambda_i$", nan),
        ]
    if crossings:
        text = "clearance boundaries crossed per mesh period, tangential and axial together"
        slow = "smallest speed of a gap at a crossing of its clearance boundary"
        unsplit = "steps with more crossings than they were split at"
        variables += [
            Variable("crossings_per_period", (lane,), "float64", "1", text, "", nan),
            Variable("slowest_crossing", (lane,), "float64", "1", slow, "", nan),
            Variable("unsplit_steps", (lane,), "int32", "1", unsplit),
        ]
    if check_meanings:
        text = "change of the section of a periodic lane when the step is halved"
        exponent = "change of the largest Lyapunov exponent when the step is halved"
        motion = "whether the lane moves in another way when the step is halved"
        meanings = tuple(check_meanings)
        variables += [
            Variable("section_error", (lane,), "float64", "1", text, "", nan),
            Variable("exponent_error", (lane,), "float64", "1", exponent, "", nan),
            Variable("motion_changed", (lane,), "uint8", "1", motion, flags=meanings),
        ]
    flags = tuple("_".join(meaning.split()) for meaning in status_meanings)
    diverged = "mesh period in which the lane diverged, -1 where it did not"
    names = tuple(states)
    return [
        *variables,
        Variable("status", (lane,), "uint8", "1", "status of the lane", flags=flags),
        Variable("diverged_period", (lane,), "int32", "1", diverged, fill_value=-1),
        Variable(STATE, (STATE,), "str", "1", "name of the state variable", values=names),
        Variable(
            "end_state", (lane, STATE), "float64", "1", "state at the end of the lane", "", nan
        ),
    ]


def step_choice_variables(
    steps: Sequence[int], measured: Mapping[str, Sequence[float]]
) -> list[Variable]:
    """List what was measured to choose the number of steps, one value per candidate.

    Parameters
    ----------
    steps : sequence of int
        Numbers of steps per period that were tried; the last one was taken.
    measured : mapping of str to sequence of float
        ``section_error``, ``exponent_error``, ``changed_share`` and ``periodic_share`` of each.
    """
    name = "candidate_steps"
    wording = {
        "section_error": "error of the section of periodic lanes against four times as many steps",
        "exponent_error": "error of their exponent against four times as many steps",
        "changed_share": "share of lanes that move in another way with four times as many steps",
        "periodic_share": "share of lanes that move periodically: errors are measured on these",
    }
    text = "steps per period that were tried before the sweep; the last number was taken"
    return [
        Variable(name, (name,), "int32", "1", text, "$N$", values=tuple(steps)),
        *(
            Variable(
                f"candidate_{key}", (name,), "float64", "1", wording[key], values=tuple(values)
            )
            for key, values in measured.items()
        ),
    ]
