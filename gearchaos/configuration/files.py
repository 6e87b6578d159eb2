"""Files of a user: texts read whole, and the pitch deviations in CSV files."""

import csv
import os
import re
from collections.abc import Mapping
from math import isfinite
from typing import Any

from gearchaos.configuration.messages import NUMBER, Fault, shown
from gearchaos.errors import ConfigurationError, FileError, GearchaosError

LISTS = {"cumulative": "cumulative_um", "single": "single_um"}
"""Keys of the lists of deviations by what a column holds."""

LARGEST_FILE = 4 * 1024 * 1024
"""Bytes: room for several hundred thousand swept values, and read in seconds whatever it holds."""

CONFIGURATION = "configuration"


def text_of_file(source: str, what: str = CONFIGURATION) -> str:
    """Read the text of a file at a path, a configuration or what else the messages call it.

    Raises FileError or ConfigurationError if it cannot be read.
    """
    if not source:
        raise FileError("no configuration file: the path is empty; name a TOML file")
    try:
        with open(0 if source == "-" else source, "rb", closefd=source != "-") as file:
            content = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        rule = f"cannot be read: {reason}"
        raise FileError(f"{source}: {rule}; check the path of the {what}") from None
    if content.startswith(b"\x89HDF") and what == CONFIGURATION:
        remedy = f"`gearchaos info {source}` shows that of a result"
        raise ConfigurationError(f"{source}: is HDF5, and a configuration is TOML; {remedy}")
    if len(content) > LARGEST_FILE:
        size = f"larger than {LARGEST_FILE // 1024**2} MB, so hardly a {what}"
        remedy = "give many swept values as sweep.from, sweep.to and sweep.count"
        raise ConfigurationError(f"{source}: {size}; name another file, or {remedy}")
    try:
        # utf-8-sig: some editors begin a file with a byte order mark.
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ConfigurationError(
            f"{source}: line {line} is not UTF-8 text; save the {what} as UTF-8"
        ) from None


def with_deviation_files(
    tables: Mapping[str, Any], source: str
) -> tuple[Mapping[str, Any], list[Fault]]:
    """Return the tables of a configuration with the deviations in the files they name, and faults.

    The numbers go into the table of the gear, where none are listed, and the text into ``files``,
    from which it is taken when it is needed again.
    """
    faults = []
    for gear in ("driving", "driven"):
        error, files = _table(tables, "pitch_error"), _table(tables, "files")
        table = _table(error, gear)
        name = table.get("file")
        if not isinstance(name, str) or not table.keys().isdisjoint(LISTS.values()):
            continue
        path = os.path.join(os.path.dirname(source) or ".", name)
        read = LISTS.get(str(table.get("holds")), LISTS["cumulative"])
        try:
            if not isinstance(files.get(name), str):
                files[name] = text_of_file(path, "file of pitch deviations")
            table[read] = _column(files[name], table.get("column"))
            tables = {**tables, "pitch_error": {**error, gear: table}, "files": files}
        except (GearchaosError, ValueError, csv.Error) as fault:
            rule, remedy = [*map(str, fault.args), ""][:2]
            # The fault names the file.
            rule = rule.removeprefix(f"{path}: ")
            faults.append(Fault(f"pitch_error.{gear}.file", rule, remedy, name))
    return tables, faults


def _table(tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = tables.get(name)
    return dict(found) if isinstance(found, Mapping) else {}


def _column(text: str, column: object) -> list[float]:
    """Return the numbers of a column; ValueError with rule and remedy where they are none."""
    # Notes become empty lines, of which there are no rows.
    lines = [re.sub(r"^\s*(#.*)?$", "", line) for line in text.splitlines()]
    headline = next(filter(None, lines), "")
    delimiter = next((mark for mark in ";\t," if mark in headline), ",")
    reader = csv.reader(lines, delimiter=delimiter)
    rows = [(reader.line_num, [*map(str.strip, row)]) for row in reader if row]
    headings = rows.pop(0)[1] if rows else []
    if column not in headings:
        asked = "column is missing" if column is None else f"has no column {shown(column)}"
        raise ValueError(asked, f"its first line has the headings {shown(headings)}")
    place = headings.index(column)
    cells = [(line, "".join(row[place : place + 1])) for line, row in rows]
    # Beside a gear with more teeth a column ends in empty cells.
    while cells and not cells[-1][1]:
        cells.pop()
    for line, cell in cells:
        if not (NUMBER.fullmatch(cell) and isfinite(float(cell))):
            rule = f"line {line}, column {column}: must be a finite number, not {shown(cell)}"
            raise ValueError(rule, "give one for every tooth, decimals with a point")
    return [float(cell) for _, cell in cells]
