"""Writing a result file: one HDF5 file that is also netCDF-4."""

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import FileIO
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import h5py
import numpy as np

from gearchaos.arrays import Array
from gearchaos.interrupts import check
from gearchaos.outputs.catalogue import HARMONICS_PART
from gearchaos.outputs.listing import GENERIC, Details
from gearchaos.outputs.names import HARMONIC, STATUS, diagram_axis
from gearchaos.outputs.variable import Variable, lane_axes, require_listed
from gearchaos.results.files.atomic_file import append_checksum, replacing

SCHEMA = "gearchaos-sweep"
SCHEMA_VERSION = "3.2"
CONVENTIONS = "CF-1.9"  # The first version with uint8.
PARAMETER_GROUP = "parameters"
DIMS = "dims"
"""Attribute with the names of dimensions. HDF5's own list is in the global heap, which is slow and
unsafe to read."""

BlockArrays: TypeAlias = tuple[int, int, Mapping[str, Array]]
Metadata: TypeAlias = Mapping[str, str | int | float]

_CHUNK_BYTES = 1 << 19
_LONGEST_ATTRIBUTE = 32_000
CACHE_BYTES = 4 << 20  # Memory for each variable while it is written.
_PACKED = {"compression": "gzip", "compression_opts": 4, "shuffle": True, "fletcher32": True}


def own_metadata(axes: Sequence[str]) -> dict[str, str]:
    """Return the root attributes that identify the format and name the axes."""
    schema = {"Conventions": CONVENTIONS, "schema": SCHEMA, "schema_version": SCHEMA_VERSION}
    return {**schema, "axes": " ".join(axes), "axis": diagram_axis(axes)}


def write_result(
    path: str | os.PathLike[str],
    variables: Sequence[Variable],
    blocks: Iterable[BlockArrays],
    parameters: Mapping[str, Variable],
    metadata: Metadata,
    *,
    overwrite: bool = False,
    scratch: str | os.PathLike[str] | None = None,
) -> None:
    """Write a result block by block; the file appears complete or not at all.

    Parameters
    ----------
    path : path-like
        Name of the file.
    variables : sequence of Variable
        The variables in the order of the file.
    blocks : iterable of (int, int, mapping of str to array)
        First lane, last lane (excluded), and an array of shape (lanes, own dimensions) for each
        variable without values of its own. Lanes are in C order over the axes.
    parameters, metadata : mapping
        Parameters of the model and root attributes, by name.
    overwrite : bool
        Whether an existing file is replaced.
    scratch : path-like, optional
        Folder of the temporary file, on the same file system. By default the folder of the file.

    Raises
    ------
    FileError
        If the file cannot be written, or exists and is not to be replaced.
    ValueError
        If a block holds an array that belongs to no variable.
    """
    everything = [*variables, *_harmonics(parameters)]
    with new_file(path, overwrite=overwrite, scratch=scratch) as (file, sink):
        write_metadata(file, {**metadata, **own_metadata(lane_axes(variables))})
        of_the_lanes = create_all(file, everything, parameters)
        for first, last, arrays in blocks:
            require_listed(arrays, [variable.name for variable in everything])
            _write_lanes(of_the_lanes, first, last, arrays)
            sink.check()
            check()


@contextmanager
def new_file(
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    scratch: str | os.PathLike[str] | None = None,
) -> Iterator[tuple[h5py.File, "Sink"]]:
    """Open a file that appears complete, with its checksum, or not at all; see `write_result`.

    Yields the file and what it is written to.
    """
    with replacing(path, overwrite=overwrite, scratch=scratch) as partial:
        with (
            Sink(partial) as sink,
            h5py.File(sink, "w", track_order=True, rdcc_nbytes=CACHE_BYTES) as file,
        ):
            yield file, sink
            sink.check()
        append_checksum(partial)


def _write_lanes(
    datasets: Mapping[str, h5py.Dataset], first: int, last: int, arrays: Mapping[str, Array]
) -> None:
    """Write arrays (lanes, own dimensions) of the lanes first to last - 1 into their datasets."""
    # The dimensions of the status are the axes alone.
    boxes = list(hyperslabs(first, last, datasets[STATUS].shape))
    for name, dataset in datasets.items():
        place = 0
        for box in boxes:
            extent = [side.stop - side.start for side in box]
            piece = arrays[name][place : place + math.prod(extent)]
            dataset[box] = piece.reshape(*extent, *piece.shape[1:])
            place += len(piece)


