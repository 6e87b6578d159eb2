"""The tables of a configuration that describe a gear pair, and the groups that follow from them."""

from collections.abc import Collection, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import create_model

from gearchaos.arrays import Integers
from gearchaos.configuration.keys import Key, Table, key, keys_of
from gearchaos.configuration.messages import suggestion
from gearchaos.configuration.tables import OF_CONTROLLERS, Parameter, Tables, Titled
from gearchaos.configuration.toml_text import flat_tables
from gearchaos.models.gear_pair.group_table import (
    GROUP_TABLE,
    GROUPS_BY_NAME,
    SWEEPABLE_GROUPS,
    GroupRow,
)
from gearchaos.models.gear_pair.groups import ResolvedGroups, resolve_groups
from gearchaos.models.gear_pair.physical_tables import (
    Bearings,
    GradeError,
    Harmonics,
    Mesh,
    Operation,
    Pair,
    PitchError,
)
from gearchaos.models.gear_pair.scene import Control, Outputs, Scene, Start, states_of
from gearchaos.outputs.names import REALISATION


class GroupsTable(Table):
    """Dimensionless groups given directly; one given here wins over the one derived."""

    def given(self) -> dict[str, float | tuple[float, ...]]:
        """Return the groups that the file gives, by name."""
        return {name: value for name, value in self if value is not None}


def _group_field(row: GroupRow) -> tuple[Any, Any]:
    units = "" if row.units == "1" else row.units
    description = f"{row.long_name} ({row.symbol})"
    if row.is_list:
        return Harmonics | None, key(description, units, default=None)
    bounds = {name: bound for name, bound in row.valid._asdict().items() if bound is not None}
    return float | None, key(description, units, default=None, **bounds)


if TYPE_CHECKING:
    GivenGroups = GroupsTable
else:
    # The table of the groups knows their names and ranges; nothing is written twice.
    GivenGroups = create_model(
        "GivenGroups",
        __base__=GroupsTable,
        __module__=__name__,
        __doc__=GroupsTable.__doc__,
        **{row.name: _group_field(row) for row in GROUP_TABLE},
    )


class PhysicalTables(Titled):
    """The tables of a gear pair, each sound by itself."""

    formulation: Literal["physical", "published"] = key(default="physical")
    """gaps as the equations of motion give them, or as Pan 2021 prints them ("published")"""
    pair: Pair | None = key("catalogue data of the two gears", default=None)
    operation: Operation | None = key("the point of operation", default=None)
    mesh: Mesh | None = key("stiffness, damping and clearance of the mesh", default=None)
    pitch_error: PitchError | None = key("the pitch error", default=None)
    bearings: Bearings | None = key("the bearings", default=None)
    groups: GivenGroups = key("dimensionless groups given directly", default=GivenGroups())

    # Searches for orbits need the groups at thousands of values, one after the other.
    @cached_property
    def physical(self) -> Mapping[str, Any]:
        """Every key of the physical tables by its path, with its value or None."""
        return dict.fromkeys(PHYSICAL_KEYS) | flat_tables(self.tables(PHYSICAL_TABLES))


PHYSICAL_TABLES = {"pair", "operation", "mesh", "pitch_error", "bearings"}

PHYSICAL_KEYS = {
    key.path: key
    for key in keys_of(PhysicalTables)
    if key.path.partition(".")[0] in PHYSICAL_TABLES and not key.tables
}
"""Every value of the physical tables by its path."""

SMOOTHING = "pitch_error.smoothing"
"""A single number that all lanes share, with the weights with which pairs of teeth carry."""

CONTACT_RATIO = "pair.contact_ratio"
"""A single number that all lanes share, with the harmonics of the mesh stiffness."""

SWEEPABLE_KEYS = {
    path: key
    for path, key in PHYSICAL_KEYS.items()
    if key.is_number and path.count(".") == 1 and path not in (SMOOTHING, CONTACT_RATIO)
}
"""Physical keys that a sweep may vary, by path: the single numbers of the physical tables."""

PARAMETERS = MappingProxyType(
    {
        row.name: Parameter(
            row.name, f"groups.{row.name}", row.valid, row.units, row.long_name, row.mathtext
        )
        for row in SWEEPABLE_GROUPS.values()
    }
    | {
        path: Parameter(path, path, key.valid, key.units or "1", key.wording)
        for path, key in SWEEPABLE_KEYS.items()
    }
    | OF_CONTROLLERS
)
"""Groups, physical keys and keys of controllers that a sweep may vary, by name."""


