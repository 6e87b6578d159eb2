"""Summary of a result file: plain numbers, texts and lists, and a page for a terminal."""

import math
import os
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.arrays import Array
from gearchaos.outputs import names as known
from gearchaos.outputs.variable import Variable
from gearchaos.progress import count_of
from gearchaos.results.files.result_reader import printable, read_result
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import labelled_lanes, one_axis, slice_facts, stage_table

ERRORS = {
    "section_error": ("section error", "from the step and from what the transient has left"),
    known.STEP_ERROR: ("exponent error", "from the step"),
    known.LARGEST_EXPONENT + known.STANDARD_ERROR: (
        "exponent error",
        "one standard error of the finite record; orbits of periodic lanes have none",
    ),
}
"""Variables that measure an error: the label of the error, and where it comes from."""

OF_THE_STEP = ("section_error", known.STEP_ERROR)
"""Those that measure the error of the steps."""

ELSEWHERE = ("title", "notes", "configuration", "configuration_resolved")
"""Metadata that are shown in other sections of the page."""

MOST_STAGES = 20  # If there are more stages, only the first and the last ones are shown.

WIDTH = 80
_LABEL = 18


def overview(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Summarise a result file; at most one number of each lane and variable is read.

    Parameters
    ----------
    path : path-like
        Name of the file.

    Returns
    -------
    dict
        Values that JSON can hold; numbers that are not finite are None. Axes, parameters, counts
        and variables are by name. ``errors`` are the measured errors, ``stages`` the stages of the
        first slice along the swept parameter.

    Raises
    ------
    FileError
        If the file is missing or damaged, if it is no result, or if its format has another major
        version.

    Examples
    --------
    >>> from gearchaos.results.reading.overview import overview
    >>> [*overview("pan2021.h5")["axes"]]
    ['pitch_error']
    """
    variables, data, parameters, metadata = read_result(path, rows=False)
    read = [variable for variable in variables if variable.name in data]
    result = Result(str(metadata["axes"]).split(), read, data, parameters, metadata)
    of_axes = [result.variables[axis] for axis in result.axes]
    # The dimensions are checked: another program may have put other data under a known name.
    of_lanes = [v for v in read if v.dims == result.axes and v.name not in result.axes]
    summary: dict[str, Any] = {
        "file": os.fspath(path),
        "bytes": Path(path).stat().st_size,
        "lanes": math.prod(axis.values.size for axis in of_axes),
        "axes": {
            axis.name: {**_spread(axis.values), **_wording(axis), "meanings": axis.flags}
            for axis in of_axes
        },
        "metadata": metadata,
        "parameters": {name: _parameter(entry) for name, entry in parameters.items()},
        "counts": {v.name: _counts(v, data[v.name]) for v in of_lanes if _is_code(v)},
        "errors": {v.name: error_spread(v, data[v.name]) for v in of_lanes if v.name in ERRORS},
        "variables": {v.name: {"dims": v.dims, "dtype": v.dtype, **_wording(v)} for v in variables},
        "slice": {},
        "stages": [],
    }
    if result.axis not in known.UNSWEPT and all(name in result for name in known.LABELS):
        part = one_axis(result)
        stages = stage_table(labelled_lanes(part))
        summary |= {"slice": slice_facts(result, part), "stages": stages}
    return dict(json_values(summary))


def json_values(value: Any) -> Any:
    """Turn records and complex numbers into values of JSON; infinities and NaN become None."""
    value = value._asdict() if hasattr(value, "_asdict") else value
    if isinstance(value, Mapping):
        return {name: json_values(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [*map(json_values, value)]
    if isinstance(value, complex):
        return json_values([value.real, value.imag])
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _parameter(parameter: Variable) -> dict[str, Any]:
    value = np.asarray(parameter.values)
    # A parameter that varies over lanes may have a million values, so only its range is given.
    along_axes = parameter.dims not in ((), (known.HARMONIC,))
    content = _spread(value) if along_axes else {"value": value.tolist()}
    return {"origin": parameter.origin, **content, **_wording(parameter)}


def error_spread(variable: Variable, values: Array) -> dict[str, Any]:
    """Return number, least, median and greatest of errors, and their unit.

    Exponents of orbits have a standard error of 0, which is left out.
    """
    if variable.name.endswith(known.STANDARD_ERROR):
        values = values[values > 0.0]
    return {**_spread(values), "units": variable.units}


def _wording(entry: Variable) -> dict[str, str]:
    return {"units": entry.units, "long_name": entry.long_name}


def _is_code(variable: Variable) -> bool:
    """Whether a variable is an enumeration; a foreign file may give flags to any variable."""
    return bool(variable.flags) and variable.dtype == "uint8"


def _counts(variable: Variable, values: Array) -> dict[str, int]:
    """Return how many lanes have each value of an enumeration, by the meaning of the value."""
    counts = np.bincount(values.ravel(), minlength=len(variable.flags)).tolist()
    return dict(zip(variable.flags, counts, strict=False))


def _spread(values: Array) -> dict[str, Any]:
    sound = values[np.isfinite(values)]
    spread = np.quantile(sound, (0.0, 0.5, 1.0)).tolist() if sound.size else [None] * 3
    return {"values": sound.size, **dict(zip(("least", "median", "greatest"), spread, strict=True))}


def overview_page(
    overview: Mapping[str, Any], settings: Iterable[str], verified: Iterable[str]
) -> str:
    """Write an overview as text; each setting of the configuration and each check is one line."""
    sections = {
        "": _file(overview),
        "Errors": _errors(overview["errors"]),
        "Run": (
            _entry(name.replace("_", " "), value if isinstance(value, str) else _number(value))
            for name, value in overview["metadata"].items()
            if name not in ELSEWHERE and value not in (None, "")
        ),
        "Stages": _stages(overview),
        "Parameters": _groups(overview["parameters"]),
        "Configuration": (_wrapped(line, "  ") for line in settings),
        "Variables": (
            _wrapped(f"{name} ({', '.join(one['dims'])}) {one['dtype']}{_units(one)}", "  ")
            for name, one in overview["variables"].items()
        ),
        "Verified": (_wrapped(line, "  ") for line in verified),
    }
    pages = [
        "\n".join([title, *lines] if title else lines)
        for title, content in sections.items()
        if (lines := list(content))
    ]
    return "\n\n".join(pages)


def slice_lines(facts: Mapping[str, float]) -> list[str]:
    """Return a line for each axis of `slice_facts`."""
    return [
        f"slice {name} = {known.coordinate_text(name, value, 6)}; others with --at {name}=VALUE"
        for name, value in facts.items()
    ]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


def _file(overview: Mapping[str, Any]) -> Iterator[str]:
    metadata = overview["metadata"]
    yield _entry("file", f"{overview['file']} ({overview['bytes']:,} bytes)")
    yield _entry("title", str(metadata.get("title", "")))
    for name, axis in overview["axes"].items():
        values = count_of(axis["values"], "value")
        span = " and ".join(axis["meanings"]) or f"{span_text(axis)}{_units(axis)}"
        yield _entry("axis", f"{name} ({axis['long_name']}), {values}, {span}")
    yield _entry("lanes", f"{overview['lanes']}")
    for name, counts in overview["counts"].items():
        yield _entry(name, ", ".join(f"{n} {flag}" for flag, n in counts.items() if n))
    for note in str(metadata.get("notes", "")).splitlines():
        yield _entry("note", note)


def _errors(errors: Mapping[str, Any]) -> Iterator[str]:
    for name, spread in errors.items():
        if spread["values"]:
            span = f"{spread['median']:.1e} (median) to {spread['greatest']:.1e}{_units(spread)}"
            label, cause = ERRORS[name]
            yield _entry(label, f"{span} in {spread['values']} lanes, {cause}")


def _stages(overview: Mapping[str, Any]) -> Iterator[str]:
    lines = []
    for stage in overview["stages"]:
        bands = max(map(int, stage["bands"]), default=1)
        on_bands = f", on up to {bands} bands" if bands > 1 else ""
        span = f"{stage['start']:.6g} to {stage['end']:.6g}"
        lines.append(f"{stage['label']}: {span}, {count_of(stage['lanes'], 'lane')}{on_bands}")
    half = MOST_STAGES // 2
    if len(lines) > MOST_STAGES:
        more = f"{len(lines)} stages: the first {half} and the last {half}"
        lines = [more, *lines[:half], *lines[-half:]]
    unit = excitation_of(overview["metadata"]).in_words if lines else ""
    head = filter(None, [*slice_lines(overview["slice"]), unit])
    yield from (_wrapped(line, "  ") for line in [*head, *lines])


def _groups(parameters: Mapping[str, Any]) -> Iterator[str]:
    for name, entry in parameters.items():
        value = (
            ", ".join(map(_number, np.ravel(entry["value"])))
            if "value" in entry
            else span_text(entry)
        )
        text = f"{name:26} {value}{_units(entry)} ({entry['origin']})"
        yield _wrapped(text, "  ", " " * 29)


def span_text(spread: Mapping[str, Any]) -> str:
    """Return least and greatest of some values, or the only value."""
    least, greatest = _number(spread["least"]), _number(spread["greatest"])
    return least if least == greatest else f"{least} to {greatest}"


def _units(entry: Mapping[str, Any]) -> str:
    return "" if entry["units"] in ("", "1") else f" {entry['units']}"


def _entry(label: str, text: str) -> str:
    return _wrapped(f"{label:{_LABEL - 1}} {text}", "  ", " " * (_LABEL + 2))


def _wrapped(text: str, first: str, further: str = "    ") -> str:
    indents: Any = {"initial_indent": first, "subsequent_indent": further}
    return textwrap.fill(printable(text), WIDTH, break_on_hyphens=False, **indents)
