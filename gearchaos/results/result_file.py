"""The file of a result, one HDF5 file that is also netCDF-4: its rules, and how it is written."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import h5py
import numpy as np
from numpy.typing import NDArray

from gearchaos.interrupts import check
from gearchaos.results.atomic_file import replacing
from gearchaos.results.checksum_line import append_checksum
from gearchaos.results.sink import Sink
from gearchaos.results.variables import HARMONIC, Variable

SCHEMA = "gearchaos-sweep"
SCHEMA_VERSION = "1.0"
OWN_METADATA = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION}
PARAMETERS = "parameters"
ORIGINS = ("given", "derived", "default", "swept")
TEXTS = {
    "configuration": "configuration as it was written, in TOML",
    "configuration_resolved": "configuration with everything filled in, in TOML",
}
"""Metadata that are datasets with these long names: an attribute cannot exceed 64 kB."""

Block: TypeAlias = tuple[int, int, Mapping[str, NDArray[Any]]]
Metadata: TypeAlias = Mapping[str, str | int | float]

_CHUNK_BYTES = 1 << 19
_LONGEST_ATTRIBUTE = 32_000
_CACHE_BYTES = 4 << 20
_STRING = h5py.string_dtype("utf-8")


@dataclass(frozen=True, eq=False)
class Parameter:
    """One dimensionless group of the model.

    Parameters
    ----------
    value : float or ndarray
        A number, a row over the harmonics of the mesh stiffness or, for what differs from lane
        to lane, a row over the lanes.
    origin : str
        ``"given"``, ``"derived"``, ``"default"`` or ``"swept"`` (differs from lane to lane).
    units, long_name, symbol : str
        Unit, wording and mathtext symbol.
    """

    value: float | NDArray[np.float64]
    origin: str
    units: str = "1"
    long_name: str = ""
    symbol: str = ""


def write_result(
    path: str | os.PathLike[str],
    variables: Sequence[Variable],
    blocks: Iterable[Block],
    parameters: Mapping[str, Parameter],
    metadata: Metadata,
    *,
    lanes: int,
    overwrite: bool = False,
    scratch: str | os.PathLike[str] | None = None,
) -> None:
    """Write a result block by block; the file appears complete or not at all.

    Parameters
    ----------
    path : path
        The file to be.
    variables : sequence of Variable
        What the file holds, in this order. Those that do not run over the lanes carry their
        values.
    blocks : iterable of (first, last, arrays)
        The lanes first to last - 1 of every other variable, by name.
    parameters : mapping of str to Parameter
        Dimensionless groups of the model.
    metadata : mapping of str to str, int or float
        Root attributes; ``"axis"`` among them names the dimension of the lanes.
    lanes : int
        Lanes in all blocks together.
    overwrite : bool
        Whether an existing file is replaced.
    scratch : path, optional
        Folder for the temporary file, on the same file system; by default that of the file.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    axis = str(metadata["axis"])
    everything = [*variables, *_harmonics(axis, parameters)]
    sizes = {v.name: len(v.values) for v in everything if v.values is not None} | {axis: lanes}
    with replacing(path, overwrite=overwrite, scratch=scratch) as partial:
        with (
            Sink(partial) as sink,
            h5py.File(sink, "w", track_order=True, rdcc_nbytes=_CACHE_BYTES) as file,
        ):
            _write_metadata(file, {**metadata, **OWN_METADATA})
            for variable in everything:
                _create(file, variable, tuple(sizes[dim] for dim in variable.dims))
            for variable in everything:
                _attach_scales(file, variable.name, variable.dims)
            _write_parameters(file, axis, parameters)
            # Kept open: HDF5 packs a chunk anew each time its dataset is closed.
            over_lanes = {v.name: file[v.name] for v in everything if v.dims[0] == axis}
            for first, last, arrays in blocks:
                for name, dataset in over_lanes.items():
                    dataset[first:last] = arrays[name]
                sink.check()
                check()
        append_checksum(partial)