class GearPairTables(Tables, PhysicalTables):
    """All tables of a configuration of gear pairs."""

    parameters = PARAMETERS
    actuators = ("load",)
    realisation_words = "drawn gear pairs"
    tables_of_lanes = frozenset({"sweep", "second_sweep", "scene", "groups", *PHYSICAL_TABLES})

    scene: Scene = key("which effects exist")
    start: Start = key("the state in which the lanes start", default=Start())
    outputs: Outputs = key("the kept outputs of every lane", default=Outputs())
    control: Control | None = key("a controller of every lane", default=None)

    @cached_property
    def resolved_groups(self) -> ResolvedGroups:
        """The groups of the file, without any value of a sweep."""
        return _resolved(self, {}, {})

    @property
    def states(self) -> tuple[str, ...]:
        """States of the scene, 2, 6 or 10, in the order of `STATES`."""
        return self.scene.states

    def states_of(self, effects: Collection[str]) -> tuple[str, ...]:
        """Return the states of a scene with these effects, in the order of `STATES`."""
        return states_of(effects)

    @classmethod
    def default_of(cls, key: Key) -> Any:
        """Return the default of a key; that of a group is in the table of groups."""
        table, _, name = key.path.rpartition(".")
        return GROUPS_BY_NAME[name].default if table == "groups" else super().default_of(key)

    def parameter_remedy(self, unknown: str) -> str:
        """Return what to sweep instead of an unknown parameter."""
        if unknown.startswith("bearings."):
            return "sweep the group of one gear, such as axial_damping_p"
        return suggestion(unknown, PARAMETERS) or (
            f"groups: {', '.join(SWEEPABLE_GROUPS)}; physical keys: {', '.join(SWEEPABLE_KEYS)}"
        )

    @property
    def needed_effects(self) -> tuple[str, ...]:
        """The effects of the scene that act on what is kept.

        Axial motion does not act back on the other states: without an axial state among the outputs
        and without the exponent of the whole system, nothing that is kept depends on it.
        """
        without_axial = states_of({"transverse"})
        kept = {*self.outputs.section, *self.outputs.states}
        kept |= {*self.control.measured} if self.control else set()
        if self.outputs.lyapunov or not kept.issubset(without_axial):
            return self.scene.effects
        return tuple(effect for effect in self.scene.effects if effect != "axial")

    @property
    def realisations(self) -> Integers:
        """Numbers of the gear pairs that are drawn by a grade for each value, (realisations,)."""
        error = self.__dict__.get("pitch_error")
        if not isinstance(error, GradeError):
            return super().realisations
        return error.first_realisation + np.arange(error.realisations)

    def keys_of_realisation(self, number: float) -> dict[str, float]:
        """Return the keys, by path, that make this drawn gear pair the only one."""
        if not isinstance(self.pitch_error, GradeError):
            return super().keys_of_realisation(number)
        whole = int(number) if float(number).is_integer() else number
        return {"pitch_error.first_realisation": whole, "pitch_error.realisations": 1}


def groups_at(config: GearPairTables, values: Mapping[str, npt.ArrayLike]) -> ResolvedGroups:
    """Resolve the groups for given values of parameters.

    ``values``, by parameter and in its unit, are arrays that broadcast against each other. A group
    replaces the one in the file; a physical quantity takes part in the derivation of every group
    that is not given; no group depends on the number of a drawn gear pair. Each group comes in the
    broadcast shape of the values on which it depends, as a float where on none; harmonics have one
    more axis. Raises KeyError if a parameter cannot be swept.
    """
    for parameter in values.keys() - SWEEPABLE_GROUPS.keys():
        if parameter not in {REALISATION, *SWEEPABLE_KEYS, *OF_CONTROLLERS}:
            raise KeyError(parameter)
    swept = {name: value for name, value in values.items() if name in SWEEPABLE_GROUPS}
    if SWEEPABLE_KEYS.keys().isdisjoint(values):
        return config.resolved_groups.with_given(swept)
    return _resolved(config, values, swept)


def _resolved(
    config: GearPairTables, values: Mapping[str, npt.ArrayLike], swept: Mapping[str, npt.ArrayLike]
) -> ResolvedGroups:
    """Return the groups for values of parameters; ``swept``: those that are groups."""
    physical = physical_at(config, values)
    if "stiffness_variation" not in config.scene.effects:
        # Unused, so that a sweep of what they depend on need not compile formulas for them.
        physical["mesh.stiffness.shape"] = None
    return resolve_groups(physical, {**config.groups.given(), **swept})


def physical_at(config: GearPairTables, values: Mapping[str, npt.ArrayLike]) -> dict[str, Any]:
    """Return every key of the physical tables by its path, with the values that are swept."""
    swept = {
        SWEEPABLE_KEYS[parameter].path: np.asarray(value, dtype=np.float64)
        for parameter, value in values.items()
        if parameter in SWEEPABLE_KEYS
    }
    return {**config.physical, **swept}
