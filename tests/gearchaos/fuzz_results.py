"""Damaged result files, and files that are no results; a number reproduces each file."""

import os
import random
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gearchaos.models.gear_pair.outputs import CATALOGUE, STATE_SUBJECTS
from gearchaos.outputs.variable import Variable, coordinate
from gearchaos.results.files.atomic_file import append_checksum
from gearchaos.results.reading.result import Result

from .fuzz_configurations import SMALL
from .listed_variables import parameter, sweep_variables

Random = random.Random

CHECKSUM_LINE = 82
LANES, POINTS = 20, 5
LOAD = coordinate("load", "1", "static load", "$f_n$", np.linspace(0.0, 1.0, LANES))
ERRORS = coordinate("pitch_error", "1", "pitch error", "$P$", np.linspace(0.0, 3.0, 4))
SEVERAL = [CATALOGUE.axis("start", np.arange(count)) for count in (2, 3)]
GOOD_AXES = ((LOAD,), (ERRORS, LOAD, SEVERAL[0]), (ERRORS, LOAD), (LOAD, SEVERAL[1]))


def good_result(path: Path, axes: tuple[Variable, ...] = GOOD_AXES[0]) -> None:
    """Write a sound result file with every kind of variable that a sweep has."""
    states = [one.name for one in STATE_SUBJECTS[:2]]
    variables = sweep_variables(
        axes,
        states=states,
        section=["delta_5"],
        section_points=POINTS,
        lyapunov=True,
        status_meanings=["ok", "diverged"],
        crossings=True,
        exponents=True,
        check_meanings=["not_checked", "same", "changed"],
        motion_meanings=["periodic", "quasi_periodic", "chaotic", "unresolved", "diverged"],
        record_meanings=["uniform", "mixed"],
    )
    sizes = {axis.name: axis.values.size for axis in axes}
    sizes |= {"section_point": POINTS, "state": 2, "exponent": 2}
    numbers = np.random.default_rng(5)
    data = {}
    for variable in variables:
        if variable.values is None:
            shape = tuple(sizes[dim] for dim in variable.dims)
            data[variable.name] = (
                numbers.normal(size=shape)
                if variable.dtype == "float64"
                else numbers.integers(0, max(1, len(variable.flags)), size=shape)
            )
    parameters = {
        "load": parameter("load", LOAD.values, "swept", dims=("load",)),
        "damping_ratio": parameter("damping_ratio", 0.1, "given"),
        "stiffness_cosine": parameter(
            "stiffness_cosine", np.array([0.1, 0.2]), "derived", dims=("harmonic",)
        ),
    }
    metadata: dict[str, str | int | float] = {
        "title": "a small result",
        "effects": "backlash",
        "threads": 2,
        "wall_time_seconds": 0.5,
        "configuration": SMALL,
        "configuration_resolved": SMALL,
    }
    Result([axis.name for axis in axes], variables, data, parameters, metadata).save(path)


def damaged_result(number: int, good: bytes, path: Path) -> str:
    """Write a damaged result file, or a file that is no result; return the kind of change.

    Parameters
    ----------
    number : int
        Determines the change.
    good : bytes
        A sound result file.
    path : Path
        File to write. Files to which it may point are in the same folder.
    """
    source = random.Random(f"result {number}")
    kind = list(KINDS)[number % len(KINDS)]
    KINDS[kind](source, good, path)
    return kind


def _cut(source: Random, good: bytes, path: Path) -> None:
    path.write_bytes(good[: source.randrange(len(good))])


def _cut_under_a_new_checksum(source: Random, good: bytes, path: Path) -> None:
    _cut(source, good, path)
    append_checksum(path)


def _flipped(source: Random, good: bytes, path: Path) -> None:
    path.write_bytes(_changed(source, good))


def _flipped_without_the_checksum(source: Random, good: bytes, path: Path) -> None:
    path.write_bytes(_changed(source, good[:-CHECKSUM_LINE]))


def _flipped_under_a_new_checksum(source: Random, good: bytes, path: Path) -> None:
    _flipped_without_the_checksum(source, good, path)
    append_checksum(path)


