"""Reading a file of branches; any other file is refused with one sentence."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import h5py
import numpy as np

from gearchaos.arrays import Array, Floats
from gearchaos.errors import FileError
from gearchaos.models.catalogues import scale_of
from gearchaos.outputs.names import SECTION, STATE
from gearchaos.outputs.variable import Variable
from gearchaos.records.branch import BRANCH_ENDS, SPECIAL_KINDS, PeriodicBranch, SpecialPoint
from gearchaos.results.files import stored_dataset as stored
from gearchaos.results.files.atomic_file import checksum_fits, reason
from gearchaos.results.files.branch_file import (
    FLANKS,
    OF_SPECIAL,
    POINT,
    SCHEMA,
    SCHEMA_VERSION,
    BranchSet,
)
from gearchaos.results.files.result_reader import printable

Content = TypeVar("Content")


def is_branch_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file says of itself that it holds branches."""
    return schema_of(path) == SCHEMA


def schema_of(path: str | os.PathLike[str]) -> str:
    """Return what kind of file a file says it is, empty if it does not say so."""
    try:
        with h5py.File(os.fspath(path), "r") as file:
            return str(stored.scalars_of(file).get("schema", ""))
    except Exception:
        # h5py raises nearly any kind of exception for a damaged file.
        return ""


def read_branches(path: str | os.PathLike[str]) -> BranchSet:
    """Read a file of branches.

    Parameters
    ----------
    path : path-like
        Name of the file.

    Returns
    -------
    BranchSet
        The branches.

    Raises
    ------
    FileError
        If the file is missing or damaged, if it holds no branches, or if its format has another
        major version.
    """
    kind = FileKind("branches", "gearchaos branches", SCHEMA, SCHEMA_VERSION)
    return read_kind(path, kind, _read)


class FileKind(NamedTuple):
    """A kind of file: what it holds, the command that writes it, its schema and version."""

    content: str
    command: str
    schema: str
    version: str


def read_kind(
    path: str | os.PathLike[str],
    kind: FileKind,
    read: Callable[[Mapping[str, h5py.Dataset], dict[str, Any]], Content],
) -> Content:
    """Read a file of a kind; any other file raises a FileError of one sentence.

    ``read``: returns the content of an open file from its datasets and metadata.
    """
    name, remedy = os.fspath(path), f"run {kind.command} again"
    try:
        if checksum_fits(Path(name)) is False:
            raise FileError(f"{name}: is damaged (its checksum does not fit); {remedy}")
        with h5py.File(name, "r") as file:
            metadata = stored.scalars_of(file)
            _check_schema(name, metadata, kind)
            return read(stored.datasets_of(file), metadata)
    except FileError:
        raise
    except stored.UnfitError as error:
        raise FileError(f"{name}: {printable(str(error))}") from error
    except FileNotFoundError as error:
        raise FileError(
            f"{name}: does not exist; give the name of a file that {kind.command} has written"
        ) from error
    except Exception as error:
        # h5py raises nearly any kind of exception for a damaged file.
        raise FileError(
            f"{name}: is no file of {kind.content} ({printable(reason(error))}); {remedy}"
        ) from error


def _check_schema(name: str, metadata: Mapping[str, Any], kind: FileKind) -> None:
    """Raise a FileError for a file of another kind or of a later format."""
    schema, version = str(metadata.get("schema", "")), str(metadata.get("schema_version", ""))
    if schema != kind.schema:
        raise FileError(
            f"{name}: holds no {kind.content} (its schema is {printable(schema) or 'not given'}); "
            f"give a file that {kind.command} has written"
        )
    major = kind.version.split(".")[0]
    if version.split(".")[0] != major:
        raise FileError(
            f"{name}: has format {printable(version)}, and this gearchaos reads {major}.x; "
            "install another version of gearchaos"
        )


