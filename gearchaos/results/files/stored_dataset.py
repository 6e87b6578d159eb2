"""Reading plain numbers and texts of a file that may hold anything, within bounds of memory.

HDF5 keeps data without a fixed length in its global heap. Its library can loop forever in the heap
of a damaged file. The heap is read for texts of other programs only, since texts of our own files
have a fixed length.
"""

import math
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from gearchaos.arrays import Array
from gearchaos.results.files.atomic_file import reason
from gearchaos.results.files.result_file import DIMS, PARAMETER_GROUP

_DTYPES = {"f8": "float64", "i4": "int32", "u1": "uint8"}
_PACKED, _ROOM = 128, 1 << 20
"""A file may declare `_PACKED` bytes for each byte of its size plus `_ROOM`. Constant sections
compress 20:1, labels 1000:1."""

_MOST_NAMES, _LONGEST = 1000, 1 << 16
NO_COORDINATE = "This is a netCDF dimension but not a netCDF variable"
"""Beginning of the name of a dimension scale without values, which netCDF makes."""
_LEAST_PIECE = 4096
"""Smallest number of bytes that a chunk counts for, since every chunk takes time to read."""


class UnfitError(Exception):
    """A fault of the file in words, with a remedy; the reader turns it into a FileError."""

    def __init__(self, fault: str, remedy: str = "run the sweep again") -> None:
        super().__init__(f"{fault}; {remedy}")


def datasets_of(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Open all datasets of a result file, by name; ``parameters/load`` is a parameter.

    Raises UnfitError if an entry is no array of this file, or if they declare too many bytes.
    """
    # From the root group: h5py 3.11 lists a file by name, but the group in the order of creation.
    names = _names(file["/"])
    # Optional: a copy of the root group alone has no parameters.
    if PARAMETER_GROUP in names:
        names.remove(PARAMETER_GROUP)
        if not isinstance(_hard_linked(file, PARAMETER_GROUP), h5py.Group):
            raise UnfitError(f"holds {PARAMETER_GROUP} as something else than a group")
        names += [f"{PARAMETER_GROUP}/{name}" for name in _names(file[PARAMETER_GROUP])]
    datasets = {name: _hard_linked(file, name) for name in names}
    whole = file.id.get_filesize()
    left = _PACKED * (whole + _ROOM)
    for name, dataset in datasets.items():
        if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
            raise UnfitError(f"keeps {name} outside of itself or not as an array")
        chunk = dataset.chunks or dataset.shape
        pieces = (-(-size // max(1, side)) for size, side in zip(dataset.shape, chunk, strict=True))
        # An item without a fixed length may be as long as the file.
        item = whole if dataset.dtype.hasobject else dataset.dtype.itemsize
        piece = max(_LEAST_PIECE, math.prod(chunk) * item)
        left -= math.prod(pieces) * piece
        if left < 0:
            raise UnfitError(f"declares more than a file of its size holds, in {name}")
        # The library crashes on an empty chunk; a chunk too large would exceed the declared size.
        if dataset.chunks and dataset.id.chunk_iter(
            lambda chunk, most=2 * piece: None if 0 < chunk.size <= most else chunk
        ):
            raise UnfitError(f"is damaged in {name}")
    return datasets


def _hard_linked(file: h5py.File, name: str) -> Any:
    # A soft or an external link could lead anywhere.
    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise UnfitError(f"holds no {name}, or a link in its place")
    return file[name]


def _names(of: Any) -> list[str]:
    if len(of) > _MOST_NAMES:
        raise UnfitError(f"holds {len(of)} names in one place, where a result has some dozens")
    return list(of)


def dims_of(
    name: str, dataset: h5py.Dataset, notes: Mapping[str, Any], sizes: dict[str, int]
) -> tuple[str, ...]:
    """Return the dimensions of a dataset; check their sizes against ``sizes``, and add new ones."""
    # A dataset without the attribute is a coordinate, whose dimension has its own name.
    dims = tuple(str(notes.get(DIMS, name if dataset.shape else "")).split())
    if len(dims) != dataset.ndim or any(
        sizes.setdefault(dim, size) != size for dim, size in zip(dims, dataset.shape, strict=True)
    ):
        raise UnfitError(f"holds {name} with dimensions that do not fit")
    return dims


def dtype_of(name: str, dataset: h5py.Dataset) -> str:
    """Return the type of a dataset as the name that a variable has for it."""
    if dataset.dtype.str[1:] not in _DTYPES:
        raise UnfitError(f"holds {name} as {dataset.dtype}, which no variable is")
    return _DTYPES[dataset.dtype.str[1:]]


def values_of(name: str, dataset: h5py.Dataset, piece: Any = ...) -> Array:
    """Read a dataset, or a piece of it, in the byte order of this machine."""
    try:
        return np.asarray(dataset[piece], dtype=dtype_of(name, dataset))
    except OSError as error:
        raise UnfitError(f"is damaged in {name} ({reason(error)})") from error


def text_of(dataset: h5py.Dataset) -> str | None:
    """Read a dataset that is one text or a row of its bytes; None if it is neither."""
    if dataset.dtype == "S1" and dataset.ndim == 1:
        return str(_plain(dataset[()].tobytes()))
    if dataset.shape or h5py.check_string_dtype(dataset.dtype) is None:
        return None
    return str(_plain(dataset[()]))


def scalars_of(item: h5py.HLObject) -> dict[str, Any]:
    """Return the attributes that are a text or a number; others are bookkeeping of HDF5."""
    scalars = {}
    for name in _names(item.attrs):
        stored = item.attrs.get_id(name)
        known = stored.dtype.kind in "iuf" or h5py.check_string_dtype(stored.dtype)
        if known and stored.shape in ((), (1,)):
            value = _plain(np.ravel(item.attrs[name])[0])
            # Shortened: many names may share one long text of the global heap.
            scalars[name] = value[:_LONGEST] if isinstance(value, str) else value
    return scalars


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value) if isinstance(value, str) else value.item()
