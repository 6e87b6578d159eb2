"""What a response yields beside the variables of a sweep: the motion at every step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearchaos.results.variables import STATE_WORDING, Variable, axis_name

TIME = "time"
MESH_PERIOD = "mesh_period"
NO_CONTACT_STATE = 255
"""Contact state of a lane that diverged."""


def response_variables(
    axis: str,
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
    axis : str
        The swept parameter, bare or as a dotted path.
    states : sequence of str
        States of the scene, in the order of the kernels.
    periods, steps_per_period : int
        Mesh periods of the record, and steps of each.
    axial : bool
        Whether the scene has axial motion, and so an axial mesh force.
    contacts : sequence of str
        Meanings of the contact states 0, 1, ...
    """
    lane = axis_name(axis)
    dims, nan = (lane, TIME), float("nan")
    instants = np.arange(periods * steps_per_period + 1) / steps_per_period
    text = "time in mesh periods"
    period = "mesh period in units of dimensionless time"
    symbol = r"$\Omega\tau/2\pi$"
    values = tuple(instants.tolist())
    variables = [
        Variable(TIME, (TIME,), "float64", "1", text, symbol, values=values),
        Variable(MESH_PERIOD, (lane,), "float64", "1", period, r"$2\pi/\Omega$"),
    ]
    for state in states:
        variables.append(Variable(state, dims, "float64", "1", *STATE_WORDING[state], nan))
        if state.endswith("_rate"):
            text, symbol = STATE_WORDING[state]
            text, symbol = text.replace("velocity", "acceleration"), symbol.replace("'", "''")
            name = acceleration_of(state.removesuffix("_rate"))
            variables.append(Variable(name, dims, "float64", "1", text, symbol, nan))
    for direction, symbol in (("tangential", "$N_y$"), ("axial", "$N_z$"))[: 2 if axial else 1]:
        text, contact = f"{direction} mesh force", f"contact in the {direction} direction"
        variables += [
            Variable(f"mesh_force_{direction}", dims, "float64", "1", text, symbol, nan),
            Variable(
                f"contact_{direction}",
                dims,
                "uint8",
                "1",
                contact,
                fill_value=NO_CONTACT_STATE,
                flags=tuple(contacts),
            ),
        ]
    return variables


def acceleration_of(coordinate: str) -> str:
    """Return the name of the acceleration of a coordinate such as ``delta_5``."""
    return f"{coordinate}_acceleration"
