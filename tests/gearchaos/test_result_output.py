"""A result file is written completely or not at all, and existing files are never lost."""

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from gearchaos.errors import FileError
from gearchaos.outputs.variable import coordinate
from gearchaos.results.files.atomic_file import check_output, replacing
from gearchaos.results.reading.result import Result, open_result

from .listed_variables import sweep_variables

PROGRAM = """
import sys
import numpy as np
from gearchaos.errors import FileError
from gearchaos.results.reading.result import Result
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.outputs import catalogue
from gearchaos.outputs.listing import Details
from gearchaos.outputs.variable import coordinate

def result(lanes):
    every, section = catalogue.EVERY_SWEEP_PART, catalogue.SECTION_PART
    values = {"section_point": np.arange(100), "state": np.arange(1)}
    variables = CATALOGUE.variables(
        [coordinate("load", "1", "static load", "$f_n$", np.arange(float(lanes)))],
        {catalogue.SECTION_POINTS_PART: True, section: ["delta_5"], every: True},
        Details(values, {"status": ["ok", "diverged"], "state": ["delta_5"]}),
    )
    sizes = {"section_point": 100, "state": 1}
    random = np.random.default_rng(0)
    data = {
        v.name: random.random((lanes, *(sizes[dim] for dim in v.dims[1:])))
        for v in variables if v.values is None
    }
    return Result(["load"], variables, data, {}, {})
"""


def run(program: str, *arguments: str | Path, limit: int | None = None) -> str:
    """Run a program in a new process, optionally with a limit on the size of its files."""

    def restrict() -> None:
        if limit is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, "-c", PROGRAM + program, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=restrict)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.strip()


@pytest.fixture
def result() -> Result:
    variables = sweep_variables(
        [coordinate("load", "1", "static load", "$f_n$", np.arange(3.0))],
        states=["delta_5"],
        section=[],
        section_points=0,
        lyapunov=False,
        status_meanings=["ok", "diverged"],
    )
    data = {"status": [0, 0, 1], "diverged_period": [-1, -1, 4], "start_state": np.zeros((3, 1))}
    return Result(["load"], variables, data | {"end_state": np.ones((3, 1))}, {}, {})


def test_an_existing_result_is_replaced_only_with_overwrite(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "sweep.h5"
    path.write_bytes(b"earlier")
    for refuse in (check_output, result.save):
        with pytest.raises(FileError, match=r"exists already; replace it with --overwrite"):
            refuse(path)
    assert path.read_bytes() == b"earlier"
    check_output(path, overwrite=True)
    assert path.read_bytes() == b"earlier"
    result.save(path, overwrite=True)
    assert open_result(path)["load"].tolist() == [0, 1, 2]
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_appears_meanwhile_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "sweep.h5"
    with pytest.raises(FileError, match="exists already"), replacing(path) as partial:
        partial.write_bytes(b"late")
        path.write_bytes(b"first")
    assert path.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [path]


def test_outputs_that_cannot_be_are_refused_before_anything_is_computed(
    result: Result, tmp_path: Path
) -> None:
    file = tmp_path / "file"
    file.touch()
    os.mkfifo(tmp_path / "pipe")
    faults = {
        str(tmp_path): "is a directory",
        str(tmp_path / "missing" / "sweep.h5"): "No such file or directory; create the folder",
        str(file / "sweep.h5"): "Not a directory",
        str(tmp_path / "pipe"): "is not a regular file",
        "/dev/null": "is not a regular file",
        "/proc/sweep.h5": "No such file",
        str(tmp_path / ("x" * 300)): "File name too long; choose a shorter name",
        str(tmp_path / "folder") + "/": "is not a file name",
        "a\0b": "is not a file name",
        "": "is not a file name",
    }
    before = sorted(tmp_path.iterdir())
    for path, words in faults.items():
        for refuse in (check_output, result.save):
            with pytest.raises(FileError, match=words) as caught:
                refuse(path, overwrite=True)
            assert len(caught.value.problems) == 1
            assert "; " in caught.value.problems[0]
    assert sorted(tmp_path.iterdir()) == before


def test_a_symbolic_link_keeps_leading_to_the_result(result: Result, tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    link = tmp_path / "sweep.h5"
    link.symlink_to(tmp_path / "disk" / "real.h5")
    check_output(link)
    result.save(link)
    assert link.is_symlink()
    assert open_result(tmp_path / "disk" / "real.h5")["load"].size == 3


def test_a_result_has_the_rights_of_any_new_file(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "sweep.h5"
    (tmp_path / "other").touch()
    result.save(path)
    assert path.stat().st_mode == (tmp_path / "other").stat().st_mode


def test_a_result_that_is_replaced_hands_on_its_rights(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "sweep.h5"
    for mode in (0o600, 0o444, 0o664):
        path.touch()
        path.chmod(mode)
        with replacing(path, overwrite=True) as partial:
            assert partial.stat().st_mode & 0o077 == 0
        result.save(path, overwrite=True)
        assert path.stat().st_mode & 0o777 == mode


def test_a_disk_that_fills_up_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "sweep.h5"
    path.write_bytes(b"earlier")
    program = "try: result(2000).save(sys.argv[1], overwrite=True)\nexcept FileError as e: print(e)"
    whole = run("result(2000).save(sys.argv[1]); print('saved')", tmp_path / "whole.h5")
    assert whole == "saved"
    size = (tmp_path / "whole.h5").stat().st_size
    for limit in (0, 10, 1000, 5000, size // 2, size - 2000, size - 82, size - 1):
        words = f"{path}: cannot be written: {os.strerror(errno.EFBIG)}; raise the limit"
        assert run(program, path, limit=limit).startswith(words)
        assert path.read_bytes() == b"earlier"
        assert sorted(p.name for p in tmp_path.iterdir()) == ["sweep.h5", "whole.h5"]
    assert run(program, path, limit=size) == ""
    assert open_result(path)["load"].size == 2000


@pytest.mark.slow
def test_a_killed_writer_leaves_nothing_that_looks_like_a_result(tmp_path: Path) -> None:
    program = "r = result(20_000); print('go', flush=True); r.save(sys.argv[1])"
    path = tmp_path / "sweep.h5"
    for delay in (0.0, 0.02, 0.1, 0.3):
        command = [sys.executable, "-c", PROGRAM + program, str(path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "go\n"
            time.sleep(delay)
            process.kill()
        if path.exists():
            assert open_result(path)["load"].size == 20_000
            path.unlink()
        for left in tmp_path.iterdir():
            assert left.name.startswith(".sweep.h5.")
            assert left.suffix == ".partial"
            left.unlink()


def test_an_interrupted_writer_tidies_up(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "sweep.h5") as partial:
        partial.write_bytes(b"half")
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())
