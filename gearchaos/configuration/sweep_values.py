"""The swept values, and the dimensionless groups that every lane gets from them."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from gearchaos.configuration.keys import keys_of
from gearchaos.configuration.physical_tables import PHYSICAL_TABLES
from gearchaos.gear.group_table import GROUPS_BY_NAME
from gearchaos.gear.groups import Groups, derive_groups, resolve_groups

if TYPE_CHECKING:
    from gearchaos.configuration.models import Configuration

FloatArray: TypeAlias = npt.NDArray[np.float64]

SWEEPABLE_KEYS = MappingProxyType(
    {
        key.path: key
        for name, table in PHYSICAL_TABLES.items()
        for key in keys_of(table, name)
        if key.is_number and key.path.count(".") == 1
    }
)
"""Physical keys that a sweep may vary, by path: the single numbers of the physical tables."""

SWEEPABLE_GROUPS = MappingProxyType(
    {name: row for name, row in GROUPS_BY_NAME.items() if row.sweepable}
)
"""Groups that a sweep may vary, by name."""


def swept_values(config: Configuration) -> FloatArray:
    """Return the values of the swept parameter, shape (lanes,), in its own unit, ascending."""
    sweep = config.sweep
    if sweep.values is not None:
        return np.sort(np.asarray(sweep.values, dtype=np.float64))
    first, last, count = sweep.span
    # One rounding per value: 586 * 15 / 1500 is 5.86, 586 * 0.01 is not always.
    steps = np.arange(count, dtype=np.float64)
    values = first + steps * (last - first) / max(count - 1, 1)
    values[-1] = last
    return values


def lane_groups(config: Configuration) -> tuple[FloatArray, Groups]:
    """Return the swept values and the groups of the lanes.

    Returns
    -------
    values : ndarray, shape (lanes,)
        Of the swept parameter, in its own unit, ascending.
    groups : Groups
        Arrays of shape (lanes,) where the swept parameter acts, floats elsewhere.
    """
    values = swept_values(config)
    return values, groups_at(config, values)


def groups_at(config: Configuration, values: FloatArray) -> Groups:
    """Resolve the groups for given values of the swept parameter.

    Parameters
    ----------
    config : Configuration
    values : ndarray, shape (lanes,)
        Of the swept parameter, in its own unit. a group replaces the one in the file; a physical
        quantity takes part in the derivation of every group that is not given.

    Raises
    ------
    ConfigurationError
        If the harmonics of the mesh stiffness would differ between lanes.
    """
    if config.mesh and "stiffness_variation" not in config.scene.effects:
        # Lanes share one table of harmonics; a scene without it may sweep what they depend on.
        mesh = config.mesh.model_copy(update={"stiffness": None})
        config = config.model_copy(update={"mesh": mesh})
    parameter = config.sweep.parameter
    given: dict[str, Any] = dict(config.groups.given())
    if parameter in SWEEPABLE_GROUPS:
        return resolve_groups(config, {**given, parameter: values})
    return resolve_groups(_with_lanes(config, parameter, values), given)


def groups_moved_by(config: Configuration, path: str, values: FloatArray) -> list[str]:
    """Names of the groups, given or not, that a swept physical quantity would change."""
    harmonics = ("stiffness_cosine", "stiffness_sine")
    derived = derive_groups(_with_lanes(config, path, values), without=harmonics)
    return [name for name, value in derived.items() if np.ndim(value) > 0]


def _with_lanes(config: Configuration, path: str, values: FloatArray) -> Configuration:
    table, name = path.split(".")
    model = getattr(config, table) or PHYSICAL_TABLES[table].model_construct()
    return config.model_copy(update={table: model.model_copy(update={name: values})})
