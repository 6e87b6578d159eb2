"""The frame of every command: common options, lines on stderr, faults turned into exit codes."""

import math
import os
import re
import sys
import tomllib
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from functools import partial
from io import TextIOWrapper
from pathlib import Path
from typing import Any, NamedTuple, Self

from gearchaos.errors import ConfigurationError, FileError, GearchaosError
from gearchaos.interrupts import Termination, check, heeded
from gearchaos.progress import complain, discard, speaking, standing_streams
from gearchaos.version import software_version

OK = 0
USAGE = 2
TOO_MANY_DIVERGED = 3
CANNOT_READ_OR_WRITE = FileError.exit_code
INTERRUPTED = 130
CLOSED_PIPE = 141
TERMINATED = 143
EXIT_CODES = (
    "Exit codes: 0 done, 2 the command line or the configuration asks for what cannot be, 3 done, "
    "but more lanes diverged than outputs.allowed_diverged_share, 4 a file cannot be read or "
    "written, is damaged or lacks something, or a package is missing, 130 interrupted, "
    "143 terminated."
)

_PACKAGE = Path(__file__).resolve().parent
_TABLE = tomllib.loads((_PACKAGE / "commands.toml").read_text("utf-8"))

COMMANDS: dict[str, dict[str, Any]] = _TABLE["command"]
"""Summary and options of every command by its name, as commands.toml explains them."""

SWEEPS, *_ = filter(Path.is_dir, (_PACKAGE / "sweeps", _PACKAGE.parent / "sweeps", _PACKAGE))
"""Folder of the configurations that come with gearchaos: of the installed package, or the clone."""


class Command(NamedTuple):
    """A command: called with arguments, by default those of this process, it returns its exit code.

    That is what the body returns, 0 for nothing, or with which argparse exits. A fault a user can
    cause becomes lines on stderr, its notes after it, and a code: that of a GearchaosError, 4 for
    an operating system error that nobody has worded or a lack of memory or of a package and, as the
    shell says, 130 for an interrupt, 143 for SIGTERM, 141 when the reader of the output has gone.

    ``name`` is that of `COMMANDS`; ``text`` is what --help says before the options and, from the
    first empty line on, after them, where the exit codes follow. ``body`` does it, with the options
    and, as their `arguments`, what was given; it imports what is heavy, so that --help answers at
    once.
    """

    name: str
    text: str
    body: Callable[[Namespace], int | None]

    def __call__(self, arguments: Sequence[str] | None = None) -> int:
        """Run the command and return its exit code."""
        with standing_streams(), speaking(f"gearchaos {self.name}"):
            return self._ended(list(sys.argv[1:] if arguments is None else arguments))

    def _ended(self, arguments: list[str]) -> int:
        """Run the command, report any fault, and return the exit code."""
        if isinstance(sys.stdout, TextIOWrapper):
            # Paths that are not Unicode go out byte for byte, as they came in.
            sys.stdout.reconfigure(errors="surrogateescape")
        try:
            with heeded(at_once=not COMMANDS[self.name].get("writes", True)):
                code = self._code(arguments)
                check()
            sys.stdout.flush()
            return code
        except GearchaosError as error:
            return _report(error, [f"error: {text}" for text in error.problems], error.exit_code)
        except Termination as termination:
            return _report(termination, ["terminated"], TERMINATED)
        except KeyboardInterrupt as interrupt:
            return _report(interrupt, ["interrupted"], INTERRUPTED)
        except BrokenPipeError:
            discard(sys.stdout)
            return CLOSED_PIPE
        except (OSError, MemoryError, ImportError) as error:
            text = str(error) or "out of memory"
            if isinstance(error, ImportError):  # Such as Numba, of a newer NumPy.
                text += "; a package is missing or does not fit, install gearchaos again"
            return _report(error, [f"error: {text}"], CANNOT_READ_OR_WRITE)

    def start(self, module: str) -> Self:
        """Run it as a process where its module, by ``__name__``, is what was started."""
        if module == "__main__":
            sys.exit(self())
        return self

    def _code(self, arguments: list[str]) -> int:
        try:
            # Of negative numbers, argparse takes those with an exponent for options.
            given = [re.sub(r"^-(?=[\d.]+[eE][-+]?\d+$)", " -", text) for text in arguments]
            options = self.parser().parse_args(given, Namespace(arguments=arguments))
            # Matplotlib would refuse to be imported where the environment names an unknown backend.
            os.environ["MPLBACKEND"] = "agg"
            with speaking(quiet=options.quiet):
                return self.body(options) or OK
        except SystemExit as leaving:
            return leaving.code if isinstance(leaving.code, int) else OK

    def parser(self) -> ArgumentParser:
        """Return what reads the command's arguments."""
        description, _, epilog = self.text.partition("\n\n")
        parser = ArgumentParser(
            prog=f"gearchaos {self.name}",
            description=description,
            epilog=f"{epilog}\n{EXIT_CODES}".strip(),
            allow_abbrev=False,
        )
        own = COMMANDS[self.name]
        common = (*own.get("common", ()), "-q --quiet")
        for flags, rules in {
            **own.get("options", {}),
            **{flags: _TABLE["common"][flags] for flags in common},
        }.items():
            known = {key: rule for key, rule in rules.items() if key not in ("low", "high")}
            if "type" in rules:
                bounds = {key: rules[key] for key in ("low", "high") if key in rules}
                reader = READERS[rules["type"]]
                known["type"] = partial(reader, **bounds) if bounds else reader
            parser.add_argument(*flags.split(), **known)
        parser.add_argument("--version", action="version", version=version_text())
        return parser


