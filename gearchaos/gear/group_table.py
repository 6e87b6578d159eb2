"""The table of the dimensionless groups: every fact about a group is in groups.csv, once."""

import csv
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

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
