"""What a response yields beside the variables of a sweep: the motion at every step."""

from collections.abc import Sequence

import numpy as np

from gearchaos.results.variables import DIRECTIONS, Variable, listed

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
    kinds = ("", "_rate", acceleration_of(""))
    subjects: dict[str, Sequence[str] | bool] = {
        "time": True,
        "coordinates": [f"{one}{kind}" for one in states[::2] for kind in kinds],
        "mesh": True,
        "mesh forces": DIRECTIONS if "delta_3" in states else DIRECTIONS[:1],
    }
    instants = np.arange(periods * steps_per_period + 1) / steps_per_period
    contacts = {"contact_@": CONTACTS}
    return listed(axes, subjects, {TIME: instants}, contacts)[len(axes) :]


def acceleration_of(coordinate: str) -> str:
    """Return the name of the acceleration of a coordinate such as ``delta_5``."""
    return f"{coordinate}_acceleration"
