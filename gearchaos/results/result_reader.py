"""Reading a result file, and refusing with one sentence whatever is not one."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import reason
from gearchaos.results.checksum_line import checksum_fits
from gearchaos.results.global_heap import heaps_end
from gearchaos.results.result_file import ORIGINS, PARAMETERS, SCHEMA, SCHEMA_VERSION, Parameter
from gearchaos.results.variables import (
    ALL_EXPONENTS,
    HARMONIC,
    LARGEST_EXPONENT,
    SECTION,
    SECTION_POINT,
    START,
    STATE,
    STATUS,
    Axis,
    Variable,
    sweep_variables,
)

Contents = tuple[
    list[Variable],
    dict[str, NDArray[Any]],
    dict[str, Parameter],
    dict[str, str | int | float],
]

_DTYPES = {"f8": "float64", "i4": "int32", "u1": "uint8"}
SOON_HASHED = 1 << 30
"""Bytes whose checksum takes about a second."""
_LARGEST_CHUNK = 64 << 20
_HIGHEST_COMPRESSION = 1100
"""Deflate packs at best 1032 bytes into one; a dataset that claims more is not a real one."""


class _UnfitError(Exception):
    """What is wrong with the file, in words; becomes a FileError, by default with one remedy."""

    def __init__(self, fault: str, remedy: str = "run the sweep again") -> None:
        super().__init__(f"{fault}; {remedy}")


def read_result(path: str | os.PathLike[str], *, rows: bool = True) -> Contents:
    """Read a whole result file, or all but what makes it large.

    Links to other files are not followed, and nothing larger than what the file can hold is
    allocated.

    Parameters
    ----------
    path : path
    rows : bool
        Whether variables with dimensions beside the axes are read; without them `data` lacks
        their values, and the checksum of a file above 1 GiB is left unchecked.

    Returns
    -------
    variables, data, parameters, metadata
        As for `Result`.

    Raises
    ------
    FileError
        If the file is missing, damaged, of another kind or of another major format version.
    """
    name = os.fspath(path)
    try:
        found = Path(name).stat()
        if not stat.S_ISREG(found.st_mode):
            raise FileError(f"{name}: is not a regular file; give the name of a result file")
        soon = rows or found.st_size <= SOON_HASHED
        if soon and checksum_fits(Path(name)) is False:
            raise FileError(f"{name}: is damaged (its checksum does not fit); run the sweep again")
        if soon and not heaps_end(name):
            raise FileError(f"{name}: is damaged where its texts are kept; run the sweep again")
    except (OSError, ValueError) as error:
        raise FileError(
            f"{name}: cannot be read: {reason(error)}; give the name of a result file"
        ) from error
    try:
        with h5py.File(name, "r") as file:
            return _read(file, rows)
    except _UnfitError as error:
        raise FileError(f"{name}: {printable(str(error))}") from error
    except Exception as error:
        # Damage surfaces in h5py as nearly any kind of exception.
        what = "is damaged" if h5py.is_hdf5(name) else "is not an HDF5 file, or is cut off"
        why = printable(reason(error))
        raise FileError(f"{name}: {what} ({why}); run the sweep again") from error


class Completed(NamedTuple):
    """What a finished sweep has computed: resolved TOML, lanes, and how many of them diverged."""

    configuration: str
    lanes: int
    diverged: int


def completed(path: str | os.PathLike[str]) -> Completed | None:
    """Look into a result file; None if there is none, or if it is not as it was written."""
    with suppress(OSError, ValueError, FileError):
        if checksum_fits(Path(path)):
            _, data, _, metadata = read_result(path, rows=False)
            status, text = data[STATUS], str(metadata.get("configuration_resolved", ""))
            return Completed(text, status.size, int(np.count_nonzero(status)))
    return None


def fixed_coordinates(metadata: Mapping[str, Any]) -> dict[str, float]:
    """Read the root attribute ``fixed``, such as ``start=1.0``: where a slice was taken.

    Raises
    ------
    ValueError
        If it is no list of coordinates.
    """
    pairs = (entry.rpartition("=") for entry in str(metadata.get("fixed", "")).split())
    return {name: float(value) for name, _, value in pairs}


def is_coordinate(values: NDArray[Any]) -> bool:
    """Tell whether values are those of an axis: numbers that ascend, none of them twice."""
    numbers = values.ndim == 1 and values.size > 0 and values.dtype.kind in "if"
    return numbers and bool(np.isfinite(values).all() and (np.diff(values) > 0).all())


def printable(text: str) -> str:
    """Return a text of a file without the control characters that act on a terminal."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def own_datasets(file: h5py.File) -> Iterator[h5py.Dataset]:
    """Give the datasets of a result file that lie in it and are no larger than it can hold."""
    names = list(file)
    with suppress(_UnfitError):
        names += [f"{PARAMETERS}/{name}" for name in _hard_linked(file, PARAMETERS)]
    for name in names:
        with suppress(_UnfitError):
            yield _dataset(file, name)


