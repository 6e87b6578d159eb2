"""A file that is no sound result is refused with one sentence, quickly and with little memory."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from gearchaos.errors import FileError
from gearchaos.outputs.variable import coordinate
from gearchaos.results.reading.result import Result, open_result

from .listed_variables import parameter, sweep_variables

CHECKSUM_LINE = 82


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    variables = sweep_variables(
        [coordinate("load", "1", "static load", "$f_n$", np.linspace(0.0, 1.0, 20))],
        states=["delta_5", "delta_5_rate"],
        section=["delta_5"],
        section_points=5,
        lyapunov=True,
        status_meanings=["ok", "diverged"],
    )
    sizes = {"section_point": 5, "state": 2}
    random = np.random.default_rng(2)
    data = {
        v.name: random.integers(0, 2, size=(20, *(sizes[dim] for dim in v.dims[1:])))
        for v in variables
        if v.values is None
    }
    data["section_delta_5"] = random.normal(size=(20, 5))
    parameters = {
        "load": parameter("load", np.linspace(0.0, 1.0, 20), "swept", dims=("load",)),
        "damping_ratio": parameter("damping_ratio", 0.1, "given"),
        "stiffness_cosine": parameter(
            "stiffness_cosine", np.array([0.1, 0.2]), "given", dims=("harmonic",)
        ),
    }
    path = tmp_path_factory.mktemp("good") / "good.h5"
    Result(["load"], variables, data, parameters, {"title": "t"}).save(path)
    return path


def refusal(path: Path) -> str:
    with pytest.raises(FileError) as caught:
        open_result(path)
    (sentence,) = caught.value.problems
    assert sentence.startswith(f"{path}: ")
    assert "; " in sentence
    assert "\n" not in sentence
    assert caught.value.exit_code == 4
    return sentence


def test_every_truncation_is_refused(good: Path, tmp_path: Path) -> None:
    content = good.read_bytes()
    cut = tmp_path / "cut.h5"
    whole = len(content) - CHECKSUM_LINE
    # A file with less than the first word of the checksum line counts as a file without that line.
    ends = {0, 1, 7, 8, 9, 95, 96, *range(100, whole, 997), whole - 1, whole + 17}
    for end in sorted(ends | {len(content) - 50, len(content) - 1}):
        cut.write_bytes(content[:end])
        assert refusal(cut)
    cut.write_bytes(content[: whole // 2])
    assert f"is cut off after {whole // 2:,} of {whole:,} bytes" in refusal(cut)


def test_any_changed_byte_is_noticed(good: Path, tmp_path: Path) -> None:
    content = bytearray(good.read_bytes())
    changed = tmp_path / "changed.h5"
    for position in range(0, len(content) - CHECKSUM_LINE, 499):
        content[position] ^= 0x10
        changed.write_bytes(content)
        assert "is damaged (its checksum does not fit)" in refusal(changed)
        content[position] ^= 0x10


def test_changed_numbers_are_noticed_without_the_checksum_line(good: Path, tmp_path: Path) -> None:
    with h5py.File(good) as file:
        chunk = file["section_delta_5"].id.get_chunk_info(0)
    content = bytearray(good.read_bytes()[:-CHECKSUM_LINE])
    changed = tmp_path / "changed.h5"
    for position in range(chunk.byte_offset, chunk.byte_offset + chunk.size, 37):
        content[position] ^= 1
        changed.write_bytes(content)
        assert "is damaged in section_delta_5" in refusal(changed)
        content[position] ^= 1
    changed.write_bytes(content)
    assert "section_delta_5" in open_result(changed)


def replace(name: str, **options: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[name]
        file.create_dataset(name, **options)

    return change


def attribute(item: str, name: str, value: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file[item].attrs[name] = value

    return change


def link(name: str, target: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[name]
        file[name] = target

    return change


def virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout(shape=(20,), dtype="f8")
    layout[:] = h5py.VirtualSource("/etc/hostname", "x", shape=(20,))
    del file["lyapunov_exponent"]
    file.create_virtual_dataset("lyapunov_exponent", layout)


def scaled(name: str, shape: tuple[int, ...], dtype: str) -> Callable[[h5py.File], None]:
    """Replace a variable by one of another shape or type; its dimensions have names."""

    def change(file: h5py.File) -> None:
        replace(name, data=np.ones(shape, dtype))(file)
        scales = {20: "load", 3: "load", 5: "section_point"}
        file[name].attrs["dims"] = " ".join(scales[size] for size in shape)

    return change


def descending(file: h5py.File) -> None:
    file["load"][...] = file["load"][...][::-1]


HUGE = {"shape": (10**12, 100), "dtype": "f8", "chunks": (1000, 100), "compression": "gzip"}
CHANGES: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "another schema": (attribute("/", "schema", "other"), "is not a gearchaos result"),
    "a schema that is a number": (attribute("/", "schema", 3), "is not a gearchaos result"),
    "the next major version": (attribute("/", "schema_version", "4.0"), "has version '4.0'"),
    "the version before": (attribute("/", "schema_version", "1.0"), "run the sweep again"),
    "a version without sense": (attribute("/", "schema_version", "x"), "has version 'x'"),
    "an unknown axis": (attribute("/", "axes", "speed"), "lacks the variable speed"),
    "the states as axis": (attribute("/", "axes", "state"), "state"),
    "no axes": (attribute("/", "axes", ""), "does not name its axes"),
    "an axis that descends": (descending, "values of load that do not ascend"),
    "no status": (lambda file: file.__delitem__("status"), "lacks the variable status"),
    "no states": (lambda file: file.__delitem__("state"), "lacks the variable state"),
    "parameters that are no group": (replace("parameters", data=0.1), "holds parameters as"),
    "a row as status": (scaled("status", (20, 5), "u1"), "status as uint8 over (load, section"),
    "a float as status": (scaled("status", (20,), "f8"), "status as float64"),
    "complex exponents": (scaled("lyapunov_exponent", (20,), "c16"), "lyapunov_exponent"),
    "unnamed dimensions": (
        replace("status", data=np.zeros(20, "u1")),
        "status as uint8 over (status)",
    ),
    "another length": (scaled("status", (3,), "u1"), "status with dimensions"),
    "a status without meaning": (attribute("status", "flag_meanings", "ok"), "without a meaning"),
    "a group as variable": (lambda file: link("status", file["parameters"])(file), "status"),
    "a declared petabyte": (replace("section_delta_5", **HUGE), "declares"),
    "a huge chunk": (
        replace("lyapunov_exponent", data=np.zeros(2**25), chunks=(2**25,), compression="gzip"),
        "declares",
    ),
    "an empty array": (replace("status", data=np.zeros(0, "u1")), "over (status)"),
    "an external link": (link("status", h5py.ExternalLink("/etc/x.h5", "/s")), "a link"),
    "a soft link": (link("status", h5py.SoftLink("/start")), "a link"),
    "a dataset kept elsewhere": (
        replace("status", shape=(20,), dtype="u1", external=[("/etc/passwd", 0, 20)]),
        "outside of itself",
    ),
    "a virtual dataset": (virtual, "outside of itself"),
    "a parameter of unknown origin": (
        attribute("parameters/damping_ratio", "origin", "guessed"),
        "damping_ratio",
    ),
    "a text as parameter": (replace("parameters/damping_ratio", data="0.1"), "damping_ratio"),
    "a link as parameter": (
        link("parameters/damping_ratio", h5py.ExternalLink("/etc/x.h5", "/s")),
        "a link",
    ),
}


@pytest.mark.parametrize("fault", CHANGES)
def test_what_contradicts_the_format_is_refused(fault: str, good: Path, tmp_path: Path) -> None:
    change, words = CHANGES[fault]
    path = tmp_path / "changed.h5"
    path.write_bytes(good.read_bytes())
    with h5py.File(path, "r+") as file:
        change(file)
    assert words in refusal(path)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    text = tmp_path / "sweep.toml"
    text.write_text("[scene]\n", encoding="utf-8")
    assert "is not an HDF5 file; give the name of a result" in refusal(text)
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["x"] = np.arange(3)
    assert "is not a gearchaos result" in refusal(other)


def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path) -> None:
    assert "No such file" in refusal(tmp_path / "missing.h5")
    assert "is not a regular file" in refusal(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    assert "is not a regular file" in refusal(tmp_path / "pipe")


def test_a_declared_petabyte_costs_no_memory(good: Path, tmp_path: Path) -> None:
    path = tmp_path / "huge.h5"
    path.write_bytes(good.read_bytes())
    with h5py.File(path, "r+") as file:
        replace("section_delta_5", **HUGE)(file)
    program = (
        "import resource, sys; from gearchaos.results.reading.result import open_result\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "try: open_result(sys.argv[1])\n"
        "except Exception as error: print(type(error).__name__)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"
    )
    command = [sys.executable, "-c", program, str(path)]
    kind, kilobytes = subprocess.run(
        command, capture_output=True, text=True, check=True
    ).stdout.split()
    assert kind == "FileError"
    assert int(kilobytes) < 50_000
