"""The dimensionless groups of a gear pair: given, derived from physical data, or default."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from gearchaos.models.gear_pair.derivation import derive_groups
from gearchaos.models.gear_pair.geometry import Value
from gearchaos.models.gear_pair.group_table import (
    GROUP_TABLE,
    GROUPS_BY_NAME,
    HARMONICS,
    GroupRow,
)

Origin: TypeAlias = Literal["given", "derived", "default"]


@dataclass(frozen=True, eq=False)
class ResolvedGroups:
    """The dimensionless groups of the rows of `GROUP_TABLE`, each also an attribute by its name.

    ``values``: every group that is known, a number or an array over lanes; the stiffness harmonics
    are arrays of shape (harmonics,) or (..., harmonics) over lanes. The attribute of a group that
    is not known is None. ``origin``: whether each was given, derived or taken by default.
    """

    values: Mapping[str, Value]
    origin: Mapping[str, Origin]

    def __getattr__(self, name: str) -> Any:
        if name not in GROUPS_BY_NAME:
            raise AttributeError(f"{name!r} is not a group")
        return self.values.get(name)

    def with_given(self, given: Mapping[str, Any]) -> "ResolvedGroups":
        """Return the groups with others in place of some that are numbers."""
        values = {name: _as_value(value) for name, value in given.items()}
        origin: Mapping[str, Origin] = dict.fromkeys(given, "given")
        return ResolvedGroups({**self.values, **values}, {**self.origin, **origin})

    def missing(self, effects: Iterable[str]) -> list[GroupRow]:
        """Rows of the groups that a scene with these effects needs and that are unknown."""
        active = frozenset(effects)
        return [row for row in GROUP_TABLE if row.needed_by(active) and row.name not in self.values]


# The rules of the lanes reject values that are not finite, with their keys.
@np.errstate(all="ignore")
def resolve_groups(physical: Mapping[str, Any], given: Mapping[str, Any]) -> ResolvedGroups:
    """Combine groups given directly with those that follow from physical data.

    A group given directly wins over a derived one, a derived one over the default. The harmonics of
    the stiffness are one thing: where only one of cosine and sine is given, the other is zero, and
    the shorter one continues with zeros.

    ``physical`` is as `derive_groups` takes it; ``given`` maps names of groups to a number, an
    array over lanes, or a list of harmonics. Raises KeyError if a given name is not a group.
    """
    direct = {GROUPS_BY_NAME[name].name: value for name, value in given.items()}
    without = {*direct, *(() if direct.keys().isdisjoint(HARMONICS) else HARMONICS)}
    sources: dict[Origin, Mapping[str, Any]] = {
        "default": {row.name: row.default for row in GROUP_TABLE if row.default is not None},
        "derived": derive_groups(physical, without),
        "given": direct,
    }
    values: dict[str, Any] = {}
    origin: dict[str, Origin] = {}
    for source, groups in sources.items():
        values |= groups
        origin |= dict.fromkeys(groups, source)
    if not values.keys().isdisjoint(HARMONICS):
        waves = {name: np.asarray(values.get(name, ()), dtype=np.float64) for name in HARMONICS}
        harmonics = max(wave.shape[-1] for wave in waves.values())
        for name, wave in waves.items():
            missing = np.zeros((*wave.shape[:-1], harmonics - wave.shape[-1]))
            values[name] = np.concatenate([wave, missing], axis=-1)
            origin.setdefault(name, "default")
    names = [row.name for row in GROUP_TABLE if row.name in values]
    return ResolvedGroups(
        {name: _as_value(values[name]) for name in names}, {name: origin[name] for name in names}
    )


def _as_value(value: Any) -> Value:
    array = np.asarray(value, dtype=np.float64)
    return float(array) if array.ndim == 0 else array
