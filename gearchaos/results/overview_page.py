"""The overview of a result file as text for a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from gearchaos.results.excitation import excitation_of
from gearchaos.results.result_reader import printable
from gearchaos.results.stage_table import slice_lines
from gearchaos.results.variables import LARGEST_EXPONENT, STANDARD_ERROR, STEP_ERROR

WIDTH = 80
_LABEL = 18
_SETTINGS = "title effects formulation start carry fixed"
_INTEGRATION = (
    "method steps_per_period crossings tolerance unstable transient_periods recorded_periods"
)
_RUN = "wall_time_seconds threads processor system software kernels git_commit created"
"""Names of metadata that are shown together."""

ERROR_WORDING = {
    "section_error": ("section error", "when the step is halved"),
    STEP_ERROR: ("exponent error", "when the step is halved"),
    LARGEST_EXPONENT + STANDARD_ERROR: (
        "exponent error",
        "one standard error of the finite record; orbits of periodic lanes have none",
    ),
}
"""What the errors in an overview are of, and from what they come."""

MOST_STAGES = 20
"""Of more stages, the first and the last ones are shown."""


def overview_page(
    overview: Mapping[str, Any], settings: Iterable[str], verified: Iterable[str]
) -> str:
    """Write an overview as text, with the keys of the configuration and what fits, a line each."""
    sections = {
        "": _file(overview),
        "Accuracy": _accuracy(overview),
        "Run": _metadata(overview, _RUN),
        "Stages": _stages(overview),
        "Dimensionless groups": _groups(overview["parameters"]),
        "Configuration": (_wrapped(line, "  ") for line in settings),
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
    for note in str(metadata.get("notes", "")).splitlines():
        yield _entry("note", note)


def _accuracy(overview: Mapping[str, Any]) -> Iterator[str]:
    yield from _metadata(overview, _INTEGRATION)
    for name, spread in overview["errors"].items():
        if spread["lanes"]:
            span = f"{spread['median']:.1e} (median) to {spread['greatest']:.1e}"
            label, cause = ERROR_WORDING[name]
            yield _entry(label, f"{span} in {spread['lanes']} lanes, {cause}")
    choice = overview["step_choice"]
    for row, steps in enumerate(choice.get("steps", [])):
        measured = (
            f"{name} {number(values[row])}" for name, values in choice.items() if name != "steps"
        )
        yield _entry("step choice", f"{steps} steps: {', '.join(measured)}")


def _stages(overview: Mapping[str, Any]) -> Iterator[str]:
    lines = [
        f"{stage['label']}: {stage['start']:.6g} to {stage['end']:.6g}, "
        f"{stage['lanes']} lane{'s' if stage['lanes'] != 1 else ''}{_bands(stage['bands'])}"
        for stage in overview["stages"]
    ]
    half = MOST_STAGES // 2
    if len(lines) > MOST_STAGES:
        more = f"{len(lines)} stages: the first {half} and the last {half}"
        lines = [more, *lines[:half], *lines[-half:]]
    unit = excitation_of(overview["metadata"]).in_words
    head = slice_lines(overview["slice"]) + ([unit] if unit and lines else [])
    yield from (_wrapped(line, "  ") for line in head + lines)


def _bands(counts: Mapping[str, int]) -> str:
    most = max(map(int, counts), default=1)
    return f", on up to {most} bands" if most > 1 else ""


def _metadata(overview: Mapping[str, Any], names: str) -> Iterator[str]:
    for name in names.split():
        value = overview["metadata"].get(name)
        if value not in (None, ""):
            yield _entry(name.replace("_", " "), value if isinstance(value, str) else number(value))


def _groups(parameters: Mapping[str, Any]) -> Iterator[str]:
    for name, entry in parameters.items():
        ends = (entry["least"], entry["greatest"]) if "least" in entry else None
        values = entry.get("value")
        text = ", ".join(map(number, values if isinstance(values, list) else [values]))
        text = " to ".join(map(number, ends)) if ends else text
        yield _wrapped(f"{name:26} {text}{_units(entry)} ({entry['origin']})", "  ", " " * 29)


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
    text = printable(text)
    return textwrap.fill(
        text, WIDTH, initial_indent=first, subsequent_indent=further, break_on_hyphens=False
    )
