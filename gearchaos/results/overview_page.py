"""The overview of a result file as text for a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from gearchaos.results.result_reader import printable
from gearchaos.results.stage_table import slice_lines

WIDTH = 80
_LABEL = 18
_SETTINGS = ("title", "effects", "formulation", "start", "carry", "fixed")
_INTEGRATION = (
    "method",
    "steps_per_period",
    "crossings",
    "tolerance",
    "unstable",
    "transient_periods",
    "recorded_periods",
)
_RUN = ("wall_time_seconds", "threads", "processor", "system", "software", "git_commit", "created")
MOST_STAGES = 20
"""Of more stages, the first and the last ones are shown."""

_ORIGINS = {
    "swept": "differ from lane to lane",
    "given": "given",
    "derived": "derived from physical quantities",
    "default": "by default",
}


def overview_page(
    overview: Mapping[str, Any], settings: Mapping[str, list[str]], verified: Iterable[str]
) -> str:
    """Write an overview as text, with the keys of the configuration by origin and what fits."""
    sections = {
        "": _file(overview),
        "Accuracy": _accuracy(overview),
        "Run": _metadata(overview, _RUN),
        "Stages": _stages(overview),
        "Dimensionless groups": _groups(overview["parameters"]),
        "Configuration": _settings_by_origin(settings),
        "Variables": _variables(overview["variables"]),
        "Verified": (_wrapped(line, "  ") for line in verified),
    }
    pages = [
        "\n".join([title, *lines] if title else lines)
        for title, content in sections.items()
        if (lines := list(content))
    ]
    return "\n\n".join(pages)


def number(value: float | None) -> str:
    """Write a number in six digits; a dash for what is none."""
    return "-" if value is None else f"{value:.6g}"


def _file(overview: Mapping[str, Any]) -> Iterator[str]:
    metadata = overview["metadata"]
    size = f"{overview['bytes']:,} bytes, {metadata['schema']} {metadata['schema_version']}"
    yield _entry("file", f"{overview['file']} ({size})")
    yield from _metadata(overview, _SETTINGS)
    for name, axis in overview["axes"].items():
        values = "1 value" if axis["values"] == 1 else f"{axis['values']} values"
        span = f"{number(axis['least'])} to {number(axis['greatest'])}{_units(axis)}"
        yield _entry("axis", f"{name} ({axis['long_name']}), {values}, {span}")
    yield _entry("lanes", f"{overview['lanes']}")
    for name, counts in overview["counts"].items():
        yield _entry(name, ", ".join(f"{n} {flag}" for flag, n in counts.items() if n))


def _accuracy(overview: Mapping[str, Any]) -> Iterator[str]:
    yield from _metadata(overview, _INTEGRATION)
    for name, spread in overview["errors"].items():
        if spread["lanes"]:
            text = (
                f"{spread['median']:.1e} (median) to {spread['greatest']:.1e} in {spread['lanes']} "
                "lanes when the step is halved"
            )
            yield _entry(name, text)
    choice = overview["step_choice"]
    for row, steps in enumerate(choice.get("steps", [])):
        measured = (
            f"{name} {number(values[row])}" for name, values in choice.items() if name != "steps"
        )
        yield _entry("step choice", f"{steps} steps: {', '.join(measured)}")


def _stages(overview: Mapping[str, Any]) -> Iterator[str]:
    lines = [
        f"{stage['label']}: {stage['start']:.6g} to {stage['end']:.6g}, "
        f"{stage['lanes']} lane{'s' if stage['lanes'] != 1 else ''}"
        for stage in overview["stages"]
    ]
    half = MOST_STAGES // 2
    if len(lines) > MOST_STAGES:
        lines = [
            f"{len(lines)} stages: the first {half} and the last {half}",
            *lines[:half],
            *lines[-half:],
        ]
    for line in [*slice_lines(overview["slice"]), *lines]:
        yield _wrapped(line, "  ")


def _metadata(overview: Mapping[str, Any], names: Iterable[str]) -> Iterator[str]:
    for name in names:
        value = overview["metadata"].get(name)
        if value not in (None, ""):
            yield _entry(name.replace("_", " "), value if isinstance(value, str) else number(value))


def _settings_by_origin(settings: Mapping[str, list[str]]) -> Iterator[str]:
    for origin, keys in settings.items():
        yield f"  {origin}:"
        yield from (_wrapped(key, "    ", "      ") for key in keys)


def _groups(parameters: Mapping[str, Any]) -> Iterator[str]:
    for origin, wording in _ORIGINS.items():
        mine = {name: entry for name, entry in parameters.items() if entry["origin"] == origin}
        if mine:
            yield f"  {wording}:"
        for name, entry in mine.items():
            values = entry.get("value")
            if isinstance(values, list):
                text = ", ".join(map(number, values))
            elif "least" in entry:
                text = f"{number(entry['least'])} to {number(entry['greatest'])}"
            else:
                text = number(values)
            yield _wrapped(f"{name:26} {text}{_units(entry)}", "    ", " " * 31)


def _variables(variables: Mapping[str, Any]) -> Iterator[str]:
    for name, variable in variables.items():
        dims = ", ".join(
            dim if size is None else f"{dim}: {size}"
            for dim, size in zip(variable["dims"], variable["shape"], strict=True)
        )
        yield _wrapped(f"{name} ({dims}) {variable['dtype']}{_units(variable)}", "  ", "      ")


def _units(entry: Mapping[str, Any]) -> str:
    return "" if entry["units"] in ("", "1") else f" {entry['units']}"


def _entry(label: str, text: str) -> str:
    return _wrapped(f"{label:{_LABEL}}{text}", "  ", " " * (_LABEL + 2))


def _wrapped(text: str, first: str, further: str = "    ") -> str:
    return textwrap.fill(
        printable(text),
        WIDTH,
        initial_indent=first,
        subsequent_indent=further,
        break_on_hyphens=False,
    )
