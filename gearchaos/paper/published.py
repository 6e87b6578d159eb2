"""What Pan 2021 prints, read from `published.toml`."""

import tomllib
from enum import StrEnum
from functools import cache
from importlib.resources import files

from pydantic.dataclasses import dataclass


class Kind(StrEnum):
    """What it is worth if a printed number agrees: `published.toml` says which is which."""

    DERIVED = "derived"
    FITTED = "fitted"
    PREDICTED = "predicted"


@dataclass(frozen=True)
class Printed:
    """Where something is printed, the name of the rule by which it is judged, and its `Kind`."""

    where: str
    rule: str
    kind: Kind


@dataclass(frozen=True)
class Number(Printed):
    """One printed number and its unit, ``"1"`` where it is dimensionless."""

    quantity: str
    value: float
    unit: str


@dataclass(frozen=True)
class Harmonics(Printed):
    """Table 2: harmonics 1, 2, ... of the mesh stiffness, in N/(um mm)."""

    cosine: tuple[float, ...]
    sine: tuple[float, ...]


@dataclass(frozen=True)
class Increments(Printed):
    """Growth of the torsional acceleration between neighbours of ``pitch_errors``."""

    pitch_errors: tuple[float, ...]
    values: tuple[float, ...]


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
class ContactLines:
    """Shortest and longest total contact line (in full lines) and the parts of the period."""

    shortest: float
    longest: float
    parts: tuple[float, float, float, float]


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
    kinds: dict[str, Kind]
    stages: tuple[PrintedStage, ...]
    motions: tuple[ShownMotion, ...]


@cache
def published() -> Published:
    """Read the printed numbers."""
    text = files("gearchaos.paper").joinpath("published.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    tables |= tables["given"] | {"numbers": {row["key"]: row for row in tables["number"]}}
    for name in ("stage", "motion"):
        # What the paper calls as this project does is written once.
        tables[f"{name}s"] = [{"printed": row["motion"], **row} for row in tables[name]]
    return Published(**tables)