def _changed(source: Random, content: bytes) -> bytes:
    changed = bytearray(content)
    how = source.randrange(4)
    place = source.randrange(len(changed))
    size = source.choice((1, 4, 8, 64, 1000))
    if how == 0:
        changed[place] ^= 1 << source.randrange(8)
    elif how == 1:
        changed[place : place + size] = source.randbytes(min(size, len(changed) - place))
    elif how == 2:
        end = min(place + size, len(changed))
        changed[place:end] = bytes([source.choice((0, 0xFF))]) * (end - place)
    else:
        other = source.randrange(len(changed))
        changed[place : place + size] = changed[other : other + size]
    return bytes(changed)


def _edited(source: Random, good: bytes, path: Path) -> None:
    path.write_bytes(good)
    with h5py.File(path, "r+", track_order=True) as file:
        names = [*file, *(f"parameters/{name}" for name in file["parameters"])]
        for _ in range(source.choice((1, 1, 2))):
            name = source.choice(names)
            # HDF5 refuses some of these edits; the changes made before the error remain.
            with suppress(Exception):
                source.choice(EDITS)(source, file, name)
    if source.random() < 0.5:
        append_checksum(path)


def _exchange(source: Random, file: h5py.File, name: str) -> None:
    shape, notes = getattr(file[name], "shape", ()), dict(file[name].attrs)
    del file[name]
    shape = source.choice((shape, shape, (), shape[::-1], (*shape, 2), (3,), (0,)))
    new = file.create_dataset(name, data=_array(source, shape))
    for key in ("units", "long_name", "symbol", "origin", "flag_meanings", "dims"):
        if key in notes:
            new.attrs[key] = notes[key]


def _array(source: Random, shape: tuple[int, ...]) -> Any:
    kind = source.choice(ARRAYS)
    if kind == "text":
        return np.full(shape, "x\x1b[31m", dtype=h5py.string_dtype())
    if kind == "bytes":
        return np.full(shape, b"\xff\xfe", dtype="S2")
    if kind == "compound":
        return np.zeros(shape, dtype=[("a", "f8"), ("b", "i4")])
    if kind == "extreme":
        return np.full(shape, source.choice((np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324)))
    if kind == "enumeration":
        return np.zeros(shape, dtype=h5py.enum_dtype({"a": 0, "b": 1}, basetype="u1"))
    if kind == "references":
        return np.full(shape, h5py.Reference(), dtype=h5py.ref_dtype)
    if kind == "opaque":
        return np.zeros(shape, dtype="V7")
    return np.full(shape, source.choice((0, 1, 3)), dtype=kind)


ARRAYS = (
    "f8", "i4", "u1", "f4", "f2", "i8", "u8", ">f8", ">i4", "c16", "?", "text", "bytes", "compound",
    "extreme", "enumeration", "references", "opaque",
)  # fmt: skip


def _describe(source: Random, file: h5py.File, name: str) -> None:
    item = source.choice((file, file[name]))
    keys = [*item.attrs, "title", "units", "symbol", "_FillValue", "flag_meanings", "CLASS", "NAME"]
    key = source.choice(keys)
    if key in item.attrs and source.random() < 0.2:
        del item.attrs[key]
        return
    value = source.choice(
        (
            "", "x" * 20_000, "\x1b[2J\x07\n\r", "\u202egnp.exe", "$\\frac{1$", "$" * 7, "a " * 99,
            r"$\input{/etc/passwd}$", "%s%n{0}", 7, -1, 2.5, float("nan"), 10**18, file[name].ref,
            np.arange(3), np.zeros(0), b"\xff\xfe", "4.0", "3.9", h5py.Empty("f8"),
        )
    )  # fmt: skip
    item.attrs[key] = value


def _delete(_: Random, file: h5py.File, name: str) -> None:
    del file[name]


def _link(source: Random, file: h5py.File, name: str) -> None:
    old = file[name]
    del file[name]
    file[name] = source.choice(
        (
            h5py.ExternalLink("good.h5", f"/{name}"),
            h5py.ExternalLink("pipe", f"/{name}"),
            h5py.SoftLink("/load"),
            h5py.SoftLink(f"/{name}"),
            h5py.SoftLink("/nowhere"),
            file["/"],
            file["parameters"] if "parameters" in file else file["/"],
            file.get("status", old),
        )
    )


