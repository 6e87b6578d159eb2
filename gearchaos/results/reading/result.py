"""The result of a sweep: named arrays over its axes, with units, parameters and provenance."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.arguments import one_of, path_text
from gearchaos.arrays import Array
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.models.gear_pair.outputs import DEFAULT_VARIABLE
from gearchaos.outputs.names import (
    CONVERTED,
    MESH_PERIOD,
    SECTION,
    SECTION_POINT,
    TIME,
    coordinate_text,
    diagram_axis,
)
from gearchaos.outputs.variable import Variable
from gearchaos.results.files.atomic_file import checksum_fits
from gearchaos.results.files.result_file import own_metadata, write_result
from gearchaos.results.files.result_reader import fixed_coordinates, read_result
from gearchaos.results.reading import tables
from gearchaos.results.reading.physical_units import in_physical_units, in_seconds
from gearchaos.results.reading.selection import (
    Matching,
    number_on,
    parameters_at,
    part_of,
    remaining,
)

__all__ = ["Result", "open_result", "section_variables"]


class Result:
    """Named arrays of one sweep, in memory.

    A result is a mapping: ``result["status"]`` is an array, and iteration gives the names.

    Attributes
    ----------
    axes : tuple of str
        Names of the dimensions of the lanes in the order second swept parameter, first swept
        parameter, realisation, start, direction. Only those that the sweep has.
    variables : dict of str to Variable
        Description of each array, in the order of the file.
    parameters : dict of str to Variable
        Dimensionless groups with their origin, and the scales that make the model dimensionless.
    metadata : dict of str to str, int or float
        Title, formulation, configuration and provenance: the root attributes of a file.
    fixed_axes : dict of str to Variable
        Axes that `sel` has fixed.

    Examples
    --------
    >>> result = gearchaos.open_result("pan2021.h5")
    >>> result["lyapunov_exponent"].shape == result["pitch_error"].shape
    True
    >>> lane = result.sel(pitch_error=12.47, method="nearest")
    >>> lane.axes
    ()
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
        """Make a result of arrays in memory.

        Parameters
        ----------
        axes, variables, parameters, metadata, fixed_axes
            As the attributes; ``variables`` is a sequence in the order of the file.
        data : mapping of str to array
            Values of each variable by its name, of the shape of its dimensions, or with all axes
            flattened into the first one. Variables that carry their own values may be left out.
        """
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
        """Name of the axis along which a diagram runs: the first swept parameter."""
        return diagram_axis(self.axes)

    @property
    def fixed(self) -> dict[str, float]:
        """Values of the axes that `sel` has fixed, or of the lane that a response continues."""
        found = fixed_coordinates(self.metadata)
        return {axis: value for axis, value in found.items() if axis not in self.axes}

    @property
    def where(self) -> str:
        """The fixed values in words: ``pitch_error = 5.86, direction = upwards``."""
        fixed = self.fixed.items()
        return ", ".join(f"{axis} = {coordinate_text(axis, value)}" for axis, value in fixed)

    def __contains__(self, name: object) -> bool:
        return name in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def __len__(self) -> int:
        return len(self._data)

    def __getitem__(self, name: str) -> Array:
        """Return the values of a variable, of the shape of its dimensions.

        Raises
        ------
        KeyError
            If there is no such variable; the message lists those that exist.
        """
        return self._data[self._known(name)]

    def dims(self, name: str) -> tuple[str, ...]:
        """Return the names of the dimensions of a variable.

        Parameters
        ----------
        name : str
            Name of the variable.

        Returns
        -------
        tuple of str
            Names of the dimensions, in the order of the array.

        Raises
        ------
        KeyError
            If there is no such variable.

        Examples
        --------
        >>> result.dims("section_delta_5")
        ('pitch_error', 'section_point')
        """
        return self.variables[self._known(name)].dims

    def attributes(self, name: str) -> dict[str, Any]:
        """Return units, long_name, symbol and flags of a variable.

        Parameters
        ----------
        name : str
            Name of the variable.

        Returns
        -------
        dict of str to str or list
            The attributes, as in the file.

        Raises
        ------
        KeyError
            If there is no such variable.

        Examples
        --------
        >>> result.attributes("lyapunov_exponent")["units"]
        '1'
        """
        return self.variables[self._known(name)].attributes

    def lanes(self, name: str) -> Array:
        """Return a variable of the lanes with all axes flattened into the first dimension.

        Parameters
        ----------
        name : str
            Name of the variable.

        Returns
        -------
        array, shape (lanes, ...)
            The values in the order of the lanes.

        Raises
        ------
        KeyError
            If there is no such variable.

        Examples
        --------
        >>> result.lanes("status").ndim
        1
        """
        values = self[name]
        count = math.prod(values.shape[: len(self.axes)])
        return values.reshape(count, *values.shape[len(self.axes) :])

    def along(self, axis: str) -> Array:
        """Return the value of an axis for every lane in the order of `lanes`.

        Parameters
        ----------
        axis : str
            Name of the axis.

        Returns
        -------
        array, shape (lanes,)
            Values in the unit of the axis.

        Raises
        ------
        ConfigurationError
            If the result has no such axis.

        Examples
        --------
        >>> bool((result.along("pitch_error") == result["pitch_error"]).all())
        True
        """
        if axis not in self.axes:
            there = ", ".join(self.axes) or "none: leave one in sel"
            raise ConfigurationError(f"{axis}: is no axis of the result; it has {there}")
        grid = np.meshgrid(*(self[name] for name in self.axes), indexing="ij")
        return np.ravel(grid[self.axes.index(axis)])

    def sel(self, method: Matching = None, **coordinates: float | str) -> Result:
        """Fix axes at one of their values each.

        Parameters
        ----------
        method : {None, "nearest", "within"}
            None: the value must be one of the axis. ``"nearest"``: the nearest one is taken, the
            larger of two. ``"within"``: the same, but not for values more than half a step beyond
            the ends of the axis.
        **coordinates : float or str
            Values by the name of the axis. A direction is given by its name, such as
            ``direction="upwards"``.

        Returns
        -------
        Result
            The lanes over the remaining axes. Its `fixed` holds the values that were taken, its
            `fixed_axes` their axes.

        Raises
        ------
        ConfigurationError
            If there is no such axis or value; the message names the nearest one.

        Examples
        --------
        >>> result.sel(pitch_error=12.47, method="nearest").fixed
        {'pitch_error': 12.5}
        """
        one_of("method", method, (None, "nearest", "within"))
        at: dict[str, int] = {}
        for name, wanted in coordinates.items():
            if name not in self.axes:
                there = ", ".join(self.axes) or "none"
                raise ConfigurationError(f"{name}: is no axis of the result; its axes: {there}")
            at[name] = number_on(self.variables[name], wanted, method)
        if not at:
            return self
        fixed = self.fixed | {name: float(self[name][number]) for name, number in at.items()}
        text = " ".join(f"{name}={value!r}" for name, value in fixed.items())
        left = [variable for variable in self.variables.values() if variable.name not in at]
        return Result(
            remaining(self.axes, at),
            [replace(variable, dims=remaining(variable.dims, at)) for variable in left],
            {one.name: part_of(self[one.name], one.dims, at) for one in left},
            parameters_at(self.parameters, at),
            {**self.metadata, "fixed": text},
            {**self.fixed_axes, **{name: self.variables[name] for name in at}},
        )

    def physical(self, *names: str) -> Result:
        """Convert variables to physical units: um, m/s, m/s^2, N, s, 1/s and Hz.

        Pure numbers and `parameters` stay as they are. The time of a response is in seconds if all
        lanes have the same mesh period, else in mesh periods: multiply it by ``mesh_period``.

        Parameters
        ----------
        *names : str
            Names of the variables; by default all.

        Returns
        -------
        Result
            A result with the converted variables.

        Raises
        ------
        ConfigurationError
            If the configuration of the result describes no physical pair, or if a scale varies
            along an axis that a variable lacks.
        KeyError
            If there is no such variable.

        Examples
        --------
        >>> result = gearchaos.open_result("speeds.h5")
        >>> result.physical("section_delta_5").attributes("section_delta_5")["units"]
        'um'
        """
        wanted = [self._known(name) for name in names or self]
        changed = {
            name: in_physical_units(self.variables[name], self[name], self.parameters)
            for name in wanted
        }
        if TIME in changed and MESH_PERIOD in changed:
            changed[TIME] = in_seconds(changed[TIME], changed[MESH_PERIOD])
        variables = {**self.variables, **{name: one for name, (one, _) in changed.items()}}
        data = {**self._data, **{name: values for name, (_, values) in changed.items()}}
        metadata = self.metadata
        if axes := [n for n in self.axes if variables[n].units != self.variables[n].units]:
            # Lanes cannot be computed again from them.
            metadata = {**metadata, CONVERTED: " ".join(axes)}
        facts = self.parameters, metadata, self.fixed_axes
        return Result(self.axes, [*variables.values()], data, *facts)

    def save(self, path: str | os.PathLike[str], overwrite: bool = False) -> None:
        """Write the result to an HDF5 file, which appears complete or not at all.

        Parameters
        ----------
        path : path-like
            Name of the file.
        overwrite : bool
            Whether an existing file is replaced.

        Raises
        ------
        FileError
            If the file exists and is not to be replaced, if it cannot be written, or if the result
            has no axis left.

        Examples
        --------
        >>> result.save("copy.h5", overwrite=True)
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
    """Return the names of the sections of a result, `DEFAULT_VARIABLE` first if it is there."""
    dims = (*result.axes, SECTION_POINT)
    names = [name for name in result if name.startswith(SECTION) and result.dims(name) == dims]
    return tuple(sorted(names, key=lambda name: name != DEFAULT_VARIABLE))


def open_result(path: str | os.PathLike[str], *, rows: bool = True) -> Result:
    """Read a result file into memory.

    Parameters
    ----------
    path : path-like
        Name of the file.
    rows : bool
        False: read only variables over the axes alone, which is fast for a file of any size.

    Returns
    -------
    Result
        The variables with their values and metadata.

    Raises
    ------
    FileError
        If the file is missing or damaged, if it is no result, or if its format has another major
        version.

    Examples
    --------
    >>> result = gearchaos.open_result("pan2021.h5")
    >>> result.axes
    ('pitch_error',)
    """
    path = path_text(path, "a result file")
    variables, data, parameters, metadata = read_result(path, rows=rows)
    there = [variable for variable in variables if variable.name in data]
    return Result(str(metadata["axes"]).split(), there, data, parameters, metadata)


def completed(path: str | os.PathLike[str]) -> Result | None:
    """Open a finished result without its rows; None if there is no file or it was changed."""
    with suppress(OSError, ValueError, FileError):
        # isfile first: opening a pipe would wait for a writer.
        if os.path.isfile(path) and checksum_fits(Path(path)):
            return open_result(path, rows=False)
    return None
