"""What a result file says about itself, as plain numbers, texts, lists and tables of them."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.results.result_file import Parameter
from gearchaos.results.result_reader import read_result
from gearchaos.results.variables import Variable

ERRORS = ("section_error", "exponent_error")
_CANDIDATE = "candidate_"


def overview(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Sum up a result file without reading its arrays of several dimensions.

    Returns
    -------
    dict
        ``file``, ``bytes``, ``lanes``, ``swept`` (name, unit, range), ``metadata`` (root
        attributes and texts), ``parameters`` by name, ``counts`` (lanes by each enumeration),
        ``errors`` (measured ones: lanes, median, largest), ``step_choice`` (what was measured for
        each candidate) and ``variables`` by name. What is not finite is None.

    Raises
    ------
    FileError
        If the file is missing, damaged, of another kind or of a newer major format version.
    """
    variables, data, parameters, metadata = read_result(path, rows=False)
    axis = str(metadata["axis"])
    sizes = {
        dim: size
        for variable in variables
        if variable.name in data
        for dim, size in zip(variable.dims, data[variable.name].shape, strict=True)
    }
    swept = next(variable for variable in variables if variable.name == axis)
    summary = {
        "file": os.fspath(path),
        "bytes": Path(path).stat().st_size,
        "lanes": sizes[axis],
        "swept": {
            "name": axis,
            "values": np.unique(data[axis]).size,
            **_range(data[axis]),
            "units": swept.units,
            "long_name": swept.long_name,
        },
        "metadata": metadata,
        "parameters": {name: _parameter(entry) for name, entry in parameters.items()},
        "counts": {
            variable.name: _counts(variable, data[variable.name])
            for variable in variables
            if variable.flags and variable.dims == (axis,) and variable.dtype == "uint8"
        },
        "errors": {
            variable.name: _spread(data[variable.name])
            for variable in variables
            if variable.name in ERRORS and (variable.dims, variable.dtype) == ((axis,), "float64")
        },
        "step_choice": {
            variable.name.removeprefix(_CANDIDATE): data[variable.name].tolist()
            for variable in variables
            if variable.dims == (f"{_CANDIDATE}steps",) and variable.dtype in ("float64", "int32")
        },
        "variables": {
            variable.name: {
                "dims": list(variable.dims),
                "shape": [sizes.get(dim) for dim in variable.dims],
                "dtype": variable.dtype,
                "units": variable.units,
                "long_name": variable.long_name,
            }
            for variable in variables
        },
    }
    known: dict[str, Any] = finite(summary)
    return known


def _range(values: NDArray[Any]) -> dict[str, float]:
    return {"least": float(values.min()), "greatest": float(values.max())}


def _parameter(parameter: Parameter) -> dict[str, Any]:
    value = np.asarray(parameter.value)
    # What differs from lane to lane may be a million numbers.
    content = _range(value) if parameter.origin == "swept" else {"value": value.tolist()}
    wording = {"units": parameter.units, "long_name": parameter.long_name}
    return {"origin": parameter.origin, **content, **wording}


def _counts(variable: Variable, values: NDArray[Any]) -> dict[str, int]:
    numbers = np.bincount(values, minlength=len(variable.flags))
    return {flag: int(number) for flag, number in zip(variable.flags, numbers, strict=False)}


def _spread(values: NDArray[Any]) -> dict[str, Any]:
    known = values[np.isfinite(values)]
    if known.size == 0:
        return {"lanes": 0, "median": None, "greatest": None}
    return {
        "lanes": known.size,
        "median": float(np.median(known)),
        "greatest": float(known.max()),
    }


def finite(value: Any) -> Any:
    """Replace what is not finite in nested tables and lists by None."""
    if isinstance(value, Mapping):
        return {key: finite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