def _write_metadata(file: h5py.File, metadata: Metadata) -> None:
    for name, value in metadata.items():
        if not isinstance(value, str):
            file.attrs[name] = value
        elif name in TEXTS or len(value.encode("utf-8", "replace")) > _LONGEST_ATTRIBUTE:
            text = file.create_dataset(name, data=_plain(value), dtype=_STRING, track_order=True)
            _describe(text, "1", TEXTS.get(name, name))
        else:
            file.attrs[name] = _plain(value)


def _harmonics(axis: str, parameters: Mapping[str, Parameter]) -> list[Variable]:
    rows = [p.value for p in parameters.values() if _parameter_dims(p, axis) == (HARMONIC,)]
    if not rows:
        return []
    numbers = tuple(range(1, np.size(rows[0]) + 1))
    text = "harmonic of the mesh frequency in the mesh stiffness"
    return [Variable(HARMONIC, (HARMONIC,), "int32", "1", text, "$n$", values=numbers)]


def _create(file: h5py.File, variable: Variable, shape: tuple[int, ...]) -> None:
    options: dict[str, Any] = {"track_order": True}
    if variable.dtype == "str":
        values = [_plain(str(value)) for value in variable.values or ()]
        dataset = file.create_dataset(variable.name, data=values, dtype=_STRING, **options)
    else:
        dataset = file.create_dataset(
            variable.name,
            shape,
            dtype=variable.dtype,
            fillvalue=variable.fill_value,
            chunks=_chunks(shape, np.dtype(variable.dtype).itemsize),
            compression="gzip",
            compression_opts=4,
            shuffle=True,
            fletcher32=True,
            **options,
        )
        if variable.values is not None:
            dataset[...] = variable.values
    if variable.dims == (variable.name,):
        dataset.make_scale(variable.name)
    for name, value in variable.attributes.items():
        dataset.attrs[name] = value
    if variable.fill_value is not None:
        dataset.attrs["_FillValue"] = np.array([variable.fill_value], dtype=variable.dtype)


def _chunks(shape: tuple[int, ...], itemsize: int) -> tuple[int, ...]:
    """Give chunks of half a MiB that hold whole rows, or parts of one row if it is longer."""
    row = shape[1:]
    if row:
        row = (min(row[0], _CHUNK_BYTES // itemsize), *row[1:])
    rows = _CHUNK_BYTES // (itemsize * max(1, int(np.prod(row))))
    return (min(shape[0], max(1, rows)), *row)


def _attach_scales(file: h5py.File, name: str, dims: tuple[str, ...]) -> None:
    if dims != (name,):
        for index, dim in enumerate(dims):
            file[name].dims[index].attach_scale(file[dim])


def _write_parameters(file: h5py.File, axis: str, parameters: Mapping[str, Parameter]) -> None:
    file.create_group(PARAMETERS, track_order=True)
    for name, parameter in parameters.items():
        path = f"{PARAMETERS}/{name}"
        dataset = file.create_dataset(
            path, data=np.asarray(parameter.value, dtype=np.float64), track_order=True
        )
        _attach_scales(file, path, _parameter_dims(parameter, axis))
        _describe(dataset, parameter.units, parameter.long_name or name)
        dataset.attrs["symbol"] = parameter.symbol
        dataset.attrs["origin"] = parameter.origin


def _parameter_dims(parameter: Parameter, axis: str) -> tuple[str, ...]:
    if np.ndim(parameter.value) == 0:
        return ()
    return (axis,) if parameter.origin == "swept" else (HARMONIC,)


def _describe(dataset: h5py.Dataset, units: str, long_name: str) -> None:
    dataset.attrs["units"] = units
    dataset.attrs["long_name"] = long_name


def _plain(text: str) -> str:
    """Replace what an HDF5 string cannot hold: NUL, and the lone surrogates of odd file names."""
    return text.encode("utf-8", "replace").decode("utf-8").replace("\0", "\ufffd")
