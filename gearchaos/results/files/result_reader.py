"""Reading and verifying a result file; any other file is refused with one sentence."""

import os
import re
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gearchaos.arrays import Array
from gearchaos.configuration.ranges import LARGEST_VALUE
from gearchaos.errors import FileError
from gearchaos.models.catalogues import due, scale_of
from gearchaos.outputs.names import DIRECTION, HARMONIC, STATE, STATUS
from gearchaos.outputs.variable import ORIGINS, Variable
from gearchaos.results.files import stored_dataset as stored
from gearchaos.results.files.atomic_file import checksum_fits, reason
from gearchaos.results.files.result_file import PARAMETER_GROUP, SCHEMA, SCHEMA_VERSION
from gearchaos.results.files.stored_dataset import UnfitError

Contents = tuple[
    list[Variable], dict[str, Array], dict[str, Variable], dict[str, str | int | float]
]
"""Variables, data, parameters and metadata, as for `Result`."""

OTHER_CONTENTS = ("branches", "boundaries")
"""Contents of other files of this program, which the schema of each names."""

SOON_HASHED = 1 << 30  # Bytes; their checksum takes about a second.

LONGEST_SYMBOL = 60
MOST_PRINTED = 1000  # Characters of a text that is shown.


def read_result(path: str | os.PathLike[str], *, rows: bool = True) -> Contents:
    """Read a result file.

    Links to other files are not followed. No more memory is allocated than the size of the file
    allows.

    Parameters
    ----------
    path : path-like
        Name of the file.
    rows : bool
        False: leave out the values of variables with dimensions beside the axes, and do not check
        the checksum of a file above 1 GiB.

    Raises
    ------
    FileError
        If the file is missing or damaged, if it is no result, or if its format has another major
        version.
    """
    with _opened(path, in_full=rows) as (file, _):
        return _read(file, rows)


def verify(path: str | os.PathLike[str]) -> list[str]:
    """Read a whole result file piece by piece, and return a phrase for each check it has passed.

    Raises FileError if anything is damaged or contradicts the format.
    """
    with _opened(path, in_full=True) as (file, fits):
        variables, _, parameters, metadata = _read(file, rows=False)
        for name in (variable.name for variable in variables):
            for piece in file[name].iter_chunks() if file[name].chunks else [...]:
                stored.values_of(name, file[name], piece)
    foreign = "there is no checksum of the file: another program than gearchaos has written to it"
    return [
        "the checksum of the file fits" if fits else foreign,
        "all numbers can be read, and fit the checksums of their chunks where there are any",
        f"format {metadata['schema']} {metadata['schema_version']}: {len(variables)} variables and "
        f"{len(parameters)} {PARAMETER_GROUP} have their types, dimensions and sizes",
    ]


@contextmanager
def _opened(path: str | os.PathLike[str], in_full: bool) -> Iterator[tuple[h5py.File, bool | None]]:
    """Open a file, with whether its checksum fits; turn every error into a FileError."""
    name, fits = os.fspath(path), None
    try:
        found = Path(name).stat()
        if not stat.S_ISREG(found.st_mode):
            raise FileError(f"{name}: is not a regular file; give the name of a result file")
        if in_full or found.st_size <= SOON_HASHED:
            fits = checksum_fits(Path(name))
    except (OSError, ValueError) as error:
        raise FileError(
            f"{name}: cannot be read: {reason(error)}; give the name of a result file"
        ) from error
    if fits is False:
        raise FileError(f"{name}: is damaged (its checksum does not fit); run the sweep again")
    try:
        with h5py.File(name, "r") as file:
            yield file, fits
    except UnfitError as error:
        raise FileError(f"{name}: {printable(str(error))}") from error
    except Exception as error:
        # h5py raises nearly any kind of exception for a damaged file.
        if not h5py.is_hdf5(name):
            remedy = "give the name of a result, which a sweep of a configuration writes"
            raise FileError(f"{name}: is not an HDF5 file; {remedy}") from error
        raise FileError(f"{name}: {_damage(error)}; run the sweep again") from error


def fixed_coordinates(metadata: Mapping[str, Any]) -> dict[str, float]:
    """Read the root attribute ``fixed``, such as ``start=1.0``; ValueError if it is malformed."""
    pairs = (entry.rpartition("=") for entry in str(metadata.get("fixed", "")).split())
    return {name: float(value) for name, _, value in pairs}


def _damage(error: Exception) -> str:
    """Return how a file is damaged, from the error of h5py."""
    why = reason(error)
    cut = re.search(r"truncated file: eof = (\d+),.* stored_eof = (\d+)", why)
    if cut is not None:
        found, wanted = map(int, cut.groups())
        return f"is cut off after {found:,} of {wanted:,} bytes"
    return f"is damaged ({printable(why)})"


