"""The swept values, and the dimensionless groups that follow from them."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from gearchaos.configuration.run_tables import Sweep
from gearchaos.configuration.tables import PHYSICAL_KEYS, Tables
from gearchaos.gear.groups import GROUPS_BY_NAME, Groups, resolve_groups
from gearchaos.gear.tooth_deviations import REALISATION

FloatArray: TypeAlias = npt.NDArray[np.float64]

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


def swept_values(sweep: Sweep) -> FloatArray:
    """Return the values of a sweep, shape (values,), in the unit of its parameter, ascending."""
    if sweep.values is not None:
        return np.sort(np.asarray(sweep.values, dtype=np.float64))
    first, last, count = sweep.span
    # One rounding per value: 586 * 15 / 1500 is 5.86, 586 * 0.01 is not always.
    steps = np.arange(count, dtype=np.float64)
    values = first + steps * (last - first) / max(count - 1, 1)
    values[-1] = last
    return values


def axis_values(config: Tables) -> dict[str, FloatArray]:
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
