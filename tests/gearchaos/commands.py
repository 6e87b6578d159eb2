"""A small sweep, and functions that run commands on it as a user does."""

import atexit
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from select import select
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, NamedTuple

import numpy as np
import pytest

import gearchaos

SMALL = """\
# every effect, so that every parameter can be swept with one kernel
title = "a small sweep"

[pair]
teeth = [21, 38]
normal_module_mm = 2.166
normal_pressure_angle_deg = 20.0
helix_angle_deg = 20.0
face_width_mm = 15.0

[operation]
speed_rpm = 8000.0
torque_Nm = 50.0

[mesh]
mean_stiffness_N_per_um_mm = 13.3548
length_scale_um = 25.0
half_backlash_um = 20.0
damping_ratio = 0.1

[mesh.stiffness]
shape = "fourier"
cosine_N_per_um_mm = [-1.202, 0.0, -0.1339]
sine_N_per_um_mm = [1.203, 0.0, -0.1335]

[pitch_error]
amplitude_um = 11.0
mean_um = 2.0
phase_deg = 30.0

[bearings]
transverse_stiffness_N_per_m = [1e8, 2e8]
transverse_damping_N_s_per_m = [100.0, 300.0]
axial_stiffness_N_per_m = [3e7, 4e7]
axial_damping_N_s_per_m = [50.0, 60.0]

[groups]
damping_ratio = 0.05

[scene]
effects = ["pitch_error", "stiffness_variation", "backlash", "transverse", "axial"]

[sweep]
parameter = "pitch_error"
from = 0.0
to = 5.0
count = 40

[integration]
steps_per_period = 40
transient_periods = 5
recorded_periods = 10

[outputs]
section = ["delta_5", "delta_3"]
section_points = 5
lyapunov = true
"""

LINEAR = (
    *("--set", 'scene.effects=["pitch_error"]'),
    *("--set", "pitch_error.phase_deg=0.0"),
    *("--set", 'outputs.section=["delta_5"]'),
)
"""The smallest scene, a linear pair with two states, for tests that work with any scene."""

HANGS = 1800.0
"""Time limit in seconds: a command that takes longer hangs, also on a busy machine."""

PAGE_HANGS = 300.0
"""The same limit for a page in a browser; its longest wait is the compilation of a kernel."""

DIVERGING = ("--set", "groups.load=1e150")
"""A load that drives every lane beyond every length scale."""


class Ended(NamedTuple):
    """How a command ended."""

    code: int
    out: str
    err: str


def small_config(folder: Path) -> Path:
    """Write the small sweep into a folder as ``gears.toml``."""
    path = folder / "gears.toml"
    path.write_text(SMALL, encoding="utf-8")
    return path


@contextmanager
def served(folder: Path, *words: str, stderr: Any = None) -> Iterator[str]:
    """Serve a page as a user does, in a process of its own; yield its address.

    The process is terminated at the end of the block, also after an exception. Otherwise the wait
    for the process would never end.
    """
    command = [sys.executable, "-m", "gearchaos.explore", *words, "--no-browser", "--port=0"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=stderr, text=True) as server:
        try:
            assert server.stdout is not None
            yield server.stdout.readline().strip()
        finally:
            server.terminate()


def until(page: Any, met: Callable[[], bool]) -> None:
    """Wait until a page meets a condition that no locator can describe."""
    end = time.monotonic() + PAGE_HANGS
    while not met():
        assert time.monotonic() < end
        page.wait_for_timeout(50.0)


def run_module(
    module: str, *arguments: str, cwd: Path, preexec_fn: Callable | None = None, **options
) -> Ended:
    """Run ``python -m module`` in a folder; see `begin`, but ``env`` is the whole environment."""
    forks = hasattr(os, "fork")
    if preexec_fn is None and "env" not in options and forks:
        return begin(module, arguments, cwd, **options)[1]()
    if not forks and ({*options} - {"env"} or preexec_fn):
        pytest.skip("needs processes that fork")
    options["preexec_fn"] = preexec_fn
    command = [sys.executable, "-m", module, *arguments]
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, timeout=HANGS, **options
    )
    assert "Traceback" not in done.stderr, done.stderr
    return Ended(done.returncode, done.stdout, done.stderr)


