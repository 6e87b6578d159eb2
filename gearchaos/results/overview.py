"""What a result file says about itself, as plain numbers, texts, lists and tables of them."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.results.result import Result
from gearchaos.results.result_file import Parameter
from gearchaos.results.result_reader import read_result
from gearchaos.results.stage_table import labelled_lanes, one_axis, slice_facts, stage_table
from gearchaos.results.variables import (
    HARMONIC,
    LABELS,
    LARGEST_EXPONENT,
    STANDARD_ERROR,
    START,
    STEP_ERROR,
    Variable,
)

ERRORS = ("section_error", STEP_ERROR, LARGEST_EXPONENT + STANDARD_ERROR)
_CANDIDATE = "candidate_"


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
            for axis in result.axes
        },
        "metadata": metadata,
        "parameters": {name: _parameter(entry) for name, entry in parameters.items()},
        "counts": {},
        "errors": {},
        "step_choice": {},
        "variables": {},
    }
    # What bears a known name may be something else in a file that others have changed.
    for v in read:
        of_the_lanes = v.dims == result.axes and v.name not in result.axes
        if of_the_lanes and v.flags and v.dtype == "uint8":
            summary["counts"][v.name] = _counts(v, data[v.name])
        elif of_the_lanes and v.name in ERRORS and v.dtype == "float64":
            values = data[v.name]
            if v.name.endswith(STANDARD_ERROR):
                # The exponents of orbits have none.
                values = values[values > 0.0]
            summary["errors"][v.name] = _spread(values)
        elif v.dims == (f"{_CANDIDATE}steps",) and v.dtype in ("float64", "int32"):
            summary["step_choice"][v.name.removeprefix(_CANDIDATE)] = data[v.name].tolist()
    for v in variables:
        shape = {"dims": list(v.dims), "shape": [sizes.get(dim) for dim in v.dims]}
        summary["variables"][v.name] = {**shape, "dtype": v.dtype, **_wording(v)}
    summary["slice"], summary["stages"] = _stages(result)
    return dict(finite(summary))


def _stages(result: Result) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    if result.axis == START or not all(name in result for name in LABELS):
        return {}, []
    part = one_axis(result)
    stages = stage_table(labelled_lanes(part))
    return slice_facts(result, part), [stage._asdict() for stage in stages]


def _range(values: NDArray[Any]) -> dict[str, float]:
    return {"least": float(values.min()), "greatest": float(values.max())}


def _parameter(parameter: Parameter) -> dict[str, Any]:
    value = np.asarray(parameter.value)
    # What differs from lane to lane may be a million numbers.
    along_axes = parameter.dims not in ((), (HARMONIC,))
    content = _range(value) if along_axes else {"value": value.tolist()}
    return {"origin": parameter.origin, **content, **_wording(parameter)}


def _wording(entry: Variable | Parameter) -> dict[str, str]:
    return {"units": entry.units, "long_name": entry.long_name}


def _counts(variable: Variable, values: NDArray[Any]) -> dict[str, int]:
    numbers = np.bincount(values.ravel(), minlength=len(variable.flags))
    return {flag: int(number) for flag, number in zip(variable.flags, numbers, strict=False)}


def _spread(values: NDArray[Any]) -> dict[str, Any]:
    known = values[np.isfinite(values)]
    if known.size == 0:
        return {"lanes": 0, "median": None, "greatest": None}
    return {"lanes": known.size, "median": float(np.median(known)), "greatest": float(known.max())}


def finite(value: Any) -> Any:
    """Replace what is not finite in nested tables and lists by None."""
    return json.loads(json.dumps(value), parse_constant=lambda _: None)