def _read(datasets: Mapping[str, h5py.Dataset], metadata: dict[str, Any]) -> BranchSet:
    """Return the branches of a file that is open."""
    texts = {name: stored.text_of(one) for name, one in datasets.items()}
    metadata = metadata | {name: text for name, text in texts.items() if text is not None}
    arrays = {
        name: stored.values_of(name, one) for name, one in datasets.items() if texts[name] is None
    }
    notes = {name: stored.scalars_of(datasets[name]) for name in arrays}
    described = {name: described_as(name, datasets[name], notes[name], metadata) for name in arrays}
    states = str(notes[STATE]["flag_meanings"]).split()
    sections = [described[SECTION + state] for state in states]
    known = {"arclength", "stable", "lyapunov_exponent", "branch_of_point", POINT}
    known |= {"multiplier_real", "multiplier_imaginary", metadata["parameter"]}
    quantities = tuple(
        one for name, one in described.items() if one.dims == (POINT,) and name not in known
    )
    of = arrays["branch_of_point"]
    parameter = described[metadata["parameter"]]

    def part(name: str, number: int) -> Floats:
        values: Floats = arrays[name][of == number]
        return values

    specials = _read_specials(arrays, metadata, states)
    branches = tuple(
        PeriodicBranch(
            int(period),
            part(parameter.name, number),
            part("arclength", number),
            section_in(arrays, "", states, of == number, int(period)),
            part("multiplier_real", number) + 1j * part("multiplier_imaginary", number),
            part("lyapunov_exponent", number),
            tuple(one for at, one in specials(int(period)) if at == number),
            (BRANCH_ENDS[arrays["first_end"][number]], BRANCH_ENDS[arrays["last_end"][number]]),
            {one.name: part(one.name, number) for one in quantities},
        )
        for number, period in enumerate(arrays["period"])
    )
    return BranchSet(parameter, tuple(sections), branches, metadata, quantities)


def described_as(
    name: str,
    dataset: h5py.Dataset,
    notes: Mapping[str, Any],
    metadata: Mapping[str, Any],
) -> Variable:
    """Return the description of a variable without its values."""
    units, long_name, symbol = (str(notes.get(key, "")) for key in ("units", "long_name", "symbol"))
    dims = stored.dims_of(name, dataset, notes, {})
    dtype = stored.dtype_of(name, dataset)
    scale = scale_of(name.removeprefix(OF_SPECIAL), metadata)
    return Variable(name, dims, dtype, units, long_name, symbol, scale=scale)


def section_in(
    arrays: Mapping[str, Array], start: str, states: Sequence[str], chosen: Any, period: int
) -> Floats:
    """Return the section (points, period, states) of some points."""
    rows = [arrays[f"{start}{SECTION}{state}"][chosen, :period] for state in states]
    return np.stack(rows, axis=-1)


def _read_specials(
    arrays: Mapping[str, Array], metadata: Mapping[str, Any], states: Sequence[str]
) -> Callable[[int], list[tuple[int, SpecialPoint]]]:
    """Return a function of the period that gives special points with the numbers of branches."""
    flanks = ["", *str(metadata.get(FLANKS, "")).split("\n")]
    name = {key: f"{OF_SPECIAL}{key}" for key in ("kind", "branch", "arclength", "flank")}
    value = arrays[OF_SPECIAL + metadata["parameter"]]
    multipliers = (
        arrays[f"{OF_SPECIAL}multiplier_real"] + 1j * arrays[f"{OF_SPECIAL}multiplier_imaginary"]
    )

    def specials(period: int) -> list[tuple[int, SpecialPoint]]:
        sections = section_in(arrays, OF_SPECIAL, states, slice(None), period)
        return [
            (
                int(arrays[name["branch"]][at]),
                SpecialPoint(
                    SPECIAL_KINDS[arrays[name["kind"]][at]],
                    float(value[at]),
                    float(arrays[name["arclength"]][at]),
                    sections[at],
                    multipliers[at],
                    flanks[arrays[name["flank"]][at]],
                ),
            )
            for at in range(value.size)
        ]

    return specials
