"""What a result file says about itself: plain numbers, texts, lists, and a page for a terminal."""

import math
import os
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.arrays import Array
from gearchaos.results import variables as known
from gearchaos.results.result import Result
from gearchaos.results.result_file import Parameter
from gearchaos.results.result_reader import printable, read_result
from gearchaos.results.scales import excitation_of
from gearchaos.results.stage_table import labelled_lanes, one_axis, slice_facts, stage_table

ERRORS = {
    "section_error": ("section error", "when the step is halved"),
    known.STEP_ERROR: ("exponent error", "when the step is halved"),
    known.LARGEST_EXPONENT + known.STANDARD_ERROR: (
        "exponent error",
        "one standard error of the finite record; orbits of periodic lanes have none",
    ),
}
"""Variables that are errors, with what they are of, and from what they come."""

_CANDIDATE = "candidate_"
_SETTINGS = "title effects formulation start carry fixed"
_INTEGRATION = (
    "method steps_per_period crossings tolerance unstable transient_periods recorded_periods"
)
_RUN = "wall_time_seconds threads processor system software kernels git_commit created"
"""Names of metadata that are shown together."""

MOST_STAGES = 20  # Of more stages, the first and the last ones are shown.

WIDTH = 80
_LABEL = 18


def overview(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Sum up a result file without reading more than one number of each lane and variable.

    Axes, parameters, counts and variables are by name; ``errors`` are the measured ones, ``stages``
    those of the first slice along the swept parameter. What is not finite is None.

    Raises FileError if the file is missing, damaged, of another kind or another major version.
    """
    variables, data, parameters, metadata = read_result(path, rows=False)
    read = [variable for variable in variables if variable.name in data]
    result = Result(str(metadata["axes"]).split(), read, data, parameters, metadata)
    sizes = {dim: size for v in read for dim, size in zip(v.dims, data[v.name].shape, strict=True)}
    summary: dict[str, Any] = {
        "file": os.fspath(path),
        "bytes": Path(path).stat().st_size,
        "lanes": math.prod(sizes[axis] for axis in result.axes),
        "axes": {
            axis: {"values": sizes[axis], **_range(data[axis]), **_wording(result.variables[axis])}
            | ({"meanings": flags} if (flags := result.variables[axis].flags) else {})
            for axis in result.axes
        },
        "metadata": metadata,
        "parameters": {name: _parameter(entry) for name, entry in parameters.items()},
        **{facts: {} for facts in ("counts", "errors", "step_choice", "variables")},
    }
    # What bears a known name may be something else in a file that others have changed.
    for v in read:
        values, of_the_lanes = data[v.name], v.dims == result.axes and v.name not in result.axes
        if of_the_lanes and v.flags and v.dtype == "uint8":
            numbers = np.bincount(values.ravel(), minlength=len(v.flags)).tolist()
            summary["counts"][v.name] = dict(zip(v.flags, numbers, strict=False))
        elif of_the_lanes and v.name in ERRORS and v.dtype == "float64":
            # The exponents of orbits have no standard error.
            counted = values > 0.0 if v.name.endswith(known.STANDARD_ERROR) else ...
            summary["errors"][v.name] = _spread(values[counted])
        elif v.dims == (f"{_CANDIDATE}steps",) and v.dtype in ("float64", "int32"):
            summary["step_choice"][v.name.removeprefix(_CANDIDATE)] = values.tolist()
    for v in variables:
        shape = {"dims": v.dims, "shape": [sizes.get(dim) for dim in v.dims]}
        summary["variables"][v.name] = {**shape, "dtype": v.dtype, **_wording(v)}
    summary |= {"slice": {}, "stages": []}
    if result.axis not in known.UNSWEPT and all(name in result for name in known.LABELS):
        part = one_axis(result)
        stages = stage_table(labelled_lanes(part))
        summary |= {"slice": slice_facts(result, part), "stages": stages}
    return dict(plain(summary))


def plain(value: Any) -> Any:
    """Make of records and complex numbers what JSON has; what is not finite is None."""
    value = value._asdict() if hasattr(value, "_asdict") else value
    if isinstance(value, Mapping):
        return {name: plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [*map(plain, value)]
    if isinstance(value, complex):
        return plain([value.real, value.imag])
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _range(values: Array) -> dict[str, float]:
    return {"least": float(values.min()), "greatest": float(values.max())}


def _parameter(parameter: Parameter) -> dict[str, Any]:
    value = np.asarray(parameter.value)
    # What differs from lane to lane may be a million numbers.
    along_axes = parameter.dims not in ((), (known.HARMONIC,))
    content = _range(value) if along_axes else {"value": value.tolist()}
    return {"origin": parameter.origin, **content, **_wording(parameter)}


def _wording(entry: known.Variable | Parameter) -> dict[str, str]:
    return {"units": entry.units, "long_name": entry.long_name}


def _spread(values: Array) -> dict[str, Any]:
    sound = values[np.isfinite(values)]
    if sound.size == 0:
        return {"lanes": 0, "median": None, "greatest": None}
    return {"lanes": sound.size, "median": float(np.median(sound)), "greatest": float(sound.max())}


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


def slice_lines(facts: dict[str, dict[str, float]]) -> list[str]:
    """Word what `slice_facts` tells, one line per axis."""
    return [
        f"slice {name} = {known.coordinate_text(name, at['value'], 6)}, "
        f"{'the first' if at['number'] == 1 else 'number {number}'.format(**at)} of {at['of']}; "
        f"others with --at {name}=VALUE"
        for name, at in facts.items()
    ]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


def _file(overview: Mapping[str, Any]) -> Iterator[str]:
    metadata = overview["metadata"]
    size = f"{overview['bytes']:,} bytes, {metadata['schema']} {metadata['schema_version']}"
    yield _entry("file", f"{overview['file']} ({size})")
    yield from _metadata(overview, _SETTINGS)
    for name, axis in overview["axes"].items():
        values = "1 value" if axis["values"] == 1 else f"{axis['values']} values"
        span = f"{_number(axis['least'])} to {_number(axis['greatest'])}{_units(axis)}"
        span = " and ".join(axis.get("meanings", [span]))
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
            label, cause = ERRORS[name]
            yield _entry(label, f"{span} in {spread['lanes']} lanes, {cause}")
    choice = dict(overview["step_choice"])
    for row, steps in enumerate(choice.pop("steps", [])):
        measured = ", ".join(f"{name} {_number(values[row])}" for name, values in choice.items())
        yield _entry("step choice", f"{steps} steps: {measured}")


def _stages(overview: Mapping[str, Any]) -> Iterator[str]:
    lines = []
    for stage in overview["stages"]:
        several = "s" if stage["lanes"] != 1 else ""
        bands = max(map(int, stage["bands"]), default=1)
        on_bands = f", on up to {bands} bands" if bands > 1 else ""
        span = f"{stage['start']:.6g} to {stage['end']:.6g}"
        lines.append(f"{stage['label']}: {span}, {stage['lanes']} lane{several}{on_bands}")
    half = MOST_STAGES // 2
    if len(lines) > MOST_STAGES:
        more = f"{len(lines)} stages: the first {half} and the last {half}"
        lines = [more, *lines[:half], *lines[-half:]]
    unit = excitation_of(overview["metadata"]).in_words if lines else ""
    head = filter(None, [*slice_lines(overview["slice"]), unit])
    yield from (_wrapped(line, "  ") for line in [*head, *lines])


def _metadata(overview: Mapping[str, Any], names: str) -> Iterator[str]:
    for name in names.split():
        value = overview["metadata"].get(name)
        if value not in (None, ""):
            text = value if isinstance(value, str) else _number(value)
            yield _entry(name.replace("_", " "), text)


def _groups(parameters: Mapping[str, Any]) -> Iterator[str]:
    for name, entry in parameters.items():
        text = ", ".join(map(_number, np.ravel(entry.get("value", []))))
        if "least" in entry:
            text = f"{_number(entry['least'])} to {_number(entry['greatest'])}"
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
    return _wrapped(f"{label:{_LABEL - 1}} {text}", "  ", " " * (_LABEL + 2))


def _wrapped(text: str, first: str, further: str = "    ") -> str:
    indents: Any = {"initial_indent": first, "subsequent_indent": further}
    return textwrap.fill(printable(text), WIDTH, break_on_hyphens=False, **indents)
