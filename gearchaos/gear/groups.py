"""The dimensionless groups of a model: given directly, derived from physical data, or defaults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from gearchaos.gear.derivation import derive_groups
from gearchaos.gear.group_table import GROUP_TABLE, GROUPS_BY_NAME, GroupRow

__all__ = [
    "GROUPS_BY_NAME",
    "GROUP_TABLE",
    "GroupRow",
    "Groups",
    "derive_groups",
    "resolve_groups",
]

FloatArray: TypeAlias = npt.NDArray[np.float64]
Value: TypeAlias = float | FloatArray
Origin: TypeAlias = Literal["given", "derived", "default"]

_HARMONICS = ("stiffness_cosine", "stiffness_sine")


@dataclass(frozen=True, eq=False, kw_only=True)
class Groups:
    """The dimensionless groups, each a float, an array over lanes, or None where unknown.

    Names, symbols, ranges and defaults are the rows of `GROUP_TABLE`. The stiffness harmonics
    are arrays of shape (harmonics,), common to all lanes. `origin` tells of every known group
    whether it was given, derived or taken by default.
    """

    mesh_frequency: Value | None = None
    load: Value | None = None
    damping_ratio: Value | None = None
    base_helix_angle_deg: Value | None = None
    half_backlash: Value | None = None
    pitch_error: Value | None = None
    pitch_error_amplitude: Value | None = None
    pitch_error_mean: Value | None = None
    pitch_error_phase_deg: Value | None = None
    stiffness_variation_scale: Value | None = None
    stiffness_cosine: FloatArray | None = None
    stiffness_sine: FloatArray | None = None
    mass_ratio_p: Value | None = None
    mass_ratio_g: Value | None = None
    transverse_stiffness_p: Value | None = None
    transverse_damping_p: Value | None = None
    transverse_stiffness_g: Value | None = None
    transverse_damping_g: Value | None = None
    axial_stiffness_p: Value | None = None
    axial_damping_p: Value | None = None
    axial_stiffness_g: Value | None = None
    axial_damping_g: Value | None = None
    origin: dict[str, Origin] = field(default_factory=dict)

    def missing(self, effects: Iterable[str]) -> list[GroupRow]:
        """Rows of the groups that a scene with these effects needs and that are unknown."""
        active = frozenset(effects)
        return [
            row for row in GROUP_TABLE if row.needed_by(active) and getattr(self, row.name) is None
        ]


def resolve_groups(physical: Any, given: Mapping[str, Any]) -> Groups:
    """Combine groups given directly with those that follow from physical data.

    A group given directly wins over a derived one, a derived one over the default. The
    harmonics of the stiffness are one thing: where only one of cosine and sine is given, the
    other is zero, and the shorter one continues with zeros.

    Parameters
    ----------
    physical : object
        The physical tables, see `derive_groups`.
    given : mapping
        Group name to a number, an array over lanes, or a list of harmonics; None is not given.

    Raises
    ------
    ConfigurationError
        If the stiffness harmonics would differ between lanes.
    KeyError
        If a given name is not a group.
    """
    direct = {name: _as_value(value) for name, value in given.items() if value is not None}
    unknown_names = direct.keys() - GROUPS_BY_NAME.keys()
    if unknown_names:
        raise KeyError(f"not groups: {', '.join(sorted(unknown_names))}")
    without = {*direct, *(_HARMONICS if not direct.keys().isdisjoint(_HARMONICS) else ())}
    derived = {name: _as_value(value) for name, value in derive_groups(physical, without).items()}
    defaults = {row.name: row.default for row in GROUP_TABLE if row.default is not None}
    origin: dict[str, Origin] = {
        **dict.fromkeys(defaults, "default"),
        **dict.fromkeys(derived, "derived"),
        **dict.fromkeys(direct, "given"),
    }
    values: dict[str, Any] = {**defaults, **derived, **direct}
    _complete_harmonics(values, origin)
    in_table_order = {row.name: origin[row.name] for row in GROUP_TABLE if row.name in origin}
    return Groups(**values, origin=in_table_order)


def _as_value(value: Any) -> Value:
    array = np.asarray(value, dtype=np.float64)
    return float(array) if array.ndim == 0 else array


def _complete_harmonics(values: dict[str, Any], origin: dict[str, Origin]) -> None:
    known = [name for name in _HARMONICS if name in values]
    if not known:
        return
    harmonics = max(values[name].size for name in known)
    for name in _HARMONICS:
        coefficients = values.get(name, np.zeros(0))
        values[name] = np.pad(coefficients, (0, harmonics - coefficients.size))
        origin.setdefault(name, "default")
