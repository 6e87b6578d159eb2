"""The dimensionless groups of a model: what they are, and where their values come from.

Every fact about a group is in groups.csv, once. A value is given directly, derived from physical
data, or a default.
"""

import csv
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from gearchaos.gear.derivation import derive_groups
from gearchaos.gear.geometry import Value

LARGEST_VALUE = 1e300
"""What sweeps reach at most: sums and differences of such values are numbers, too."""


class Range(NamedTuple):
    """The valid numbers: finite, and greater than, at least, less than, at most these bounds."""

    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None

    @property
    def bounds(self) -> str:
        """The bounds in words, such as ``> 0 and < 90``; empty where there are none."""
        signs = zip((">", ">=", "<", "<="), self, strict=True)
        return " and ".join(f"{sign} {bound:.12g}" for sign, bound in signs if bound is not None)

    @property
    def rule(self) -> str:
        """The whole range in words, such as ``finite and >= 0``."""
        return f"finite and {self.bounds}" if self.bounds else "finite"

    def admits(self, value: npt.ArrayLike) -> bool:
        """Whether every entry of a value is valid."""
        values = np.asarray(value, dtype=np.float64)
        valid = np.isfinite(values)
        tests = zip((np.greater, np.greater_equal, np.less, np.less_equal), self, strict=True)
        for test, bound in tests:
            if bound is not None:
                valid = valid & test(values, bound)
        return bool(np.all(valid))


@dataclass(frozen=True)
class GroupRow:
    """One dimensionless group: its names, what needs it, which values it may take.

    ``name``: key in ``[groups]``, attribute of `Groups`, name in the result file; ``mathtext``: its
    symbol; ``long_name``, ``units``: for people and files, ``"1"`` is dimensionless; ``valid``: its
    range; ``default``: where the group is neither given nor derivable, None: it has to be known;
    ``effects``: it is needed when any of these is on, empty: always; ``is_list``: one entry per
    harmonic, which a sweep cannot vary.
    """

    name: str
    mathtext: str
    long_name: str
    valid: Range
    units: str
    default: float | None
    effects: frozenset[str]
    is_list: bool

    @property
    def symbol(self) -> str:
        """The symbol as plain text, such as ``k_11``."""
        return re.sub(r"\\(var)?|[${}]", "", self.mathtext)

    def needed_by(self, effects: Iterable[str]) -> bool:
        """Whether a scene with these effects needs the group."""
        return not self.effects or not self.effects.isdisjoint(effects)


def _rows() -> Iterator[GroupRow]:
    with Path(__file__).with_name("groups.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            bounds = {name: float(row[name]) for name in ("gt", "ge", "lt") if row[name]}
            yield GroupRow(
                row["name"],
                row["mathtext"],
                row["long_name"],
                Range(**bounds),
                row["units"],
                float(row["default"]) if row["default"] else None,
                frozenset(row["effects"].split()),
                row["is_list"] == "yes",
            )


GROUP_TABLE = tuple(_rows())

GROUPS_BY_NAME = MappingProxyType({row.name: row for row in GROUP_TABLE})

Origin: TypeAlias = Literal["given", "derived", "default"]

HARMONICS = tuple(row.name for row in GROUP_TABLE if row.is_list)
"""The two lists of harmonics of the mesh stiffness."""


@dataclass(frozen=True, eq=False)
class Groups:
    """The dimensionless groups of the rows of `GROUP_TABLE`, each also an attribute by its name.

    ``values``: every group that is known, a number or an array over lanes; the stiffness harmonics
    are arrays of shape (harmonics,), common to all lanes. The attribute of a group that is not
    known is None. ``origin``: whether each was given, derived or taken by default.
    """

    values: Mapping[str, Value]
    origin: Mapping[str, Origin]

    def __getattr__(self, name: str) -> Any:
        if name not in GROUPS_BY_NAME:
            raise AttributeError(f"{name!r} is not a group")
        return self.values.get(name)

    def missing(self, effects: Iterable[str]) -> list[GroupRow]:
        """Rows of the groups that a scene with these effects needs and that are unknown."""
        active = frozenset(effects)
        return [row for row in GROUP_TABLE if row.needed_by(active) and row.name not in self.values]


# What is not finite is refused with its key, by the rules of the lanes.
@np.errstate(all="ignore")
def resolve_groups(physical: Mapping[str, Any], given: Mapping[str, Any]) -> Groups:
    """Combine groups given directly with those that follow from physical data.

    A group given directly wins over a derived one, a derived one over the default. The harmonics of
    the stiffness are one thing: where only one of cosine and sine is given, the other is zero, and
    the shorter one continues with zeros.

    ``physical`` is as `derive_groups` takes it; ``given`` maps names of groups to a number, an
    array over lanes, or a list of harmonics. Raises ConfigurationError if the stiffness harmonics
    would differ between lanes, KeyError if a given name is not a group.
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
        harmonics = max(len(values.get(name, ())) for name in HARMONICS)
        for name in HARMONICS:
            known = values.get(name, ())
            values[name] = [*known, *[0.0] * (harmonics - len(known))]
            origin.setdefault(name, "default")
    names = [row.name for row in GROUP_TABLE if row.name in values]
    return Groups(
        {name: _as_value(values[name]) for name in names}, {name: origin[name] for name in names}
    )


def _as_value(value: Any) -> Value:
    array = np.asarray(value, dtype=np.float64)
    return float(array) if array.ndim == 0 else array