def begin(
    module: str,
    arguments: Sequence[str],
    cwd: Path,
    *,
    stdin: str = "",
    variables: dict[str, str] | None = None,
    largest_file: int | None = None,
    beside: bool = False,
    imported: Sequence[str] = (),
) -> tuple[int, Callable[[], Ended]]:
    """Begin a command whose modules are imported; return its process and a function that waits.

    The function waits for the end of the command and raises an error if stderr has a traceback.
    It has two attributes: ``unjudged`` waits without this check, for programs of others; ``said``
    returns the text in stderr so far. Earlier commands that still run, as after a failed test, are
    killed unless this one runs ``beside`` them. ``imported``: modules that only some commands
    import.
    """
    if not hasattr(os, "fork"):
        pytest.skip("needs processes that fork")
    server, folder = _server(*imported), Path(mkdtemp(dir=_folder().name))
    files = [folder / name for name in ("in", "out", "err")]
    for file, text in zip(files, (stdin, "", ""), strict=True):
        file.write_text(text)
    _, out, err = files
    words = [module, arguments, str(cwd), [*map(str, files)], variables or {}, largest_file]
    request, process = server.begin(words, beside)

    def unjudged() -> Ended:
        done = Ended(server.end(request), out.read_text(), err.read_text())
        shutil.rmtree(folder)
        return done

    def ended() -> Ended:
        done = unjudged()
        assert "Traceback" not in done.err, done.err
        return done

    ended.said, ended.unjudged = err.read_text, unjudged
    return process, ended


@cache
def _folder() -> TemporaryDirectory:
    """Make the folder for stdin, stdout and stderr of all commands; it is removed at exit."""
    folder = TemporaryDirectory()
    atexit.register(folder.cleanup)
    return folder


class Server:
    """The process of `command_server`, which runs commands."""

    def __init__(self, *modules: str) -> None:
        """Start the process, with more modules to import."""
        pipe, script = subprocess.PIPE, Path(__file__).with_name("command_server.py")
        command = [sys.executable, str(script), *modules]
        # Without a buffer, `select` sees answers that have not been read.
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, bufsize=0)
        atexit.register(self._process.communicate)
        self._requests = 0
        self._running: dict[int, int] = {}
        self._codes: dict[int, int] = {}

    def begin(self, words: list, beside: bool = False) -> tuple[int, int]:
        """Begin a command, and return the numbers of its request and its process.

        Other running commands are killed, unless this one runs beside them.
        """
        while select([self._process.stdout], [], [], 0.0)[0]:
            self._read()
        if not beside:
            for process in filter(None, self._running.values()):
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            self._running, self._codes = {}, {}
        self._requests += 1
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps([self._requests, *words]).encode() + b"\n")
        request = self._requests
        self._running[request] = 0
        while not self._running[request]:
            self._read()
        return request, self._running[request]

    def end(self, request: int) -> int:
        """Wait for the end of a command and return its exit code."""
        known = request in self._running or request in self._codes
        assert known, "killed when another command was begun"
        while request not in self._codes:
            self._read()
        return self._codes.pop(request)

    def _read(self) -> None:
        """Wait for an answer: first the number of a process, later its exit code."""
        line = self._process.stdout.readline()
        if not line:
            _server.cache_clear()  # The next command starts another server.
            raise RuntimeError(f"the command server has ended with {self._process.wait()}")
        request, answer = map(int, line.split())
        if self._running.get(request) == 0:
            self._running[request] = answer
        elif self._running.pop(request, None):
            self._codes[request] = answer


@cache
def _server(*modules: str) -> Server:
    return Server(*modules)


def sweep(folder: Path, *arguments: str, **options) -> Ended:
    """Run the sweep command on the small sweep in a folder."""
    small_config(folder)
    return run_module("gearchaos.sweep", "gears.toml", *arguments, cwd=folder, **options)


def names_in(folder: Path) -> list[str]:
    """Return the sorted names in a folder, those of hidden files too."""
    return sorted(path.name for path in folder.iterdir())


def same_data(one: gearchaos.Result, other: gearchaos.Result) -> bool:
    """Return whether two results hold the same variables and parameters, bit for bit."""
    assert list(one) == list(other)
    assert one.parameters.keys() == other.parameters.keys()
    arrays = [(one[name], other[name]) for name in one]
    arrays += [
        (np.asarray(parameter.values), np.asarray(other.parameters[name].values))
        for name, parameter in one.parameters.items()
    ]
    return all(a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in arrays)


def signalled(folder: Path, blocks: str, number: int, *arguments: str) -> Ended:
    """Run a sweep, send it a signal once a block is finished, and return how it ended."""
    process, ended = begin("gearchaos.sweep", arguments, folder)
    while is_running(process) and not list((folder / blocks).glob("*.block")):
        time.sleep(0.005)
    with suppress(ProcessLookupError):
        os.kill(process, number)
    return ended()


def interrupted_at(
    pattern: str, log: Path, module: str, arguments: Sequence[str], cwd: Path
) -> Ended:
    """Begin a command, interrupt it when its log matches a pattern, and return how it ended."""
    process, ended = begin(module, arguments, cwd)
    while is_running(process) and not (log.exists() and re.search(pattern, log.read_text())):
        time.sleep(0.005)
    os.kill(process, signal.SIGINT)
    return ended()


def is_running(process: int) -> bool:
    """Return whether a process is still running."""
    with suppress(ProcessLookupError):
        os.kill(process, 0)
        return True
    return False
