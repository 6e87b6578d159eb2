"""The frame of every command: common options, lines on stderr, faults turned into exit codes."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO

from gearchaos import interrupts
from gearchaos.errors import FileError, GearchaosError
from gearchaos.interrupts import Termination
from gearchaos.progress import complain, speaking
from gearchaos.version import software_version

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

OK = 0
USAGE = 2
TOO_MANY_DIVERGED = 3
CANNOT_READ_OR_WRITE = FileError.exit_code
INTERRUPTED = 130
CLOSED_PIPE = 141
TERMINATED = 143

COMMON_OPTIONS: dict[str, dict[str, Any]] = {
    "overwrite": {"action": "store_true", "help": "replace what exists already"},
    "threads": {"type": int, "metavar": "N", "help": "threads to use (default: all cores)"},
    "set": {
        "action": "append",
        "default": [],
        "metavar": "KEY=VALUE",
        "help": "replace one key of the configuration, such as integration.steps_per_period=400",
    },
}


class Command(NamedTuple):
    """A command; called with its arguments it returns its exit code.

    Attributes
    ----------
    name : str
        As it follows ``gearchaos``.
    description, epilog : str
        What --help says before and after the options.
    arguments : callable
        Adds what only this command takes to its parser.
    body : callable
        Does it with the parsed options, beside which `arguments` are those on the command line.
        Imports what is heavy, so that --help answers at once. Returns the exit code; raises
        GearchaosError for what cannot be done.
    common : tuple of str
        Names of the `COMMON_OPTIONS` that it takes too, beside -q and --version.
    writes : bool
        Whether an interrupt finds anything to put in order, see `run_command`.
    """

    name: str
    description: str
    epilog: str | None
    arguments: Callable[[ArgumentParser], None]
    body: Callable[[Namespace], int]
    common: tuple[str, ...] = ()
    writes: bool = True

    def __call__(self, arguments: Sequence[str] | None = None) -> int:
        """Run the command, by default with the arguments of this process."""
        given = list(sys.argv[1:] if arguments is None else arguments)
        return run_command(f"gearchaos {self.name}", partial(self._run, given), writes=self.writes)

    def _run(self, arguments: list[str]) -> int:
        # Imported only now, where an interrupt is caught.
        from argparse import ArgumentParser, Namespace

        parser = ArgumentParser(
            prog=f"gearchaos {self.name}",
            description=self.description,
            epilog=self.epilog,
            allow_abbrev=False,
        )
        self.arguments(parser)
        add = parser.add_argument
        for name in self.common:
            add(f"--{name}", **COMMON_OPTIONS[name])
        add(
            "-q",
            "--quiet",
            action="store_true",
            help="say nothing on stderr unless something fails",
        )
        add("--version", action="version", version=version_text())
        options = parser.parse_args(arguments, Namespace(arguments=arguments))
        # Matplotlib would refuse to be imported where the environment names an unknown backend.
        os.environ["MPLBACKEND"] = "agg"
        with speaking(quiet=options.quiet):
            return self.body(options)


def version_text() -> str:
    """Return the one line that --version prints: gearchaos, Python and the platform."""
    from platform import python_version

    return f"gearchaos {software_version()} (Python {python_version()}, {sys.platform})"


def run_command(name: str, body: Callable[[], int], *, writes: bool = True) -> int:
    """Run a command's body and turn every fault a user can cause into lines on stderr.

    Parameters
    ----------
    name : str
        What the lines begin with, such as "gearchaos plot".
    body : callable
        Returns the exit code; raises GearchaosError for what cannot be done.
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
    with speaking(name):
        try:
            with interrupts.noted() if writes else interrupts.deadly():
                code = _code_of(body)
                interrupts.check()
            if sys.stdout is not None:
                sys.stdout.flush()
            return code
        except GearchaosError as error:
            return _report(error, [f"error: {text}" for text in error.problems], error.exit_code)
        except Termination as termination:
            return _report(termination, ["terminated"], TERMINATED)
        except KeyboardInterrupt as interrupt:
            return _report(interrupt, ["interrupted"], INTERRUPTED)
        except BrokenPipeError:
            _discard(sys.stdout)
            return CLOSED_PIPE
        except OSError as error:
            return _report(error, [f"error: {error}"], CANNOT_READ_OR_WRITE)


def _code_of(body: Callable[[], int]) -> int:
    try:
        return body()
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else OK


def _report(fault: BaseException, texts: list[str], code: int) -> int:
    try:
        complain(*texts, *getattr(fault, "__notes__", []))
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
