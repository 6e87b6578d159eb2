"""What a sweep yields: name, dimensions, type, unit and wording of every variable, in one place."""

import csv
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gearchaos.arrays import Array, Floats
from gearchaos.configuration.tables import REALISATION

START = "start"
DIRECTION = "direction"
REPEATS = (REALISATION, START)  # Axes of drawn gear pairs and of starts of one parameter value.
UNSWEPT = (*REPEATS, DIRECTION)  # Axes along which no parameter is swept.
WAYS = ("upwards", "downwards")  # Meanings of a direction in which a sweep carries its states.
SECTION_POINT = "section_point"
STATE = "state"
EXPONENT_NUMBER = "exponent"
ORDER = "order"
HARMONIC = "harmonic"
"""Dimensions: the start of a lane is one of its axes, the others belong to single variables."""

SECTION = "section_"  # What the names of section variables begin with.
AMPLITUDE = "amplitude_"  # What the names of amplitudes begin with.
EXTREMES = ("smallest", "largest", "peak_to_peak")  # What the names of those of a state end with.

LARGEST_EXPONENT = "lyapunov_exponent"
STANDARD_ERROR = "_standard_error"
STEP_ERROR = "exponent_step_error"
RECORD = "record"
LABELS = ("motion", "period")
BANDS = "bands"
CROSSINGS = "crossings_per_period"
STATUS = "status"
DIRECTIONS = ("tangential", "axial")  # Directions in which teeth have a clearance.

_ROWS: dict[str, list[dict[str, str]]] = {}
"""What files hold, by what it is told with, in their order, behind the words for states and others.

In all three columns of texts, @ stands for one of these.
"""
with Path(__file__).with_name("variables.csv").open(encoding="utf-8", newline="") as _file:
    for _row in csv.DictReader(_file):
        _ROWS.setdefault(_row["told_with"], []).append(_row)

_WORDING = {
    kind: {row["name"]: (row["long_name"], row["symbol"]) for row in _ROWS[kind]}
    for kind in ("state", "acceleration", "direction")
}
STATE_WORDING = _WORDING["state"]
"""Long name and mathtext symbol of each state (all dimensionless), in the one order of states."""


ORIGINS = ("given", "derived", "default", "swept")


@dataclass(frozen=True, eq=False)
class Variable:
    """One named array of a result.

    The dimensions of what differs from lane to lane begin with all axes; the type is ``"float64"``,
    ``"int32"`` or ``"uint8"``, the unit ``"1"`` where dimensionless, the symbol
    mathtext. The fill value stands for "none here", None where every value means something; flags
    are the meanings of 0, 1, 2, ... of an enumeration, one word each, errors the variables that
    tell how exact this one is. Values, of the shape of the
    dimensions, are there where they are known before the sweep, as those of coordinates are.

    Parameters of the model are variables with an origin, one of `ORIGINS`, and with values; their
    dimensions are none, ``harmonic``, or the axes along which they are swept.
    """

    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str
    long_name: str
    symbol: str = ""
    fill_value: float | int | None = None
    flags: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()
    values: Any = None
    origin: str = ""

    @property
    def attributes(self) -> dict[str, Any]:
        """Everything a file says about the variable beside its values."""
        texts = {name: getattr(self, name) for name in ("units", "long_name", "symbol", "origin")}
        texts["flag_meanings"] = " ".join(self.flags)
        texts["ancillary_variables"] = " ".join(self.errors)
        told: dict[str, Any] = {name: text for name, text in texts.items() if text}
        if self.flags:
            told["flag_values"] = np.arange(len(self.flags), dtype=self.dtype)
        return told


def coordinate(name: str, units: str, long_name: str, symbol: str, values: Floats) -> Variable:
    """Give a variable that is a dimension of its own, the axis of a parameter: values ascend."""
    return Variable(name, (name,), "float64", units, long_name, symbol, values=values)


def axis_name(parameter: str) -> str:
    """Give the name of the axis of a swept parameter, e.g. ``operation_speed_rpm``."""
    return parameter.replace(".", "_")


def unswept_axis(name: str, numbers: Array) -> Variable:
    """Give the axis of several starts, drawn gear pairs or directions, of these numbers."""
    return listed((), {f"{name} axis": True}, {name: numbers}, {DIRECTION: WAYS})[0]


