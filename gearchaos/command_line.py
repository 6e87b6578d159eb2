"""What every command does alike: the text of --version, and faults turned into exit codes."""

from __future__ import annotations

import os
import platform
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from io import TextIOWrapper
from types import FrameType
from typing import TextIO

from gearchaos.errors import FileError, GearchaosError

OK = 0
USAGE = 2
CANNOT_READ_OR_WRITE = FileError.exit_code
INTERRUPTED = 130
CLOSED_PIPE = 141
TERMINATED = 143


class Termination(KeyboardInterrupt):
    """SIGTERM, with which batch systems end a job: the command stops as after Ctrl-C."""


def software_version() -> str:
    """Return the installed version of gearchaos, "0+unknown" in a clone never installed."""
    try:
        return version("gearchaos")
    except PackageNotFoundError:
        return "0+unknown"


def version_text() -> str:
    """Return the one line that --version prints: gearchaos, Python and the platform."""
    return f"gearchaos {software_version()} (Python {platform.python_version()}, {sys.platform})"


def run_command(name: str, body: Callable[[], int]) -> int:
    """Run a command's body and turn every fault a user can cause into lines on stderr.

    Parameters
    ----------
    name : str
        What the lines begin with, such as "gearchaos plot".
    body : callable
        The command. Returns its exit code; raises GearchaosError for what it cannot do.

    Returns
    -------
    int
        The body's code, also that with which argparse exits; otherwise that of the
        GearchaosError, 4 for an operating system error that nobody has worded and, as the shell
        says, 130 for an interrupt, 143 for SIGTERM and 141 when the reader of the output has gone.
        The notes of a fault are printed after it.
    """
    if isinstance(sys.stdout, TextIOWrapper):
        # Paths that are not Unicode go out byte for byte, as they came in.
        sys.stdout.reconfigure(errors="surrogateescape")
    try:
        with _termination_interrupts():
            code = _code_of(body)
        if sys.stdout is not None:
            sys.stdout.flush()
        return code
    except GearchaosError as error:
        return _report(name, error, [f"error: {text}" for text in error.problems], error.exit_code)
    except Termination as termination:
        return _report(name, termination, ["terminated"], TERMINATED)
    except KeyboardInterrupt as interrupt:
        return _report(name, interrupt, ["interrupted"], INTERRUPTED)
    except BrokenPipeError:
        _discard(sys.stdout)
        return CLOSED_PIPE
    except OSError as error:
        return _report(name, error, [f"error: {error}"], CANNOT_READ_OR_WRITE)


def _code_of(body: Callable[[], int]) -> int:
    try:
        return body()
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else OK


@contextmanager
def _termination_interrupts() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before or signal.SIG_DFL)


def _terminate(number: int, _frame: FrameType | None) -> None:
    # A second one ends the process at once.
    signal.signal(number, signal.SIG_DFL)
    raise Termination


def _report(name: str, fault: BaseException, texts: list[str], code: int) -> int:
    lines = [f"{name}: {text}" for text in [*texts, *getattr(fault, "__notes__", [])]]
    try:
        print("\n".join(lines), file=sys.stderr, flush=True)
    except BrokenPipeError:
        _discard(sys.stderr)
    return code


def _discard(stream: TextIO) -> None:
    # The interpreter flushes once more on its way out; what is left must have somewhere to go.
    try:
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, stream.fileno())
        os.close(sink)
    except (OSError, ValueError):
        pass
