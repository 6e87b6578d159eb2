"""A small sweep, and the means to run commands on it as a user does."""

import atexit
import json
import os
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
"""The smallest scene, two states of a linear pair, where it does not matter what is computed."""

HANGS = 1800.0
"""Seconds after which what has not happened never will, on a busy machine either."""

PAGE_HANGS = 300.0
"""The same for what a page shows: the longest wait is for a kernel that is compiled meanwhile."""

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

    The process ends with the block, however that ends: waiting for it would otherwise never end.
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
    """Wait until a page shows something that no locator describes."""
    end = time.monotonic() + PAGE_HANGS
    while not met():
        assert time.monotonic() < end
        page.wait_for_timeout(50.0)


def run_module(
    module: str, *arguments: str, cwd: Path, preexec_fn: Callable | None = None, **options
) -> Ended:
    """Run ``python -m module`` in a folder; see `begin`, but ``env`` is a whole environment."""
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
    """Begin a command that need not import what it needs; return its process, and how to wait.

    The latter has a function ``said``, which returns what has been written to stderr by now.
    A command that was begun before and not waited for, as of a test that has failed, is killed,
    unless this one runs ``beside`` it. ``imported``: modules that only some commands import.
    The way to wait refuses tracebacks; its ``unjudged``, for programs of others, does not.
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
    """Make the folder of what all commands read and write; it goes with this process."""
    folder = TemporaryDirectory()
    atexit.register(folder.cleanup)
    return folder


class Server:
    """The process of `command_server`, which runs commands."""

    def __init__(self, *modules: str) -> None:
        """Start it, with more modules to import."""
        pipe, script = subprocess.PIPE, Path(__file__).with_name("command_server.py")
        command = [sys.executable, str(script), *modules]
        # Without a buffer: what has been answered and not read can then be seen.
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, bufsize=0)
        atexit.register(self._process.communicate)
        self._requests = 0
        self._running: dict[int, int] = {}
        self._codes: dict[int, int] = {}

    def begin(self, words: list, beside: bool = False) -> tuple[int, int]:
        """Begin a command, and return the number of the request and that of its process.

        Others that run are killed, unless it runs beside them.
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
        """Wait for an answer: the number of a process first, then its exit code."""
        line = self._process.stdout.readline()
        if not line:
            _server.cache_clear()  # The next command gets another one.
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
    """List what a folder holds, hidden files too."""
    return sorted(path.name for path in folder.iterdir())


def same_data(one: gearchaos.Result, other: gearchaos.Result) -> bool:
    """Whether two results hold the same variables and parameters, bit for bit."""
    assert list(one) == list(other)
    assert one.parameters.keys() == other.parameters.keys()
    arrays = [(one[name], other[name]) for name in one]
    arrays += [
        (np.asarray(parameter.values), np.asarray(other.parameters[name].values))
        for name, parameter in one.parameters.items()
    ]
    return all(a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in arrays)


def signalled(folder: Path, blocks: str, number: int, *arguments: str) -> Ended:
    """Run a sweep, send it a signal once a block is finished; return exit code, stdout, stderr."""
    process, ended = begin("gearchaos.sweep", arguments, folder)
    while is_running(process) and not list((folder / blocks).glob("*.block")):
        time.sleep(0.005)
    with suppress(ProcessLookupError):
        os.kill(process, number)
    return ended()


def is_running(process: int) -> bool:
    """Tell whether a process that was begun has not ended."""
    with suppress(ProcessLookupError):
        os.kill(process, 0)
        return True
    return False