def _read(file: h5py.File, rows: bool) -> Contents:
    metadata = _scalars(file)
    _check_schema(metadata)
    axes = tuple(str(metadata.get("axes", "")).split())
    variables: list[Variable] = []
    data: dict[str, NDArray[Any]] = {}
    sizes: dict[str, int] = {}
    for name in file:
        if name == PARAMETERS:
            continue
        dataset = _dataset(file, name)
        if dataset.shape == ():
            if h5py.check_string_dtype(dataset.dtype):
                metadata[name] = dataset.asstr()[()]
            continue
        dims = _dims(file, dataset, sizes)
        if name != HARMONIC:
            if rows or len(dims) == 1 or set(dims) <= set(axes):
                data[name] = _values(dataset)
            variables.append(_variable(dataset, dims))
    _check_variables(axes, {variable.name: variable for variable in variables}, data)
    fixed_coordinates(metadata)
    return variables, data, _read_parameters(file, axes, sizes), metadata


def _check_schema(metadata: Mapping[str, Any]) -> None:
    if metadata.get("schema") != SCHEMA:
        raise _UnfitError(
            f'is not a gearchaos result: it lacks the attribute schema = "{SCHEMA}"',
            "give the name of a file that a sweep has written",
        )
    version, own = str(metadata.get("schema_version", "")), SCHEMA_VERSION.split(".")[0]
    if version.split(".")[0] != own:
        raise _UnfitError(
            f"has version {version!r} of the file format, of which this gearchaos reads {own}.x",
            "run the sweep again, or use the gearchaos that wrote it",
        )


def _check_variables(
    axes: tuple[str, ...], found: Mapping[str, Variable], data: Mapping[str, NDArray[Any]]
) -> None:
    """Compare what a sweep must yield with what there is; more than that is welcome."""
    if not axes or len(set(axes)) < len(axes):
        raise _UnfitError("does not name its axes, each once")
    if STATE not in data:
        raise _UnfitError(f"lacks the variable {STATE}")
    types = {name: np.dtype("i4" if name == START else "f8") for name in axes}
    expected = sweep_variables(
        [Axis(name, "", "", "", np.zeros(1, dtype)) for name, dtype in types.items()],
        states=tuple(data[STATE].ravel()),
        section=[n.removeprefix(SECTION) for n in found if n.startswith(f"{SECTION}delta_")],
        section_points=np.size(data.get(SECTION_POINT, ())),
        lyapunov=LARGEST_EXPONENT in found,
        status_meanings=(),
        crossings="crossings_per_period" in found,
        exponents=ALL_EXPONENTS in found,
        check_meanings=["same"] if "motion_changed" in found else [],
        motion_meanings=["periodic"] if "motion" in found else [],
    )
    for due in expected:
        got = found.get(due.name)
        if got is None:
            raise _UnfitError(f"lacks the variable {due.name}")
        if (got.dims, got.dtype) != (due.dims, due.dtype):
            raise _UnfitError(
                f"holds {due.name} as {got.dtype} over ({', '.join(got.dims)}), which should be "
                f"{due.dtype} over ({', '.join(due.dims)})"
            )
    for name in axes:
        if not is_coordinate(data[name]):
            raise _UnfitError(f"holds values of {name} that do not ascend, each once")
    for name in {STATUS, "motion"} & found.keys():
        if data[name].max() >= max(1, len(found[name].flags)):
            raise _UnfitError(f"holds a {name} without a meaning")


