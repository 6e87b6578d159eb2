"""Pitch deviations in CSV files: read once, and kept word for word beside their numbers."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from typing import Any

from gearchaos.configuration.messages import NUMBER, Fault, shown
from gearchaos.configuration.text_files import text_of_file

LISTS = {"cumulative": "cumulative_um", "single": "single_um"}
"""Keys of the lists of deviations by what a column holds."""


def with_deviation_files(
    tables: Mapping[str, Any], source: str
) -> tuple[Mapping[str, Any], list[Fault]]:
    """Return the tables of a configuration with what the CSV files hold that they name, and faults.

    The numbers go into the table of the gear, where none are listed, and the text into ``files``,
    from which it is taken when the file is asked for again. Paths are relative to the folder of the
    configuration. Raises FileError or ConfigurationError if a file cannot be read.
    """
    faults = []
    for gear in ("driving", "driven"):
        error, here = _table(tables, "pitch_error"), f"pitch_error.{gear}.file"
        table, files = _table(error, gear), _table(tables, "files")
        name = table.get("file")
        if not isinstance(name, str) or not table.keys().isdisjoint(LISTS.values()):
            continue
        if not isinstance(files.get(name), str):
            path = os.path.join(os.path.dirname(source) or ".", name)
            files[name] = text_of_file(path, f"pitch deviations ({here} in {source})")
        try:
            numbers = _column(files[name], table.get("column"))
        except (ValueError, csv.Error) as fault:
            rule, remedy = (*map(str, fault.args), "")[:2]
            faults.append(Fault(here, rule, remedy, name))
            continue
        read = {LISTS.get(str(table.get("holds")), LISTS["cumulative"]): numbers}
        tables = {**tables, "pitch_error": {**error, gear: {**table, **read}}, "files": files}
    return tables, faults


def _table(tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = tables.get(name)
    return dict(found) if isinstance(found, Mapping) else {}


def _column(text: str, column: object) -> list[float]:
    """Return the numbers of a column; ValueError with rule and remedy where they are none."""
    lines = {
        number: line
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    }
    head = next(iter(lines.values()), "")
    delimiter = next((mark for mark in ";\t," if mark in head), ",")
    rows = {
        number: [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        for number, line in lines.items()
    }
    headings = rows.pop(next(iter(rows), 0), [])
    if column not in headings:
        asked = "column is missing" if column is None else f"has no column {shown(column)}"
        raise ValueError(asked, f"its first line has the columns {shown(headings)}")
    place, numbers = headings.index(column), []
    for number, row in rows.items():
        cell = row[place] if place < len(row) else ""
        if not NUMBER.fullmatch(cell):
            rule = f"line {number}, column {column}: must be a finite number, not {shown(cell)}"
            comma = "," in cell or "," in "".join(row) or len(row) > len(headings)
            remedy = "write decimals with a point" if comma else "give one for every tooth"
            raise ValueError(rule, remedy)
        numbers.append(float(cell))
    return numbers
