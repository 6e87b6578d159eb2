"""What a response yields beside the variables of a sweep: the motion at every step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearchaos.results.variables import STATE_WORDING, Axis, Variable

TIME = "time"
MESH_PERIOD = "mesh_period"
NO_CONTACT_STATE = 255
"""Contact state of a lane that diverged."""


def response_variables(
    axes: Sequence[Axis],
    *,
    states: Sequence[str],
    periods: int,
    steps_per_period: int,
    axial: bool,
    contacts: Sequence[str],
) -> list[Variable]:
    """List the variables that a response adds to those of a sweep, in the order of the file.

    Parameters
    ----------
    axes : sequence of Axis
        As for `sweep_variables`.
    states : sequence of str
        In the order of the scene's states.
    periods, steps_per_period : int
        Mesh periods of the record, and steps of each.
    axial : bool
        Whether the scene has axial motion, and so an axial mesh force.
    contacts : sequence of str
        Meanings of the contact states 0, 1, ...
    """
    lane = tuple(axis.name for axis in axes)
    instants = np.arange(periods * steps_per_period + 1) / steps_per_period

    def motion(name: str, long_name: str, symbol: str) -> Variable:
        return Variable(name, (*lane, TIME), "float64", "1", long_name, symbol, float("nan"))

    text, symbol = "time in mesh periods", r"$\Omega\tau/2\pi$"
    period = "mesh period in units of dimensionless time"
    variables = [
        Variable(TIME, (TIME,), "float64", "1", text, symbol, values=instants),
        Variable(MESH_PERIOD, lane, "float64", "1", period, r"$2\pi/\Omega$"),
    ]
    for state in states:
        text, symbol = STATE_WORDING[state]
        variables.append(motion(state, text, symbol))
        if state.endswith("_rate"):
            text, symbol = text.replace("velocity", "acceleration"), symbol.replace("'", "''")
            variables.append(motion(acceleration_of(state.removesuffix("_rate")), text, symbol))
    for direction, symbol in (("tangential", "$N_y$"), ("axial", "$N_z$"))[: 2 if axial else 1]:
        name, text = f"contact_{direction}", f"contact in the {direction} direction"
        dims, flags = (*lane, TIME), tuple(contacts)
        variables += [
            motion(f"mesh_force_{direction}", f"{direction} mesh force", symbol),
            Variable(name, dims, "uint8", "1", text, "", NO_CONTACT_STATE, flags),
        ]
    return variables


def acceleration_of(coordinate: str) -> str:
    """Return the name of the acceleration of a coordinate such as ``delta_5``."""
    return f"{coordinate}_acceleration"