def hyperslabs(first: int, last: int, shape: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Cut the lanes first to last - 1 of an array in C order into boxes, in their order."""
    row = math.prod(shape[1:])
    # Whole rows in the middle, and incomplete rows before and after them.
    inner = [edge for edge in (-(-first // row) * row, last // row * row) if first < edge < last]
    for begin, end in pairwise(sorted({first, *inner, last})):
        number = begin // row
        if begin % row == end % row == 0:
            yield slice(number, end // row), *(slice(0, size) for size in shape[1:])
        else:
            for box in hyperslabs(begin - number * row, end - number * row, shape[1:]):
                yield slice(number, number + 1), *box


class Sink(FileIO):
    """A file for writing that stores its first failure instead of raising it.

    The HDF5 library crashes the process if the disk is full while it closes a file. It therefore
    writes into a sink that never fails, and the stored error is raised afterwards.
    """

    def __init__(self, path: Path) -> None:
        self._error: BaseException | None = None
        # Unbuffered: the error of a buffered write would surface in any later call.
        super().__init__(path, "w+")

    def __exit__(self, *fault: Any) -> None:
        with self._remembering():
            self.close()
        # An error that HDF5 raises about data it reads back follows from the stored failure.
        if fault[0] is None or issubclass(fault[0], Exception):
            self.check()

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self._error is not None:
            raise self._error

    def write(self, data: Any) -> int:
        """Write all data, or nothing after a failure."""
        with self._remembering():
            left = memoryview(data).cast("B")
            while left and self._error is None:
                left = left[super().write(left) :]
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        """Set the size, except after a failure."""
        with self._remembering():
            if self._error is None:
                super().truncate(size)
        return size or 0

    @contextmanager
    def _remembering(self) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            # Also an interrupt: no exception may reach the library.
            self._error = self._error or error


def write_metadata(file: h5py.File, metadata: Metadata) -> None:
    """Write root attributes; a long text becomes a dataset."""
    for name, value in metadata.items():
        if isinstance(value, str) and len(content := _plain(value)) > _LONGEST_ATTRIBUTE:
            # As ASCII of fixed length, which Octave requires.
            text = file.create_dataset(name, data=np.bytes_(content), track_order=True)
            _describe(text, {"units": "1", "long_name": name})
        else:
            _describe(file, {name: value})


def _harmonics(parameters: Mapping[str, Variable]) -> list[Variable]:
    rows = (np.shape(p.values)[-1] for p in parameters.values() if p.dims[-1:] == (HARMONIC,))
    numbers = np.arange(1, next(rows, 0) + 1)
    return GENERIC.variables((), {HARMONICS_PART: numbers.size > 0}, Details({HARMONIC: numbers}))


def create_all(
    file: h5py.File, variables: Sequence[Variable], parameters: Mapping[str, Variable]
) -> dict[str, h5py.Dataset]:
    """Create the datasets of all variables and parameters.

    Returns the datasets of the variables of the lanes, which have no values yet.
    """
    sizes = {v.name: len(v.values) for v in variables if v.values is not None and v.dims}
    for variable in variables:
        _create(file, variable, tuple(sizes[dim] for dim in variable.dims))
    for variable in variables:
        _attach_scales(file, variable.name, variable.dims)
    _write_parameters(file, parameters)
    # Kept open: HDF5 compresses a chunk again each time its dataset is closed.
    return {v.name: file[v.name] for v in variables if v.values is None}


def _create(file: h5py.File, variable: Variable, shape: tuple[int, ...]) -> None:
    how: dict[str, Any] = {"fillvalue": variable.fill_value, "track_order": True}
    if 0 not in shape:  # HDF5 has no empty chunks.
        how |= {**_PACKED, "chunks": _chunks(shape, np.dtype(variable.dtype).itemsize)}
    dataset = file.create_dataset(variable.name, shape, variable.dtype, variable.values, **how)
    if variable.dims == (variable.name,):
        dataset.make_scale(variable.name)
    _describe(dataset, variable.attributes)
    if variable.fill_value is not None:
        dataset.attrs["_FillValue"] = np.array([variable.fill_value], dtype=variable.dtype)


def _chunks(shape: tuple[int, ...], itemsize: int) -> tuple[int, ...]:
    """Return the shape of chunks of half a MiB that follow the C order."""
    room, chunks = _CHUNK_BYTES // itemsize, []
    for size in reversed(shape):
        chunks.append(min(size, max(1, room)))
        room //= size
    return tuple(reversed(chunks))


def _attach_scales(file: h5py.File, name: str, dims: tuple[str, ...]) -> None:
    if dims not in ((), (name,)):
        _describe(file[name], {DIMS: " ".join(dims)})
        for index, dim in enumerate(dims):
            file[name].dims[index].attach_scale(file[dim])


def _write_parameters(file: h5py.File, parameters: Mapping[str, Variable]) -> None:
    file.create_group(PARAMETER_GROUP, track_order=True)
    for name, parameter in parameters.items():
        path, values = f"{PARAMETER_GROUP}/{name}", np.asarray(parameter.values, dtype=np.float64)
        dataset = file.create_dataset(path, data=values, track_order=True)
        _attach_scales(file, path, parameter.dims)
        _describe(dataset, parameter.attributes)


def _describe(item: h5py.HLObject, notes: Mapping[str, Any]) -> None:
    for name, note in notes.items():
        if isinstance(note, str):
            content = _plain(note) or b"\0"
            item.attrs.create(name, content, dtype=h5py.string_dtype("utf-8", len(content)))
        else:
            item.attrs[name] = note


def _plain(text: str) -> bytes:
    """Replace characters that an HDF5 string cannot hold: NUL, and surrogates in file names."""
    return text.encode("utf-8", "replace").replace(b"\0", "\ufffd".encode())