def printable(text: str) -> str:
    """Return a text of a file, shortened, without characters that act on a terminal."""
    text = text if len(text) <= MOST_PRINTED else f"{text[:MOST_PRINTED]}..."
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def _read(file: h5py.File, rows: bool) -> Contents:
    metadata = stored.scalars_of(file)
    _check_schema(metadata)
    axes = _words(metadata, "axes")
    datasets = stored.datasets_of(file)
    grouped = {name: datasets.pop(name) for name in list(datasets) if "/" in name}
    variables: dict[str, Variable] = {}
    data: dict[str, Array] = {}
    sizes: dict[str, int] = {}
    for name, dataset in datasets.items():
        text = stored.text_of(dataset)
        notes = stored.scalars_of(dataset)
        if text is not None:
            metadata[name] = text
        if text is not None or str(notes.get("NAME", "")).startswith(stored.NO_COORDINATE):
            continue
        dims = stored.dims_of(name, dataset, notes, sizes)
        if name != HARMONIC:
            if rows or len(dims) == 1 or set(dims) <= set(axes):
                data[name] = stored.values_of(name, dataset)
            more = {**_wording(notes), "fill_value": notes.get("_FillValue")}
            more |= {"flags": _words(notes, "flag_meanings")}
            more |= {
                "errors": _words(notes, "ancillary_variables"),
                "scale": scale_of(name, metadata),
            }
            variables[name] = Variable(name, dims, stored.dtype_of(name, dataset), **more)
    _check_variables(axes, variables, data)
    for dim in sizes.keys() - {HARMONIC}:
        if dim not in variables or variables[dim].dims != (dim,):
            raise UnfitError(f"lacks the variable {dim}, whose dimension others have")
    fixed_coordinates(metadata)
    parameters = {}
    for path, dataset in grouped.items():
        notes, name = stored.scalars_of(dataset), path.removeprefix(f"{PARAMETER_GROUP}/")
        dims = stored.dims_of(path, dataset, notes, sizes)
        origin = str(notes.get("origin"))
        of_the_model = dims == tuple(a for a in (*axes, HARMONIC) if a in dims)
        if dataset.dtype.str[1:] != "f8" or not of_the_model or origin not in ORIGINS:
            raise UnfitError(f"holds a parameter {name} that is none")
        values = stored.values_of(name, dataset)
        value = values if dims else float(values)
        more = {
            **_wording(notes),
            "values": value,
            "origin": origin,
            "scale": scale_of(name, metadata),
        }
        parameters[name] = Variable(name, dims, "float64", **more)
    return list(variables.values()), data, parameters, metadata


def _words(notes: Mapping[str, Any], name: str) -> tuple[str, ...]:
    return tuple(str(notes.get(name, "")).split())


def _wording(notes: Mapping[str, Any]) -> dict[str, Any]:
    wording = {key: str(notes.get(key, ""))[:MOST_PRINTED] for key in ("units", "long_name")}
    symbol = str(notes.get("symbol", ""))
    # A long formula would exceed matplotlib's limit of recursion.
    return wording | {"symbol": symbol if len(symbol) <= LONGEST_SYMBOL else ""}


def _check_schema(metadata: Mapping[str, Any]) -> None:
    schema, version = metadata.get("schema"), str(metadata.get("schema_version", ""))
    own = SCHEMA_VERSION.split(".")[0]
    content = str(schema).removeprefix("gearchaos-")
    if content in OTHER_CONTENTS:
        raise UnfitError(
            f"holds {content}, and is no result of a sweep",
            "gearchaos plot and gearchaos report read it; give here the sweep that it belongs to",
        )
    if schema != SCHEMA:
        raise UnfitError(
            f'is not a gearchaos result: it lacks the attribute schema = "{SCHEMA}"',
            "give the name of a file that a sweep has written",
        )
    if version.split(".")[0] != own:
        raise UnfitError(
            f"has version {version!r} of the file format; this gearchaos reads {own}.x",
            "run the sweep again, or use the gearchaos that wrote it",
        )


def _check_variables(
    axes: tuple[str, ...], found: Mapping[str, Variable], data: Mapping[str, Array]
) -> None:
    """Check that a file has all variables it must have; further ones are allowed."""
    if not axes or len(set(axes)) < len(axes):
        raise UnfitError("does not name its axes, each once")
    for name, dims, dtype in due(axes, found):
        got = found.get(name)
        if got is None:
            raise UnfitError(f"lacks the variable {name}")
        if (got.dims, got.dtype) != (dims, dtype):
            raise UnfitError(
                f"holds {name} as {got.dtype} over ({', '.join(got.dims)}), which should be "
                f"{dtype} over ({', '.join(dims)})"
            )
    for name in axes:
        values = data[name]
        within = values.size > 0 and (np.abs(values) <= LARGEST_VALUE).all()
        if not (within and (np.diff(values) > 0).all()):
            rule = f"do not ascend, each once, between -{LARGEST_VALUE:g} and {LARGEST_VALUE:g}"
            raise UnfitError(f"holds values of {name} that {rule}")
    for name in {STATUS, STATE, DIRECTION, "motion"} & found.keys():
        meanings = len(found[name].flags)
        if data[name].max() >= meanings or (name == STATE and data[name].size != meanings):
            raise UnfitError(f"holds a {name} without a meaning in its attribute flag_meanings")
