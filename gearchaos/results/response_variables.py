"""What a response yields beside the variables of a sweep: the motion at every step."""

from collections.abc import Sequence

import numpy as np

from gearchaos.results.variables import DIRECTIONS, STATE_WORDING, Variable, coordinate

TIME = "time"
MESH_PERIOD = "mesh_period"
MESH_ERROR = "mesh_error"
MESH_FORCE = "mesh_force_"  # What the names of mesh forces begin with.
DEFAULT_PERIODS = 32  # Mesh periods of a response where their number is not given.
CONTACTS = ("apart", "driving_flank", "back_flank")  # Meanings of the contact states 0, 1 and 2.
NO_CONTACT_STATE = 255  # Contact state of a lane that diverged.


def response_variables(
    axes: Sequence[Variable], *, states: Sequence[str], periods: int, steps_per_period: int
) -> list[Variable]:
    """List the variables that a response adds to those of a sweep, in the order of the file.

    Axes and states are those of the sweep.
    """
    lane = tuple(axis.name for axis in axes)
    instants = np.arange(periods * steps_per_period + 1) / steps_per_period

    def motion(name: str, long_name: str, symbol: str) -> Variable:
        return Variable(name, (*lane, TIME), "float64", "1", long_name, symbol, float("nan"))

    text, symbol = "time in mesh periods", r"$\Omega\tau/2\pi$"
    period = "mesh period in units of dimensionless time"
    variables = [
        coordinate(TIME, "1", text, symbol, instants),
        Variable(MESH_PERIOD, lane, "float64", "1", period, r"$2\pi/\Omega$"),
    ]
    for state in states:
        text, symbol = STATE_WORDING[state]
        variables.append(motion(state, text, symbol))
        if state.endswith("_rate"):
            text, symbol = text.replace("velocity", "acceleration"), symbol.replace("'", "''")
            variables.append(motion(acceleration_of(state.removesuffix("_rate")), text, symbol))
    variables.append(motion(MESH_ERROR, "pitch error of the mesh", "$e$"))
    acting = DIRECTIONS if "delta_3" in states else DIRECTIONS[:1]
    for direction, symbol in zip(acting, ("$N_y$", "$N_z$"), strict=False):
        name, text = f"contact_{direction}", f"contact in the {direction} direction"
        dims = (*lane, TIME)
        variables += [
            motion(f"{MESH_FORCE}{direction}", f"{direction} mesh force", symbol),
            Variable(name, dims, "uint8", "1", text, "", NO_CONTACT_STATE, CONTACTS),
        ]
    return variables


def acceleration_of(coordinate: str) -> str:
    """Return the name of the acceleration of a coordinate such as ``delta_5``."""
    return f"{coordinate}_acceleration"
