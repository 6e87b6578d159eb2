"""A stiffness over the mesh period as a table, in lists or in a CSV file."""

import csv
import re
from collections.abc import Iterator, Mapping
from typing import Any, Literal, Self, TypeAlias

from pydantic import model_validator

from gearchaos.configuration.keys import Numbers, Table, key
from gearchaos.configuration.messages import NUMBER, Fault, shown
from gearchaos.configuration.named_files import CsvText, fault_of, text_beside
from gearchaos.errors import GearchaosError
from gearchaos.models.phase_series import Series, series_of

Unit: TypeAlias = Literal["N/um", "N/mm", "N/m", "N/(um mm)", "1"]

IN_N_PER_UM: Mapping[str, float] = {"N/um": 1.0, "N/mm": 1e-3, "N/m": 1e-6}
"""N/um in each unit of the stiffness of a whole mesh."""

PER_WIDTH = "N/(um mm)"
"""Unit of the stiffness of a mesh per unit face width."""

MOST_HARMONICS = 200
"""Largest number of harmonics of a table. The kernels have no limit; a machine is compiled with
every harmonic of every element, which takes 20 s more for 60 of them."""

_LENGTH = "um|µm|μm|mm|m"
_UNIT = re.compile(
    rf"(?<![A-Za-z])N *(?:/|_per_| per ) *\(? *({_LENGTH})(?:[ _/*·.]+({_LENGTH}))?\b *\)?"
)
_MORE = re.compile(r"[\^²³\d]|\*\*|[ _]*(?:/|per(?![A-Za-z]))")
_DEGREES = re.compile(r"deg|°", re.IGNORECASE)


class StiffnessTable(Table):
    """A stiffness by a table over the mesh period, which becomes a Fourier series."""

    shape: Literal["table"] = key("form in which the stiffness is given", example="table")
    file: str | None = key(
        "CSV file with phase and stiffness, relative to the configuration", default=None
    )
    phase_column: str | None = key(
        "heading of the phase in the file, by default the first one", default=None
    )
    column: str | None = key(
        "heading of the stiffness in the file, by default the second one", default=None
    )
    period: float | None = key(default=None, gt=0)
    """length of a mesh period in the unit of the phase; by default 360 if the heading of the phase
    says degrees, otherwise 1"""
    unit: Unit | None = key(default=None)
    """unit of the stiffness, by default that in the heading; "1" is relative to the mean"""
    fit_error: float = key(default=0.01, units="1", gt=0, le=0.5)
    """largest root mean square of the deviation of the series from the table, over the mean"""
    most_harmonics: int = key(
        "largest number of harmonics of the series", default=40, ge=1, le=MOST_HARMONICS
    )
    phase: Numbers | None = key("phases instead of a file, ascending", default=None)
    values: Numbers | None = key("stiffness at these phases instead of a file", default=None)

    @model_validator(mode="after")
    def _is_sound(self) -> Self:
        """Refuse tables that no series fits."""
        if self.phase is None or self.values is None:
            raise ValueError("has no table; give file, or the lists phase and values")
        try:
            self.series  # noqa: B018
        except ValueError as fault:
            file = "" if self.file is None else f"{self.file}: "
            raise ValueError(f"{file}{fault}") from None
        return self

    @property
    def series(self) -> Series:
        """The Fourier series, in the unit of the table."""
        return table_series(
            self.phase or (), self.values or (), self.period, self.fit_error, self.most_harmonics
        )


def table_series(
    phase: tuple[float, ...],
    values: tuple[float, ...],
    period: float | None,
    error: float,
    most: int,
) -> Series:
    """Return the Fourier series of a table whose phase is in any unit; see `series_of`."""
    length = 1.0 if period is None else period
    return series_of(tuple(one / length for one in phase), tuple(values), error, most)


def note_of(path: str, table: StiffnessTable) -> str:
    """Return by how many harmonics a table is represented, and how well."""
    series, file = table.series, "its table" if table.file is None else table.file
    return (
        f"{path}: {series.harmonics} harmonics fit {file} with a root mean square deviation of "
        f"{series.error:.2g} and a largest one of {series.largest_error:.2g} of the mean, "
        f"{series.mean:.6g}{_spaced(table.unit)}"
    )


