"""The tables of a configuration, and what follows from them; `models` checks them."""

from typing import Any, Literal

from gearchaos.configuration.keys import Table, key, keys_of
from gearchaos.configuration.physical_tables import Bearings, Mesh, Operation, Pair, PitchError
from gearchaos.configuration.run_tables import (
    GivenGroups,
    Integration,
    Outputs,
    Scene,
    Start,
    Sweep,
    states_of,
)
from gearchaos.configuration.toml_text import flat_tables


class Tables(Table):
    """The tables of a configuration, each sound by itself."""

    title: str = key("title of the sweep, for figures and files", default="")
    formulation: Literal["physical", "published"] = key(
        'gaps as the equations of motion give them, or as Pan 2021 prints them ("published")',
        default="physical",
    )
    pair: Pair | None = key("catalogue data of the two gears", default=None)
    operation: Operation | None = key("the point of operation", default=None)
    mesh: Mesh | None = key("stiffness, damping and clearance of the mesh", default=None)
    pitch_error: PitchError | None = key("the pitch error", default=None)
    bearings: Bearings | None = key("the bearings", default=None)
    groups: GivenGroups = key("dimensionless groups given directly", default=GivenGroups())
    scene: Scene = key("which effects exist")
    start: Start = key("the state in which the lanes start", default=Start())
    sweep: Sweep = key("the swept parameter and its values")
    second_sweep: Sweep | None = key(
        "a second swept parameter: every value of it with every one of [sweep]", default=None
    )
    integration: Integration = key("the fixed grid of the integration", default=Integration())
    outputs: Outputs = key("what is kept of every lane", default=Outputs())
    files: dict[str, str] | None = key(
        "files that are named above, word for word, as a result keeps them", default=None
    )

    @property
    def sweeps(self) -> dict[str, Sweep]:
        """The sweeps that are there by the name of their table."""
        tables = {name: self.__dict__.get(name) for name in ("sweep", "second_sweep")}
        return {name: sweep for name, sweep in tables.items() if sweep is not None}

    @property
    def swept(self) -> dict[str, str]:
        """The key of each swept parameter, such as ``sweep.parameter``."""
        return {sweep.parameter: f"{table}.parameter" for table, sweep in self.sweeps.items()}

    @property
    def needed_effects(self) -> tuple[str, ...]:
        """The effects of the scene that act on what is kept.

        The axial pair is driven one way: without an axial state in the section and without the
        exponent of the whole system, nothing that is kept depends on it.
        """
        without_axial = states_of({"transverse"})
        if self.outputs.lyapunov or not set(self.outputs.section).issubset(without_axial):
            return self.scene.effects
        return tuple(effect for effect in self.scene.effects if effect != "axial")

    def physical(self) -> dict[str, Any]:
        """Return every key of the physical tables by its path, with its value or None."""
        known = self.model_dump(include=PHYSICAL_TABLES, exclude_none=True)
        return dict.fromkeys(PHYSICAL_KEYS) | flat_tables(known)


PHYSICAL_TABLES = {"pair", "operation", "mesh", "pitch_error", "bearings"}

PHYSICAL_KEYS = {
    key.path: key
    for key in keys_of(Tables)
    if key.path.partition(".")[0] in PHYSICAL_TABLES and not key.tables
}
"""Every value of the physical tables by its path."""
