"""The result of a sweep: named arrays over its axes, with units, parameters and provenance."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gearchaos.arguments import finite_number, one_of, path_text
from gearchaos.arrays import Array
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.outputs import names as known
from gearchaos.outputs.names import coordinate_text, diagram_axis
from gearchaos.outputs.variable import Variable
from gearchaos.results.files.atomic_file import checksum_fits
from gearchaos.results.files.result_file import own_metadata, write_result
from gearchaos.results.files.result_reader import fixed_coordinates, read_result
from gearchaos.results.reading import tables
from gearchaos.results.reading.physical_units import in_physical_units

__all__ = ["Result", "open_result", "section_variables"]

Method = Literal["nearest", "within"] | None
DEFAULT_VARIABLE = "section_delta_5"


class Result:
    """Named arrays of one sweep, in memory.

    ``axes``: names of the dimensions of the lanes: second swept parameter, first swept parameter,
    realisation, start; those that there are; ``variables``: what there is, in the order of the
    file; ``data`` by name: the values of each variable, of the shape of its dimensions or with all
    axes flattened into the first one; those that carry their own ``values`` may be left out;
    ``parameters``, ``metadata`` by name: dimensionless groups with their origin; title,
    formulation, configuration, provenance; ``fixed_axes`` by name: axes that `sel` has fixed.
    """

    def __init__(
        self,
        axes: Sequence[str],
        variables: Sequence[Variable],
        data: Mapping[str, Any],
        parameters: Mapping[str, Variable],
        metadata: Mapping[str, str | int | float],
        fixed_axes: Mapping[str, Variable] = {},
    ) -> None:
        self.axes = tuple(axes)
        self.parameters = dict(parameters)
        self.metadata = {**metadata, **own_metadata(self.axes)}
        self.fixed_axes = dict(fixed_axes)
        arrays = {v.name: np.asarray(data.get(v.name, v.values), dtype=v.dtype) for v in variables}
        shape = tuple(arrays[axis].size for axis in self.axes)
        self.variables: dict[str, Variable] = {}
        self._data: dict[str, Array] = {}
        for variable in variables:
            name, own, array = variable.name, len(variable.dims) - len(shape), arrays[variable.name]
            of_the_lanes = variable.dims[: len(shape)] == self.axes and name not in self.axes
            if of_the_lanes:
                array = array.reshape((*shape, *array.shape[array.ndim - own :]))
            self._data[name] = array
            self.variables[name] = replace(variable, values=None if of_the_lanes else array)

    @property
    def axis(self) -> str:
        """The axis along which a diagram runs: the first swept parameter."""
        return diagram_axis(self.axes)

    @property
    def fixed(self) -> dict[str, float]:
        """Coordinates of the axes that `sel` has fixed, or of the lane from which this goes on."""
        found = fixed_coordinates(self.metadata)
        return {axis: value for axis, value in found.items() if axis not in self.axes}

    @property
    def where(self) -> str:
        """Where `sel` has fixed axes, in words: ``pitch_error = 5.86, direction = upwards``."""
        fixed = self.fixed.items()
        return ", ".join(f"{axis} = {coordinate_text(axis, value)}" for axis, value in fixed)

    def __contains__(self, name: object) -> bool:
        return name in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def __len__(self) -> int:
        return len(self._data)

    def __getitem__(self, name: str) -> Array:
        """Give the values of a variable, of the shape of its dimensions.

        Raises KeyError if there is no such variable; the message lists those there are.
        """
        return self._data[self._known(name)]

    def dims(self, name: str) -> tuple[str, ...]:
        """Give the names of the dimensions of a variable."""
        return self.variables[self._known(name)].dims

    def attributes(self, name: str) -> dict[str, Any]:
        """Give units, long_name, symbol and, for the status, flag_values and flag_meanings."""
        return self.variables[self._known(name)].attributes

    def lanes(self, name: str) -> Array:
        """Give a variable of the lanes with all axes flattened into the first dimension."""
        values = self[name]
        count = math.prod(values.shape[: len(self.axes)])
        return values.reshape(count, *values.shape[len(self.axes) :])

    def along(self, axis: str) -> Array:
        """Give the value of an axis for every lane in that order, shape (lanes,).

        Raises ConfigurationError if there is no such axis.
        """
        if axis not in self.axes:
            there = ", ".join(self.axes) or "none: leave one in sel"
            raise ConfigurationError(f"{axis}: is no axis of the result; it has {there}")
        grid = np.meshgrid(*(self[name] for name in self.axes), indexing="ij")
        return np.ravel(grid[self.axes.index(axis)])

    def sel(self, method: Method = None, **coordinates: float | str) -> Result:
        """Fix axes at one of their values each; what is left runs over the other axes.

        Coordinates are by the name of their axis, and directions by their own, such as
        ``direction="upwards"``; those that were met are in `fixed`, and their axes in `fixed_axes`.
        With ``"nearest"`` the nearest value is taken, the larger of two, with ``"within"`` as well,
        but nothing further than half a step beyond the outermost; by default a value must be met
        exactly. Raises ConfigurationError if there is no such axis or value; the message names the
        nearest.
        """
        one_of("method", method, (None, "nearest", "within"))
        index: dict[str, int] = {}
        for name, wanted in coordinates.items():
            if name not in self.axes:
                there = ", ".join(self.axes) or "none"
                raise ConfigurationError(f"{name}: is no axis of the result; its axes: {there}")
            values, flags = self[name], self.variables[name].flags
            try:
                wanted = finite_number(name, flags.index(wanted) if wanted in flags else wanted)
            except ConfigurationError:
                rule = " or ".join(["a number", *flags])
                raise ConfigurationError(f"{name} = {wanted}: must be {rule}") from None
            # Far from all of them, every difference would be the same number.
            near = np.clip(wanted, values[0], values[-1])
            number = values.size - 1 - int(np.argmin(np.abs(values - near)[::-1]))
            if method is None and values[number] != wanted:
                raise ConfigurationError(
                    f"{name} = {wanted:g}: is none of the {values.size} values of the result; the "
                    f'nearest is {values[number]!s}: give it, or method="nearest"'
                )
            steps = np.diff(values) if values.size > 1 else [math.inf]
            reach = values[0] - steps[0] / 2.0, values[-1] + steps[-1] / 2.0
            if method == "within" and not reach[0] <= wanted <= reach[1]:
                raise ConfigurationError(
                    f"{name} = {wanted:g}: lies beyond the values of the result, {values[0]:g} to "
                    f"{values[-1]:g}; give one between these"
                )
            index[name] = number
        if not index:
            return self
        met = self.fixed | {name: float(self[name][at]) for name, at in index.items()}
        fixed = " ".join(f"{name}={value!r}" for name, value in met.items())

        def part(values: Any, dims: Sequence[str]) -> Any:
            return values[tuple(index.get(dim, slice(None)) for dim in dims)] if dims else values

        def rest(dims: Sequence[str]) -> tuple[str, ...]:
            return tuple(dim for dim in dims if dim not in index)

        left = [variable for variable in self.variables.values() if variable.name not in index]
        return Result(
            rest(self.axes),
            [replace(variable, dims=rest(variable.dims)) for variable in left],
            {variable.name: part(self[variable.name], variable.dims) for variable in left},
            {
                name: replace(entry, values=part(entry.values, entry.dims), dims=rest(entry.dims))
                for name, entry in self.parameters.items()
            },
            {**self.metadata, "fixed": fixed},
            {**self.fixed_axes, **{name: self.variables[name] for name in index}},
        )

    def physical(self, *names: str) -> Result:
        """Give these variables, by default all, in physical units: um, m/s, N, 1/s.

        Pure numbers stay, and `parameters`, among them what the units are made of. Raises
        ConfigurationError if the configuration gave no physical pair, KeyError if there is no such
        variable.
        """
        wanted = [self._known(name) for name in names or self]
        changed = {
            name: in_physical_units(self.variables[name], self[name], self.parameters)
            for name in wanted
        }
        variables = {**self.variables, **{name: one for name, (one, _) in changed.items()}}
        data = {**self._data, **{name: values for name, (_, values) in changed.items()}}
        facts = self.parameters, self.metadata, self.fixed_axes
        return Result(self.axes, [*variables.values()], data, *facts)

    def save(self, path: str | os.PathLike[str], overwrite: bool = False) -> None:
        """Write the result to an HDF5 file, which appears complete or not at all.

        Raises FileError if the file exists and may not be overwritten, cannot be written, or if no
        axis is left.
        """
        path = path_text(path, "the file to be written")
        if not self.axes:
            raise FileError(f"{path}: a single lane is no result file; leave one axis in sel")
        variables = list(self.variables.values())
        arrays = {v.name: self.lanes(v.name) for v in variables if v.values is None}
        blocks = [(0, math.prod(self[axis].size for axis in self.axes), arrays)]
        write_result(path, variables, blocks, self.parameters, self.metadata, overwrite=overwrite)

    to_xarray, to_dataframe = tables.to_xarray, tables.to_dataframe

    def _repr_html_(self) -> str:
        head, *_ = repr(self).splitlines()
        rows = ((v.name, ", ".join(v.dims), v.units, v.long_name) for v in self.variables.values())
        cells = ("".join(f"<td>{escape(text)}</td>" for text in row) for row in rows)
        return f"{escape(head)}<table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"

    def __repr__(self) -> str:
        sizes = " x ".join(f"{self[axis].size} {axis}" for axis in self.axes) or "one lane"
        lines = [f"<Result {self.metadata.get('title', '')!r}, {sizes}>"]
        for name, variable in self.variables.items():
            lines.append(f"  {name} ({', '.join(variable.dims)}): {variable.long_name}")
        return "\n".join(lines)

    def _known(self, name: str) -> str:
        if name not in self._data:
            raise KeyError(f"no variable {name!r} in this result; there are {', '.join(self)}")
        return name


def section_variables(result: Result) -> tuple[str, ...]:
    """Return the section variables of a result, `section_delta_5` first where there is one."""
    dims = (*result.axes, known.SECTION_POINT)
    names = [
        name for name in result if name.startswith(known.SECTION) and result.dims(name) == dims
    ]
    return tuple(sorted(names, key=lambda name: name != DEFAULT_VARIABLE))


def open_result(path: str | os.PathLike[str], *, rows: bool = True) -> Result:
    """Read a result file into memory; without ``rows`` only variables over axes alone, in a moment.

    Raises FileError if the file is missing, damaged, of another kind or another major version.
    """
    path = path_text(path, "a result file")
    variables, data, parameters, metadata = read_result(path, rows=rows)
    there = [variable for variable in variables if variable.name in data]
    return Result(str(metadata["axes"]).split(), there, data, parameters, metadata)


def completed(path: str | os.PathLike[str]) -> Result | None:
    """Open a result without its rows; None if there is none, or it is not as it was written."""
    with suppress(OSError, ValueError, FileError):
        # Whoever opened a pipe would wait for its writer.
        if os.path.isfile(path) and checksum_fits(Path(path)):
            return open_result(path, rows=False)
    return None