def _kept_elsewhere(source: Random, file: h5py.File, name: str) -> None:
    shape = getattr(file[name], "shape", None) or (LANES,)
    del file[name]
    elsewhere = source.choice(("good.h5", "pipe", "/etc/passwd"))
    if source.random() < 0.5:
        options = {"external": [(elsewhere, 0, h5py.h5f.UNLIMITED)]}
        file.create_dataset(name, shape=shape, dtype="f8", **options)
        return
    limits = (None,) * len(shape) if source.random() < 0.5 else shape
    layout = h5py.VirtualLayout(shape=shape, dtype="f8", maxshape=limits)
    layout[...] = h5py.VirtualSource(elsewhere, name, shape=shape, maxshape=limits)
    file.create_virtual_dataset(name, layout)


def _declare_too_much(source: Random, file: h5py.File, name: str) -> None:
    del file[name]
    options = source.choice(
        (
            {"shape": (10**12, 100), "chunks": (1000, 100), "compression": "gzip"},
            {"shape": (10**15,), "chunks": (1,)},
            {"shape": (10**6,), "chunks": (1,), "compression": "gzip"},
            {"shape": (10**9,)},
            {"shape": (LANES,), "chunks": (LANES,), "compression": "lzf"},
            {"shape": (LANES,), "chunks": (LANES,), "scaleoffset": 0},
            {"shape": (1,) * 32},
            {"shape": (LANES,), "maxshape": (None,), "chunks": (10**7,)},
        )
    )
    dataset = file.create_dataset(name, dtype="i4", **options)
    if dataset.size < 1000:
        dataset[...] = 1


def _exchange_dims(source: Random, file: h5py.File, name: str) -> None:
    names = source.choices(("load", "state", "section_point", "status", "x", name), k=3)
    file[name].attrs["dims"] = source.choice((1, file.ref, *map(" ".join, (names, names[1:], ""))))


def _add(source: Random, file: h5py.File, name: str) -> None:
    other = source.choice(
        ("x", "a\nb\x1b[31m", "\u202e", "x" * 3000, "motion", "period", "delta_5")
    )
    if other not in file:
        file.create_dataset(other, data=_array(source, source.choice(((), (LANES,), (3, 3)))))
        file[name].attrs["axes"] = other


EDITS: tuple[Callable[[Random, h5py.File, str], None], ...] = (
    _exchange, _exchange, _exchange, _describe, _describe, _describe, _delete, _link,
    _kept_elsewhere, _declare_too_much, _exchange_dims, _add,
)  # fmt: skip


def _another_hdf5_file(source: Random, _: bytes, path: Path) -> None:
    with h5py.File(path, "w", userblock_size=source.choice((0, 512))) as file:
        if source.random() < 0.7:
            file.attrs["schema"] = source.choice(("gearchaos-sweep", "other", 3))
            file.attrs["schema_version"] = source.choice(("2.0", "3.0", "", 3.0))
            file.attrs["axes"] = source.choice(("load", "state", "", "/", "..", "parameters"))
        for name in ("load", "state", "status", "parameters", "x/y"):
            if source.random() < 0.6:
                file.create_dataset(name, data=_array(source, source.choice(((), (4,), (2, 3)))))
        if source.random() < 0.5:
            file.require_group("z")["loop"] = file["/"]


def _no_hdf5_file(source: Random, good: bytes, path: Path) -> None:
    beginning = source.choice(
        (b"", b"CDF\1", b"\x89HDF\r\n\x1a\n", b"\x89PNG\r\n", b"PK\3\4", b"# x\n")
    )
    path.write_bytes(beginning + source.randbytes(source.choice((0, 1, 100, len(good)))))


def _no_file(source: Random, _: bytes, path: Path) -> None:
    source.choice((lambda: None, path.mkdir, lambda: os.mkfifo(path)))()


KINDS: dict[str, Callable[[Random, bytes, Path], None]] = {
    "cut": _cut,
    "cut, new checksum": _cut_under_a_new_checksum,
    "bytes changed": _flipped,
    "bytes changed, no checksum": _flipped_without_the_checksum,
    "bytes changed, new checksum": _flipped_under_a_new_checksum,
    "edited": _edited,
    "edited, second": _edited,
    "edited, third": _edited,
    "another HDF5 file": _another_hdf5_file,
    "not an HDF5 file": _no_hdf5_file,
    "no file": _no_file,
}
