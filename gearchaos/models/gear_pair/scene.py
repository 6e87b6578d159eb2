"""The effects and the states of a gear pair, and the tables of a configuration that name them."""

from collections.abc import Collection
from typing import Annotated, Literal, TypeAlias, get_args

from gearchaos.configuration import run_tables
from gearchaos.configuration.keys import AS_LIST, key
from gearchaos.configuration.run_tables import ONCE

Effect: TypeAlias = Literal[
    "pitch_error", "stiffness_variation", "backlash", "transverse", "axial", "friction"
]
EFFECTS: tuple[str, ...] = get_args(Effect)

State: TypeAlias = Literal[
    "delta_5",
    "delta_5_rate",
    "delta_1",
    "delta_1_rate",
    "delta_2",
    "delta_2_rate",
    "delta_3",
    "delta_3_rate",
    "delta_4",
    "delta_4_rate",
]
STATES: tuple[str, ...] = get_args(State)


def states_of(effects: Collection[str]) -> tuple[str, ...]:
    """Return the states of a scene with these effects, in the order of `STATES`."""
    transverse = STATES[2:6] if "transverse" in effects else ()
    axial = STATES[6:] if "axial" in effects else ()
    return STATES[:2] + transverse + axial


class Scene(run_tables.Scene):
    """The included effects; all others are left out."""

    effects: Annotated[tuple[Effect, ...], AS_LIST, ONCE] = key(
        "the effects that exist beside torsion and mesh damping",
        example=["pitch_error", "stiffness_variation", "backlash", "transverse"],
    )

    @property
    def states(self) -> tuple[str, ...]:
        """States of the scene, 2, 6 or 10, in the order of `STATES`."""
        return states_of(self.effects)

    def refuses_maps(self) -> str:
        """Return "friction", which changes its sign within the mesh period, where it acts."""
        return "friction" if "friction" in self.effects else ""


class Start(run_tables.Start[State]):
    """The state in which the lanes start."""


class Control(run_tables.Control[State]):
    """A controller that keeps every lane on a periodic orbit by small changes of the load."""


class Outputs(run_tables.Outputs[State]):
    """The kept outputs of every lane."""

    section: Annotated[tuple[State, ...], AS_LIST, ONCE] = key(
        "states recorded once per mesh period", example=["delta_5"], default=("delta_5",)
    )
