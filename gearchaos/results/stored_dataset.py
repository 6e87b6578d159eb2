"""Datasets of a file that may hold anything: only what lies in it, fits into it and is ours."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from gearchaos.results.atomic_file import reason
from gearchaos.results.result_file import PARAMETERS

_DTYPES = {"f8": "float64", "i4": "int32", "u1": "uint8"}
_LARGEST_CHUNK = 64 << 20
_HIGHEST_COMPRESSION = 1100
"""Deflate packs at best 1032 bytes into one; a dataset that claims more is not a real one."""
_FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}


class UnfitError(Exception):
    """What is wrong with the file, in words; becomes a FileError, by default with one remedy."""

    def __init__(self, fault: str, remedy: str = "run the sweep again") -> None:
        super().__init__(f"{fault}; {remedy}")


def hard_linked(file: h5py.File, name: str) -> Any:
    """Open what a file itself holds: a soft or an external link could lead anywhere."""
    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise UnfitError(f"holds no {name}, or a link in its place")
    return file[name]


def own_dataset(file: h5py.File, name: str) -> h5py.Dataset:
    """Open a dataset that lies in this file, is compressed in known ways and fits into it."""
    dataset = hard_linked(file, name)
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        raise UnfitError(f"keeps {name} outside of itself or not as an array")
    layout = dataset.id.get_create_plist()
    filters = {layout.get_filter(index)[0] for index in range(layout.get_nfilters())}
    stored = min(dataset.id.get_storage_size(), file.id.get_filesize())
    chunk = int(np.prod(dataset.chunks or (1,), dtype=object)) * dataset.dtype.itemsize
    size = int(np.prod(dataset.shape, dtype=object)) * dataset.dtype.itemsize
    packed = _HIGHEST_COMPRESSION if filters else 1
    # Chunks that nobody has written cost no bytes, but each of them costs time.
    if dataset.chunks and size > dataset.id.get_num_chunks() * chunk:
        packed = 0
    if filters - _FILTERS or chunk > _LARGEST_CHUNK or not 0 < size <= packed * stored:
        raise UnfitError(f"declares {size} bytes for {name} that it does not hold in a known way")
    return dataset


def own_datasets(file: h5py.File) -> Iterator[h5py.Dataset]:
    """Give the datasets of a result file that can be opened, those of its parameters too."""
    names = list(file)
    with suppress(UnfitError):
        names += [f"{PARAMETERS}/{name}" for name in hard_linked(file, PARAMETERS)]
    for name in names:
        with suppress(UnfitError):
            yield own_dataset(file, name)


def dims_of(file: h5py.File, dataset: h5py.Dataset, sizes: dict[str, int]) -> tuple[str, ...]:
    """Name the dimensions of a dataset; their sizes are those met before, or noted."""
    name = dataset.name.lstrip("/")
    dims = []
    for dim, size in zip(dataset.dims, dataset.shape, strict=True):
        scale = name if dataset.is_scale else dim[0].name.lstrip("/") if len(dim) == 1 else ""
        if scale not in file or sizes.setdefault(scale, size) != size:
            raise UnfitError(f"holds {name} with dimensions that do not fit")
        dims.append(scale)
    return tuple(dims)


def dtype_of(dataset: h5py.Dataset) -> str:
    """Name the type of a dataset as a variable does."""
    if h5py.check_string_dtype(dataset.dtype):
        return "str"
    if dataset.dtype.str[1:] not in _DTYPES:
        raise UnfitError(f"holds {dataset.name} as {dataset.dtype}, which no variable is")
    return _DTYPES[dataset.dtype.str[1:]]


def values_of(dataset: h5py.Dataset) -> NDArray[Any]:
    """Read the whole of a dataset, numbers in the byte order of this machine."""
    dtype = dtype_of(dataset)
    if dtype != "str":
        try:
            values: NDArray[Any] = dataset[...]
        except OSError as error:
            raise UnfitError(f"is damaged in {dataset.name} ({reason(error)})") from error
        return values.astype(dtype, copy=False)
    words = dataset.asstr()[...]
    if max(map(len, words.flat)) > np.iinfo(np.uint8).max:
        raise UnfitError(f"holds no plain words in {dataset.name}")
    return np.asarray(words, dtype="str")


def scalars_of(item: h5py.HLObject) -> dict[str, Any]:
    """Give the attributes that are a text or a number, and leave the bookkeeping of HDF5."""
    scalars: dict[str, Any] = {}
    for name in item.attrs:
        if item.attrs.get_id(name).shape not in ((), (1,)):
            continue
        value = np.ravel(item.attrs[name])[0]
        if isinstance(value, str):
            scalars[name] = str(value)
        elif isinstance(value, np.integer | np.floating):
            scalars[name] = value.item()
    return scalars
