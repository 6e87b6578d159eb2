"""The result of a sweep: named arrays with their units, parameters and provenance."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.results.result_file import OWN_METADATA, Parameter, write_result
from gearchaos.results.result_reader import read_result
from gearchaos.results.variables import Variable, axis_name

__all__ = ["Parameter", "Result", "open_result", "section_variables"]

SECTION = "section_"
DEFAULT_VARIABLE = "section_delta_5"


class Result:
    """Named arrays of one sweep, in memory.

    Parameters
    ----------
    axis : str
        Name of the swept parameter, bare or as a dotted path; `axis_name` of it is that of the
        first dimension.
    variables : sequence of Variable
        What there is, in the order of the file.
    data : mapping of str to ndarray
        The values of each variable; those that carry their own ``values`` may be left out.
    parameters : mapping of str to Parameter
        Dimensionless groups of the model, with their origin.
    metadata : mapping of str to str, int or float
        Title, formulation, effects, configuration, provenance.

    Raises
    ------
    ValueError
        If an array is missing, its shape contradicts the dimensions, or there are no lanes.
    """

    def __init__(
        self,
        axis: str,
        variables: Sequence[Variable],
        data: Mapping[str, Any],
        parameters: Mapping[str, Parameter],
        metadata: Mapping[str, str | int | float],
    ) -> None:
        self.axis = axis_name(axis)
        self.variables = {variable.name: variable for variable in variables}
        self.parameters = dict(parameters)
        self.metadata = {**metadata, **OWN_METADATA, "axis": self.axis}
        self.fixed: dict[str, float] = {}
        self._data: dict[str, NDArray[Any]] = {}
        sizes: dict[str, int] = {}
        for name, variable in self.variables.items():
            values = data.get(name, variable.values)
            if values is None:
                raise ValueError(f"no values for the variable {name}")
            array = np.asarray(values, dtype=variable.dtype)
            if array.ndim != len(variable.dims) or any(
                sizes.setdefault(dim, size) != size
                for dim, size in zip(variable.dims, array.shape, strict=True)
            ):
                raise ValueError(f"{name} has shape {array.shape}, but dimensions {variable.dims}")
            self._data[name] = array
        if not sizes.get(self.axis):
            raise ValueError(f"no lanes along {self.axis}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables, in the order of the file."""
        return tuple(self._data)

    def __contains__(self, name: object) -> bool:
        return name in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def __len__(self) -> int:
        return len(self._data)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Give the values of a variable.

        Raises
        ------
        KeyError
            If there is no such variable; the message lists those there are.
        """
        return self._data[self._known(name)]

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes (stand-in)."""
        return (self.axis, "start") if "start" in self else (self.axis,)

    def lanes(self, name: str) -> NDArray[Any]:
        """Give a variable with all axes flattened into the first dimension (stand-in)."""
        return self[name]

    def along(self, axis: str) -> NDArray[Any]:
        """Give the value of an axis for every lane (stand-in)."""
        return self[axis]

    def sel(self, method: str | None = None, **coordinates: float) -> Result:
        """Fix the start (stand-in)."""
        del method
        mine = self["start"] == coordinates["start"]
        data = {
            name: self[name][mine] if self.axis in self.dims(name) else self[name] for name in self
        }
        variables = [variable for name, variable in self.variables.items() if name != "start"]
        part = Result(self.axis, variables, data, self.parameters, self.metadata)
        part.fixed = dict(coordinates)
        return part

    def dims(self, name: str) -> tuple[str, ...]:
        """Give the names of the dimensions of a variable."""
        return self.variables[self._known(name)].dims

    def attributes(self, name: str) -> dict[str, Any]:
        """Give units, long_name, symbol and, for the status, flag_values and flag_meanings."""
        return self.variables[self._known(name)].attributes

    def save(self, path: str | os.PathLike[str], overwrite: bool = False) -> None:
        """Write the result to an HDF5 file, which appears complete or not at all.

        Raises
        ------
        FileError
            If the file exists and may not be overwritten, or cannot be written.
        """
        variables = [
            variable
            if self.axis in variable.dims
            else replace(variable, values=tuple(self[variable.name].tolist()))
            for variable in self.variables.values()
        ]
        lanes = self[self.axis].size
        write_result(
            path,
            variables,
            [(0, lanes, self._data)],
            self.parameters,
            self.metadata,
            lanes=lanes,
            overwrite=overwrite,
        )

    def __repr__(self) -> str:
        lines = [f"<Result {self.metadata.get('title', '')!r}, {self[self.axis].size} lanes>"]
        for name, variable in self.variables.items():
            lines.append(f"  {name} ({', '.join(variable.dims)}): {variable.long_name}")
        return "\n".join(lines)

    def _known(self, name: str) -> str:
        if name not in self._data:
            raise KeyError(f"no variable {name!r} in this result; there are {', '.join(self)}")
        return name


def section_variables(result: Result) -> tuple[str, ...]:
    """Return the section variables of a result, `section_delta_5` first where there is one."""
    names = [
        name for name in result.names if name.startswith(SECTION) and len(result.dims(name)) == 2
    ]
    return tuple(sorted(names, key=lambda name: name != DEFAULT_VARIABLE))


def open_result(path: str | os.PathLike[str]) -> Result:
    """Read a result file into memory.

    Raises
    ------
    FileError
        If the file is missing, damaged, of another kind or of a newer major format version.
    """
    variables, data, parameters, metadata = read_result(path)
    return Result(str(metadata["axis"]), variables, data, parameters, metadata)
