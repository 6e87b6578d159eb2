"""What Pan 2021 prints, read from `published.toml`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files
from typing import Any

CITATION = (
    "Pan, Li, Wang: *Influence of Pitch Error on Vibration, Bifurcation, and Chaos "
    "Characteristics of the Helical Gear Pair System*, 2021"
)


class Kind(StrEnum):
    """What it is worth if a printed number agrees: `published.toml` says which is which."""

    DERIVED = "derived"
    FITTED = "fitted"
    PREDICTED = "predicted"


@dataclass(frozen=True)
class Number:
    """One printed number: its unit (``"1"`` where dimensionless), place, rule and `Kind`."""

    key: str
    quantity: str
    value: float
    unit: str
    where: str
    rule: str
    kind: str


@dataclass(frozen=True)
class PrintedStage:
    """A span of pitch errors (multiples of e(tau)) with one motion, and what the paper calls it."""

    motion: str
    first: float
    last: float
    printed: str


@dataclass(frozen=True)
class ShownMotion:
    """The motion at one pitch error, which a figure of its own shows, and its printed name."""

    figure: int
    pitch_error: float
    motion: str
    printed: str


@dataclass(frozen=True)
class Harmonics:
    """Table 2: harmonics 1, 2, ... of the mesh stiffness, in N/(um mm)."""

    where: str
    rule: str
    kind: str
    cosine: tuple[float, ...]
    sine: tuple[float, ...]


@dataclass(frozen=True)
class ContactLines:
    """Shortest and longest total contact line (in full lines) and the parts of the period."""

    where: str
    shortest: float
    longest: float
    parts: tuple[float, float, float, float]

    @property
    def half_height(self) -> float:
        """Half of the stiffness variation relative to its mean, with equal rise and fall."""
        return (self.longest - self.shortest) / (self.longest + self.shortest)


@dataclass(frozen=True)
class Increments:
    """Growth of the torsional acceleration between neighbours of ``pitch_errors``."""

    where: str
    rule: str
    kind: str
    pitch_errors: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Published:
    """All that the paper prints.

    ``driving_speed_rpm``: what other numbers are derived from; ``kinds``: the `Kind` of the
    ``stages``, of the ``boundaries`` between them and of the ``motions``.
    """

    driving_speed_rpm: float
    numbers: dict[str, Number]
    contact_lines: ContactLines
    harmonics: Harmonics
    increments: Increments
    kinds: dict[str, str]
    stages: tuple[PrintedStage, ...]
    motions: tuple[ShownMotion, ...]


@cache
def published() -> Published:
    """Read the printed numbers."""
    text = files("gearchaos.paper").joinpath("published.toml").read_text(encoding="utf-8")
    tables: dict[str, Any] = tomllib.loads(text)
    return Published(
        driving_speed_rpm=tables["given"]["driving_speed_rpm"],
        numbers={row["key"]: Number(**row) for row in tables["number"]},
        contact_lines=ContactLines(**_frozen(tables["contact_lines"])),
        harmonics=Harmonics(**_frozen(tables["harmonics"])),
        increments=Increments(**_frozen(tables["increments"])),
        kinds=tables["kinds"],
        # What the paper calls as this project does is written once.
        stages=tuple(PrintedStage(**{"printed": row["motion"], **row}) for row in tables["stage"]),
        motions=tuple(ShownMotion(**{"printed": row["motion"], **row}) for row in tables["motion"]),
    )


def _frozen(table: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(entry) if isinstance(entry, list) else entry for key, entry in table.items()}
