"""The tables of a configuration, the swept values and the groups; `models` checks them."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from gearchaos.arrays import Floats
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
from gearchaos.gear.groups import GROUPS_BY_NAME, Groups, resolve_groups
from gearchaos.gear.tooth_deviations import REALISATION


class Tables(Table):
    """The tables of a configuration, each sound by itself."""

    title: str = key("title of the sweep, for figures and files", default="")
    formulation: Literal["physical", "published"] = key(default="physical")
    """gaps as the equations of motion give them, or as Pan 2021 prints them ("published")"""
    pair: Pair | None = key("catalogue data of the two gears", default=None)
    operation: Operation | None = key("the point of operation", default=None)
    mesh: Mesh | None = key("stiffness, damping and clearance of the mesh", default=None)
    pitch_error: PitchError | None = key("the pitch error", default=None)
    bearings: Bearings | None = key("the bearings", default=None)
    groups: GivenGroups = key("dimensionless groups given directly", default=GivenGroups())
    scene: Scene = key("which effects exist")
    start: Start = key("the state in which the lanes start", default=Start())
    sweep: Sweep = key("the swept parameter and its values")
    second_sweep: Sweep | None = key(default=None)
    """a second swept parameter: every value of it with every one of [sweep]"""
    integration: Integration = key("the fixed grid of the integration", default=Integration())
    outputs: Outputs = key("what is kept of every lane", default=Outputs())
    files: dict[str, str] | None = key(default=None)
    """files that are named above, word for word, as a result keeps them"""

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

        The axial pair is driven one way: without an axial state among the outputs and without the
        exponent of the whole system, nothing that is kept depends on it.
        """
        without_axial = states_of({"transverse"})
        kept = {*self.outputs.section, *self.outputs.states}
        if self.outputs.lyapunov or not kept.issubset(without_axial):
            return self.scene.effects
        return tuple(effect for effect in self.scene.effects if effect != "axial")

    def physical(self) -> dict[str, Any]:
        """Return every key of the physical tables by its path, with its value or None."""
        return dict.fromkeys(PHYSICAL_KEYS) | flat_tables(self.tables(PHYSICAL_TABLES))


PHYSICAL_TABLES = {"pair", "operation", "mesh", "pitch_error", "bearings"}

PHYSICAL_KEYS = {
    key.path: key
    for key in keys_of(Tables)
    if key.path.partition(".")[0] in PHYSICAL_TABLES and not key.tables
}
"""Every value of the physical tables by its path."""

SMOOTHING = "pitch_error.smoothing"
"""A single number that all lanes share, with the weights with which pairs of teeth carry."""

SWEEPABLE_KEYS = {
    path: key
    for path, key in PHYSICAL_KEYS.items()
    if key.is_number and path.count(".") == 1 and path != SMOOTHING
}
"""Physical keys that a sweep may vary, by path: the single numbers of the physical tables."""

SWEEPABLE_GROUPS = {name: row for name, row in GROUPS_BY_NAME.items() if not row.is_list}
"""Groups that a sweep may vary, by name."""


def swept_values(sweep: Sweep) -> Floats:
    """Return the values of a sweep, shape (values,), in the unit of its parameter, ascending."""
    if sweep.values is not None:
        return np.sort(np.asarray(sweep.values, dtype=np.float64))
    first, count = sweep.from_, sweep.count
    assert first is not None and count is not None
    last = first if sweep.to is None or count == 1 else sweep.to
    # One rounding per value: 586 * 15 / 1500 is 5.86, 586 * 0.01 is not always.
    steps = np.arange(count, dtype=np.float64)
    values = first + steps * (last - first) / max(count - 1, 1)
    values[-1] = last
    return values


def axis_values(config: Tables) -> dict[str, Floats]:
    """Return the swept values by parameter, in the order of the axes: [second_sweep] first.

    Each has the shape (values,); a parameter is in its own unit.
    """
    return {one.parameter: swept_values(one) for one in reversed(config.sweeps.values())}


def groups_at(config: Tables, values: Mapping[str, npt.ArrayLike]) -> Groups:
    """Resolve the groups for given values of parameters.

    ``values``, by parameter and in its unit, are arrays that broadcast against each other. A group
    replaces the one in the file; a physical quantity takes part in the derivation of every group
    that is not given; no group depends on the number of a drawn gear pair. Each group comes in the
    broadcast shape of the values on which it depends, as a float where on none. Raises
    ConfigurationError if the harmonics of the mesh stiffness would differ between lanes, KeyError
    if a parameter cannot be swept.
    """
    physical = physical_at(config, values)
    given: dict[str, Any] = dict(config.groups.given())
    if "stiffness_variation" not in config.scene.effects:
        # Lanes share one table of harmonics; a scene without it may sweep what they depend on.
        physical["mesh.stiffness.shape"] = None
    for parameter, value in values.items():
        if parameter in SWEEPABLE_GROUPS:
            given[parameter] = value
        elif parameter != REALISATION and parameter not in SWEEPABLE_KEYS:
            raise KeyError(parameter)
    return resolve_groups(physical, given)


def physical_at(config: Tables, values: Mapping[str, npt.ArrayLike]) -> dict[str, Any]:
    """Return every key of the physical tables by its path, with the values that are swept."""
    swept = {
        SWEEPABLE_KEYS[parameter].path: np.asarray(value, dtype=np.float64)
        for parameter, value in values.items()
        if parameter in SWEEPABLE_KEYS
    }
    return config.physical() | swept
