"""The whole report of a file: summary, figures, tables, accuracy, configuration, glossary."""

import re
from collections.abc import Iterator, Mapping, Sequence
from html import unescape
from pathlib import Path
from typing import Any

from gearchaos.progress import count_of
from gearchaos.reporting import markup
from gearchaos.reporting.glossary import used_in
from gearchaos.reporting.parts import Parts, parts_of
from gearchaos.results.files.boundary_reader import is_boundary_file, read_boundaries
from gearchaos.results.files.branch_reader import is_branch_file, read_branches
from gearchaos.results.reading.overview import (
    ELSEWHERE,
    ERRORS,
    OF_THE_STEP,
    error_spread,
    overview,
    span_text,
)
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.settings import settings_of
from gearchaos.results.reading.tables import unit_text

Rows = list[Sequence[Any]]


def result_report(path: str, computed: Result, shown: Result) -> str:
    """Return the report of a result; ``shown`` is the result in the units of the report."""
    summary, parts = overview(path), parts_of(computed, shown, path)
    what: Rows = [["file", Path(path).name], ["lanes", str(summary["lanes"])]]
    for name, axis in summary["axes"].items():
        unit = "" if axis["units"] in ("", "1") else f" {axis['units']}"
        words = " and ".join(axis["meanings"]) or f"{span_text(axis)}{unit}"
        values = count_of(axis["values"], "value")
        what.append([f"axis {name}", f"{axis['long_name']}, {values}, {words}"])
    for name, counts in summary["counts"].items():
        there = (f"{n} {flag.replace('_', ' ')}" for flag, n in counts.items() if n)
        what.append([name, ", ".join(there)])
    groups = [
        [name, *_value(entry), entry["long_name"], entry["origin"]]
        for name, entry in summary["parameters"].items()
    ]
    tables = {
        "Accuracy": _accuracy(shown),
        "Parameters": [
            markup.table(
                "Parameters, groups and scales",
                ["name", "value", "unit", "meaning", "from"],
                groups,
            )
        ]
        if groups
        else [],
    }
    return _report(summary["metadata"], what, parts, tables)


def curves_report(path: str) -> str | None:
    """Return the report of a file of branches or boundaries; None for any other file."""
    from gearchaos.reporting.curves import boundary_parts, branch_parts

    if is_branch_file(path):
        branches = read_branches(path)
        parts, metadata = branch_parts(branches), branches.metadata
    elif is_boundary_file(path):
        boundaries = read_boundaries(path)
        parts, metadata = boundary_parts(boundaries), boundaries.metadata
    else:
        return None
    return _report(metadata, [["file", Path(path).name]], parts, {})


def _report(
    metadata: Mapping[str, Any], what: Rows, parts: Parts, more: Mapping[str, list[str]]
) -> str:
    """Compose the sections of a report; ``more`` comes between the tables and the configuration."""
    title = str(metadata.get("title", "")) or "Result"
    summary = [markup.table("Summary", ["", ""], what)]
    notes = str(metadata.get("notes", "")).splitlines()
    summary += [markup.paragraph(f"Note: {note}") for note in notes]
    if parts.left_out:
        rest = f"{parts.left_out} more slices are not shown; choose one with --at NAME=VALUE."
        summary.append(markup.paragraph(rest))
    settings = settings_of(metadata)
    run = [
        [name.replace("_", " "), str(value)]
        for name, value in metadata.items()
        if name not in ELSEWHERE and value not in (None, "")
    ]
    sections = {
        "Summary": summary,
        "Figures": parts.figures,
        "Tables": parts.tables,
        **more,
        "Configuration": [markup.table("All keys", ["key", "value", ""], settings)]
        if settings
        else [],
        "Versions": [markup.table("Program, versions and machine", ["", ""], run)],
    }
    words = used_in(" ".join(_visible(sections)))
    sections["Glossary"] = [markup.definitions(words)] if words else []
    return markup.document(title, sections)


def _visible(sections: Mapping[str, list[str]]) -> Iterator[str]:
    """Yield the texts of sections without the markup; underscores of names become spaces."""
    for parts in sections.values():
        for part in parts:
            yield unescape(re.sub(r"<[^>]*>", " ", part)).replace("_", " ")


def _accuracy(result: Result) -> list[str]:
    """Return the measured errors as HTML, or a sentence that none was measured."""
    found = {name: result.variables[name] for name in ERRORS if name in result}
    spreads = {name: error_spread(one, result[name]) for name, one in found.items()}
    measured = {name: one for name, one in spreads.items() if one["values"]}
    parts = [markup.paragraph(f"Method: {result.metadata.get('method_description', '')}.")]
    if measured.keys().isdisjoint(OF_THE_STEP):
        parts.append(
            markup.paragraph(
                "The error of the steps was not measured in this run; integration.error_check does."
            )
        )
    rows = [
        [*ERRORS[name], unit_text(found[name]), one["values"], one["median"], one["greatest"]]
        for name, one in measured.items()
    ]
    if rows:
        headings = ["error", "from", "unit", "lanes [1]", "median [unit]", "greatest [unit]"]
        parts.append(markup.table("Measured errors", headings, rows))
    return parts


def _value(entry: Mapping[str, Any]) -> tuple[Any, str]:
    """Return the value of a parameter, or its range over the lanes, and its unit."""
    unit = "" if entry["units"] in ("", "1") else entry["units"]
    if "value" not in entry:
        return span_text(entry), unit
    value = entry["value"]
    return (", ".join(f"{one:.6g}" for one in value) if isinstance(value, list) else value), unit