def _spaced(unit: str | None) -> str:
    return "" if unit in (None, "1") else f" {unit}"


def with_stiffness_files(
    tables: Mapping[str, Any], folder: str | None
) -> tuple[Mapping[str, Any], list[Fault]]:
    """Return tables with the contents of the stiffness tables that they name, and faults.

    The numbers go into the lists, and the text of the files into ``files``, from which it is taken
    when it is needed again. Other files are read from ``folder`` only, none without it.
    """
    given = tables.get("files")
    files, faults = dict(given) if isinstance(given, Mapping) else {}, []

    def read(value: Any, path: str) -> Any:
        if isinstance(value, list):
            return [read(one, f"{path}.{_name_of(one, at)}") for at, one in enumerate(value)]
        if not isinstance(value, Mapping):
            return value
        if value.get("shape") != "table" or not isinstance(value.get("file"), str):
            return {name: read(one, f"{path}.{name}".lstrip(".")) for name, one in value.items()}
        name = value["file"]
        try:
            if not isinstance(files.get(name), str):
                files[name] = text_beside(folder, name, "file with a stiffness")
            return {**value, **_contents(value, files[name])}
        except (GearchaosError, ValueError, csv.Error) as fault:
            faults.append(fault_of(f"{path}.file", fault, name))
            return value

    found = {name: one if name == "files" else read(one, name) for name, one in tables.items()}
    return ({**found, "files": files} if files else found), faults


def _name_of(entry: Any, at: int) -> str:
    """Return the name of an entry of a list, such as of ``[[clearance]]``."""
    name = entry.get("name") if isinstance(entry, Mapping) else None
    return name if isinstance(name, str) else str(at)


def _contents(table: Mapping[str, Any], text: str) -> dict[str, Any]:
    """Return phase, values, period and unit of a table by its CSV text."""
    found = CsvText(text, decimal_comma=True)
    if len(found.headings) < 2 or all(map(NUMBER.fullmatch, found.headings)):
        rule = "has no line with two headings"
        raise ValueError(rule, "let it begin with one such as: phase_deg,stiffness_N_per_um")
    phase, column = table.get("phase_column"), table.get("column")
    phase = found.headings[0] if phase is None else phase
    column = found.headings[1] if column is None else column
    contents: dict[str, Any] = {
        "phase": found.column(phase, "point"),
        "values": found.column(column, "point"),
    }
    if table.get("period") is None:
        contents["period"] = 360.0 if _DEGREES.search(str(phase)) else 1.0
    unit = unit_of(str(column))
    if unit and table.get("unit") not in (None, unit):
        rule = f"column {shown(column)} has another unit than the key unit = {table['unit']}"
        raise ValueError(rule, "keep one of the two")
    return contents | ({"unit": unit} if unit else {})


def unit_of(heading: str) -> str:
    """Return the unit in the heading of a column, empty without one that is known."""
    found = _UNIT.search(heading)
    if found is None:
        return ""
    in_brackets = heading[: found.start()].rstrip().endswith(("[", "("))
    rest = heading[found.end() :]
    if _MORE.match(rest) or (in_brackets and not re.match(r" *[\])]|$", rest)):
        # More follows: this is another unit.
        return ""
    lengths = [one.replace("µ", "u").replace("μ", "u") for one in found.groups() if one]
    if sorted(lengths) == ["mm", "um"]:
        return PER_WIDTH
    unit = f"N/{lengths[0]}"
    return unit if len(lengths) == 1 and unit in IN_N_PER_UM else ""


def tables_in(tables: Any, path: str = "") -> Iterator[tuple[str, StiffnessTable]]:
    """Give dotted path and stiffness table of all inside a table or named tables."""
    entries = tables if isinstance(tables, Table) else getattr(tables, "items", lambda: ())()
    for name, value in entries:
        here = f"{path}.{name}".lstrip(".")
        if isinstance(value, StiffnessTable):
            yield here, value
        else:
            yield from tables_in(value, here)