def _read_parameters(
    file: h5py.File, axes: tuple[str, ...], sizes: dict[str, int]
) -> dict[str, Parameter]:
    if not isinstance(_hard_linked(file, PARAMETERS), h5py.Group):
        raise _UnfitError(f"lacks the group {PARAMETERS}")
    parameters = {}
    for name in file[PARAMETERS]:
        dataset = _dataset(file, f"{PARAMETERS}/{name}")
        notes = _scalars(dataset)
        dims = _dims(file, dataset, sizes) if dataset.shape else ()
        origin = str(notes.get("origin"))
        number = _DTYPES.get(dataset.dtype.str[1:]) == "float64"
        of_the_model = dims == (HARMONIC,) or dims == tuple(a for a in axes if a in dims)
        if not number or not of_the_model or origin not in ORIGINS:
            raise _UnfitError(f"holds a parameter {name} that is none")
        values = dataset[()]
        value = values if dims else float(values)
        parameters[name] = Parameter(value, origin, **_wording(notes), dims=dims)
    return parameters


def _hard_linked(file: h5py.File, name: str) -> Any:
    # A soft or an external link could lead anywhere.
    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise _UnfitError(f"holds no {name}, or a link in its place")
    return file[name]


def _dataset(file: h5py.File, name: str) -> h5py.Dataset:
    """Open a dataset that lies in this file, is compressed in known ways and fits into it."""
    dataset = _hard_linked(file, name)
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        raise _UnfitError(f"keeps {name} outside of itself or not as an array")
    known = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
    layout = dataset.id.get_create_plist()
    filters = {layout.get_filter(index)[0] for index in range(layout.get_nfilters())}
    stored = min(dataset.id.get_storage_size(), file.id.get_filesize())
    chunk = int(np.prod(dataset.chunks or (1,), dtype=object)) * dataset.dtype.itemsize
    size = int(np.prod(dataset.shape, dtype=object)) * dataset.dtype.itemsize
    packed = _HIGHEST_COMPRESSION if filters else 1
    # Chunks that nobody has written cost no bytes, but each of them costs time.
    pieces = dataset.id.get_num_chunks() if dataset.chunks else 0
    if dataset.chunks and size > pieces * chunk:
        packed = 0
    if filters - known or chunk > _LARGEST_CHUNK or not 0 < size <= packed * stored:
        raise _UnfitError(f"declares {size} bytes for {name} that it does not hold in a known way")
    return dataset


def _dims(file: h5py.File, dataset: h5py.Dataset, sizes: dict[str, int]) -> tuple[str, ...]:
    name = dataset.name.lstrip("/")
    dims = []
    for dim, size in zip(dataset.dims, dataset.shape, strict=True):
        scale = name if dataset.is_scale else dim[0].name.lstrip("/") if len(dim) == 1 else ""
        if scale not in file or sizes.setdefault(scale, size) != size:
            raise _UnfitError(f"holds {name} with dimensions that do not fit")
        dims.append(scale)
    return tuple(dims)


def _values(dataset: h5py.Dataset) -> NDArray[Any]:
    if h5py.check_string_dtype(dataset.dtype) is None:
        kind = _dtype(dataset)
        try:
            values: NDArray[Any] = dataset[...]
        except OSError as error:
            raise _UnfitError(f"is damaged in {dataset.name} ({reason(error)})") from error
        return values.astype(kind, copy=False)
    words = dataset.asstr()[...]
    if max(map(len, words.flat)) > np.iinfo(np.uint8).max:
        raise _UnfitError(f"holds no plain words in {dataset.name}")
    return np.asarray(words, dtype="str")


def _dtype(dataset: h5py.Dataset) -> str:
    if h5py.check_string_dtype(dataset.dtype):
        return "str"
    if dataset.dtype.str[1:] not in _DTYPES:
        raise _UnfitError(f"holds {dataset.name} as {dataset.dtype}, which no variable is")
    return _DTYPES[dataset.dtype.str[1:]]


def _variable(dataset: h5py.Dataset, dims: tuple[str, ...]) -> Variable:
    notes = _scalars(dataset)
    return Variable(
        dataset.name.lstrip("/"),
        dims,
        _dtype(dataset),
        **_wording(notes),
        fill_value=notes.get("_FillValue"),
        flags=tuple(str(notes.get("flag_meanings", "")).split()),
    )


def _wording(notes: Mapping[str, Any]) -> dict[str, Any]:
    return {key: str(notes.get(key, "")) for key in ("units", "long_name", "symbol")}


def _scalars(item: h5py.HLObject) -> dict[str, Any]:
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