def coordinate_text(axis: str, value: float, digits: int = 12) -> str:
    """Word a coordinate; that of a direction is its name."""
    named = axis == DIRECTION and value in range(len(WAYS))
    return WAYS[int(value)] if named else f"{value:.{digits}g}"


def diagram_axis(axes: Sequence[str]) -> str:
    """Name the axis along which a diagram runs: the first swept parameter, "" without axes."""
    return ([*axes[:1]] + [name for name in axes if name not in UNSWEPT])[-1] if axes else ""


def lane_axes(variables: Sequence[Variable]) -> tuple[str, ...]:
    """Name the axes of a result: the dimensions of ``status``, which every lane has."""
    return next(variable.dims for variable in variables if variable.name == STATUS)


def due(axes: Sequence[str], found: Collection[str]) -> Iterator[tuple[str, tuple[str, ...], str]]:
    """Give name, dimensions and type of all that a file must hold that holds these variables.

    Those are axes, what every sweep has, and what is told together with one that is there.
    """
    for axis in axes:
        yield axis, (axis,), "int32" if axis in UNSWEPT else "float64"
    subjects = (*STATE_WORDING, *DIRECTIONS, "transmission_error")
    for told_with, (first, *others) in _ROWS.items():
        for subject in subjects if "@" in first["name"] else ("",):
            there = first["type"] and first["name"].replace("@", subject) in found
            for row in (first, *others) if there or told_with == "every sweep" else ():
                yield row["name"].replace("@", subject), _dims(axes, row), row["type"]
        if told_with == "every sweep":
            # What follows no sweep need have.
            break


def listed(
    axes: Sequence[Variable],
    subjects: Mapping[str, Sequence[str] | bool],
    values: Mapping[str, ArrayLike],
    meanings: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> list[Variable]:
    """List axes, and what of variables.csv is told with these subjects, in the order of the file.

    Each is as often there as there are subjects, and once where that is but true. ``values`` of
    what is known beforehand, and ``meanings`` of 0, 1, ..., are by the names in the table. Raises
    ValueError if a subject, a value or a meaning is of none of its rows.
    """
    kinds = _ROWS.keys() - _WORDING.keys()
    names = {row["name"] for kind in kinds for row in _ROWS[kind]}
    for given, there in ((subjects, kinds), (values, names), (meanings, names)):
        if unknown := sorted(given.keys() - there):
            raise ValueError(
                f"{', '.join(unknown)}: no row of variables.csv; correct it or add one"
            )
    lane, variables = tuple(axis.name for axis in axes), list(axes)
    words = {name: words for kind in _WORDING.values() for name, words in kind.items()}
    for told_with, rows in _ROWS.items():
        told = subjects.get(told_with, ())
        for subject, row in product([""] if told is True else told or (), rows):
            wording, symbol = words.get(subject, (subject.replace("_", " "), ""))
            known = values.get(row["name"])
            variables.append(
                Variable(
                    name=row["name"].replace("@", subject),
                    dims=_dims(lane, row),
                    dtype=row["type"],
                    units="1",
                    long_name=row["long_name"].replace("@", wording),
                    symbol=row["symbol"].replace("@", symbol),
                    fill_value=np.dtype(row["type"]).type(row["none"]) if row["none"] else None,
                    flags=tuple("_".join(one.split()) for one in meanings.get(row["name"], ())),
                    errors=tuple(row["errors"].split()),
                    values=None if known is None else np.asarray(known, dtype=row["type"]),
                )
            )
    there = {one.name for one in variables}
    return [replace(v, errors=tuple(e for e in v.errors if e in there)) for v in variables]


def require_listed(arrays: Collection[str], variables: Collection[str]) -> None:
    """Raise ValueError if one of the arrays, by their names, is none of the variables."""
    if unlisted := sorted(set(arrays) - set(variables)):
        raise ValueError(
            f"{', '.join(unlisted)}: would not be written, being none of the variables of the "
            "result; add a row to variables.csv, or list it"
        )


def _dims(axes: Sequence[str], row: Mapping[str, str]) -> tuple[str, ...]:
    return (*(axes if row["per"] == "lane" else ()), *row["along"].split())