def number(text: str, low: float = -math.inf, high: float = math.inf) -> float:
    """Read a finite number within bounds off the command line."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ArgumentTypeError(f"{text!r} is not a finite number")
    if not low <= value <= high:
        raise ArgumentTypeError(f"{text} is not between {low:g} and {high:g}")
    return value


def whole_number(text: str, low: float, high: float = math.inf) -> int:
    """Read a whole number within bounds off the command line."""
    value = number(text, low, high)
    if value % 1.0:
        raise ArgumentTypeError(f"{text} is not a whole number")
    return int(value)


def whole_numbers(text: str, low: float, high: float) -> list[int]:
    """Read whole numbers within bounds, with commas between them, in ascending order."""
    return sorted({whole_number(one, low, high) for one in text.split(",")})


def place(text: str) -> tuple[str, float]:
    """Read NAME=VALUE off the command line, or a VALUE, which has an empty name.

    A way, such as "upwards", needs none.
    """
    from gearchaos.outputs.names import DIRECTION, WAYS

    name, _, value = text.rpartition("=")
    if name.strip() in ("", DIRECTION) and value in WAYS:
        return DIRECTION, float(WAYS.index(value))
    return name.strip(), number(value)


READERS: dict[str, Callable[..., Any]] = {
    "int": int,
    "path": Path,
    "number": number,
    "whole number": whole_number,
    "whole numbers": whole_numbers,
    "place": place,
    "pitch error": lambda text: ("pitch_error", number(text)),
}
"""What an option may hold, by its name in commands.toml."""


def coordinates(
    places: Sequence[tuple[str, float]], axes: Sequence[str], free: str = "", option: str = "--at"
) -> dict[str, float]:
    """Name the axis of each place of an option; a bare value lies on the one beside ``free``.

    Raises ConfigurationError if that is not one, or an axis comes twice.
    """
    from gearchaos.outputs.names import axis_name

    others = [axis for axis in axes if axis != free]
    found: dict[str, float] = {}
    for name, value in places:
        axis = axis_name(name) or (others[0] if len(others) == 1 else "")
        if not axis or axis in found:
            raise ConfigurationError(
                f"{option} {name}{'=' if name else ''}{value:g}: must be NAME=VALUE, each of the "
                f"axes {', '.join(axes)} once"
            )
        found[axis] = value
    return found


def version_text() -> str:
    """Return the one line that --version prints: gearchaos, Python and the platform."""
    from platform import python_version

    return f"gearchaos {software_version()} (Python {python_version()}, {sys.platform})"


def _report(fault: BaseException, texts: list[str], code: int) -> int:
    complain(*texts, *getattr(fault, "__notes__", []))
    return code
