"""What every command does alike: the text of --version, and faults turned into exit codes."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from io import TextIOWrapper
from typing import TextIO

from gearchaos import interrupts
from gearchaos.errors import FileError, GearchaosError
from gearchaos.interrupts import Termination

OK = 0
USAGE = 2
TOO_MANY_DIVERGED = 3
CANNOT_READ_OR_WRITE = FileError.exit_code
INTERRUPTED = 130
CLOSED_PIPE = 141
TERMINATED = 143


def software_version() -> str:
    """Return the installed version of gearchaos, "0+unknown" in a clone never installed."""
    try:
        return version("gearchaos")
    except PackageNotFoundError:
        return "0+unknown"


def version_text() -> str:
    """Return the one line that --version prints: gearchaos, Python and the platform."""
    return f"gearchaos {software_version()} (Python {platform.python_version()}, {sys.platform})"


def run_command(name: str, body: Callable[[], int], *, writes: bool = True) -> int:
    """Run a command's body and turn every fault a user can cause into lines on stderr.

    Parameters
    ----------
    name : str
        What the lines begin with, such as "gearchaos plot".
    body : callable
        The command. Returns its exit code; raises GearchaosError for what it cannot do.
    writes : bool
        Whether an interrupt finds anything to put in order: then the command asks for it at moments
        of its own choice, see `interrupts`.

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
        with interrupts.noted() if writes else interrupts.deadly():
            code = _code_of(body)
            interrupts.check()
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
