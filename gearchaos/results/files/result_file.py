"""The file of a result, one HDF5 file that is also netCDF-4: its rules, and how it is written."""

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
from gearchaos.outputs.catalogue import HARMONICS
from gearchaos.outputs.listing import GENERIC, Details
from gearchaos.outputs.names import HARMONIC, diagram_axis
from gearchaos.outputs.variable import Variable, lane_axes, require_listed
from gearchaos.results.files.atomic_file import append_checksum, replacing

SCHEMA = "gearchaos-sweep"
SCHEMA_VERSION = "3.2"
CONVENTIONS = "CF-1.9"  # The first one that knows uint8.
PARAMETERS = "parameters"
DIMS = "dims"
"""Attribute with the names of dimensions: HDF5 keeps its own list of them in the global heap."""

Block: TypeAlias = tuple[int, int, Mapping[str, Array]]
Metadata: TypeAlias = Mapping[str, str | int | float]

_CHUNK_BYTES = 1 << 19
_LONGEST_ATTRIBUTE = 32_000
CACHE_BYTES = 4 << 20  # Of each variable, while it is written.
_PACKED = {"compression": "gzip", "compression_opts": 4, "shuffle": True, "fletcher32": True}


def own_metadata(axes: Sequence[str]) -> dict[str, str]:
    """Give the root attributes that tell a reader what it has before it."""
    schema = {"Conventions": CONVENTIONS, "schema": SCHEMA, "schema_version": SCHEMA_VERSION}
    return {**schema, "axes": " ".join(axes), "axis": diagram_axis(axes)}


def write_result(
    path: str | os.PathLike[str],
    variables: Sequence[Variable],
    blocks: Iterable[Block],
    parameters: Mapping[str, Variable],
    metadata: Metadata,
    *,
    overwrite: bool = False,
    scratch: str | os.PathLike[str] | None = None,
) -> None:
    """Write a result block by block; the file appears complete or not at all.

    The variables come in this order. Of every one without values of its own, by name, a block
    (first, last, arrays) holds the lanes first to last - 1, in C order over the axes: shape
    (last - first, own dimensions). ``scratch`` is a folder for the temporary file, on the same file
    system; by default that of the file. Raises FileError if the file cannot be written, or exists
    and is not to be overwritten.
    """
    axes = lane_axes(variables)
    everything = [*variables, *_harmonics(parameters)]
    sizes = {v.name: len(v.values) for v in everything if v.values is not None and v.dims}
    shape = tuple(sizes[axis] for axis in axes)
    with replacing(path, overwrite=overwrite, scratch=scratch) as partial:
        with (
            Sink(partial) as sink,
            h5py.File(sink, "w", track_order=True, rdcc_nbytes=CACHE_BYTES) as file,
        ):
            _write_metadata(file, {**metadata, **own_metadata(axes)})
            for variable in everything:
                _create(file, variable, tuple(sizes[dim] for dim in variable.dims))
            for variable in everything:
                _attach_scales(file, variable.name, variable.dims)
            _write_parameters(file, parameters)
            # Kept open: HDF5 packs a chunk anew each time its dataset is closed.
            of_the_lanes = {v.name: file[v.name] for v in everything if v.values is None}
            for first, last, arrays in blocks:
                require_listed(arrays, [variable.name for variable in everything])
                boxes = list(hyperslabs(first, last, shape))
                for name, dataset in of_the_lanes.items():
                    place = 0
                    for box in boxes:
                        extent = [side.stop - side.start for side in box]
                        piece = arrays[name][place : place + math.prod(extent)]
                        dataset[box] = piece.reshape(*extent, *piece.shape[1:])
                        place += len(piece)
                sink.check()
                check()
        append_checksum(partial)


def hyperslabs(first: int, last: int, shape: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Cut the lanes first to last - 1 of an array in C order into boxes, in their order."""
    row = math.prod(shape[1:])
    # Whole rows in the middle, and what precedes and follows them in rows of their own.
    inner = [edge for edge in (-(-first // row) * row, last // row * row) if first < edge < last]
    for begin, end in pairwise(sorted({first, *inner, last})):
        number = begin // row
        if begin % row == end % row == 0:
            yield slice(number, end // row), *(slice(0, size) for size in shape[1:])
        else:
            for box in hyperslabs(begin - number * row, end - number * row, shape[1:]):
                yield slice(number, number + 1), *box


class Sink(FileIO):
    """A file that is emptied and open for writing, and remembers its first failure.

    The HDF5 library ends the process with a segmentation fault when the disk turns out to be full
    while it closes a file. So it is never told: it writes into a sink, whose error is raised later.
    """

    def __init__(self, path: Path) -> None:
        self._error: BaseException | None = None
        # Unbuffered: the error of a buffered write would surface in any later call.
        super().__init__(path, "w+")

    def __exit__(self, *fault: Any) -> None:
        with self._remembering():
            self.close()
        # An error that HDF5 has met in what it reads back is but a consequence of ours.
        if fault[0] is None or issubclass(fault[0], Exception):
            self.check()

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self._error is not None:
            raise self._error

    def write(self, data: Any) -> int:
        """Write all of it, or nothing once something has failed."""
        with self._remembering():
            left = memoryview(data).cast("B")
            while left and self._error is None:
                left = left[super().write(left) :]
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        """Set the size, unless something has failed."""
        with self._remembering():
            if self._error is None:
                super().truncate(size)
        return size or 0

    @contextmanager
    def _remembering(self) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            # An interrupt, too, must not reach the library.
            self._error = self._error or error


def _write_metadata(file: h5py.File, metadata: Metadata) -> None:
    for name, value in metadata.items():
        if isinstance(value, str) and len(content := _plain(value)) > _LONGEST_ATTRIBUTE:
            # As ASCII, which Octave insists on.
            text = file.create_dataset(name, data=np.bytes_(content), track_order=True)
            _describe(text, {"units": "1", "long_name": name})
        else:
            _describe(file, {name: value})


def _harmonics(parameters: Mapping[str, Variable]) -> list[Variable]:
    rows = (np.size(p.values) for p in parameters.values() if p.dims == (HARMONIC,))
    numbers = np.arange(1, next(rows, 0) + 1)
    return GENERIC.variables((), {HARMONICS: numbers.size > 0}, Details({HARMONIC: numbers}))


def _create(file: h5py.File, variable: Variable, shape: tuple[int, ...]) -> None:
    chunks = _chunks(shape, np.dtype(variable.dtype).itemsize)
    how = {**_PACKED, "chunks": chunks, "fillvalue": variable.fill_value, "track_order": True}
    dataset = file.create_dataset(variable.name, shape, variable.dtype, variable.values, **how)
    if variable.dims == (variable.name,):
        dataset.make_scale(variable.name)
    _describe(dataset, variable.attributes)
    if variable.fill_value is not None:
        dataset.attrs["_FillValue"] = np.array([variable.fill_value], dtype=variable.dtype)


def _chunks(shape: tuple[int, ...], itemsize: int) -> tuple[int, ...]:
    """Give chunks of half a MiB that follow the C order."""
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
    file.create_group(PARAMETERS, track_order=True)
    for name, parameter in parameters.items():
        path, values = f"{PARAMETERS}/{name}", np.asarray(parameter.values, dtype=np.float64)
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
    """Replace what an HDF5 string cannot hold: NUL, and the lone surrogates of odd file names."""
    return text.encode("utf-8", "replace").replace(b"\0", "\ufffd".encode())
