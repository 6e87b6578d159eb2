"""Common parts of all commands: they read options, run a body and return an exit code."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Generic, NamedTuple, Self, TypeVar

from gearchaos.errors import FileError, GearchaosError
from gearchaos.interrupts import Termination, check, heeded
from gearchaos.progress import complain, discard, log, speaking, standing_streams

if TYPE_CHECKING:
    from gearchaos.argument_parser import OptionParser

OK = 0
USAGE = 2
TOO_MANY_DIVERGED = 3
CANNOT_READ_OR_WRITE = FileError.exit_code
INTERRUPTED = 130
CLOSED_PIPE = 141
TERMINATED = 143
EXIT_CODES = """\
Exit codes:

  0    done
  2    the command line or the configuration is wrong
  3    done, but more lanes diverged than outputs.allowed_diverged_share
  4    a file cannot be read or written or is damaged, or a package is missing
  130  interrupted
  143  terminated"""
"""The end of every --help."""

_PACKAGE = Path(__file__).resolve().parent

SWEEPS, *_ = filter(Path.is_dir, (_PACKAGE / "sweeps", _PACKAGE.parent / "sweeps", _PACKAGE))
"""Folder of the configurations that come with gearchaos: of the installed package, or the clone."""

Options = TypeVar("Options")


class Command(NamedTuple, Generic[Options]):
    """A command. Called with arguments, by default those of the process, it returns an exit code.

    The exit code is what the body returns, 0 for None, or the code of a SystemExit. A fault that a
    user can cause becomes lines on stderr, followed by its notes, and one of these codes: the code
    of a GearchaosError; 4 for another operating system error, for a lack of memory and for a
    missing package; and, as shells have it, 130 for an interrupt, 143 for SIGTERM, and 141 when the
    reader of the output has gone.

    ``name`` is a key of `COMMANDS`. ``text`` is the text of --help: its first paragraph comes
    before the options, the others after them, followed by the exit codes. ``options`` is the type
    of the options, see `gearchaos.options`. ``body`` runs the command with them. It imports heavy
    packages itself, so that --help answers at once. A command that ``writes`` is interrupted
    between two pieces of work; any other command ends at once.
    """

    name: str
    text: str
    options: type[Options]
    body: Callable[[Options], int | None]
    writes: bool = True

    def __call__(self, arguments: Sequence[str] | None = None) -> int:
        """Run the command and return its exit code."""
        with standing_streams(), speaking(f"gearchaos {self.name}"):
            return self._ended(list(sys.argv[1:] if arguments is None else arguments))

    def _ended(self, arguments: list[str]) -> int:
        """Run the command, report any fault, and return the exit code."""
        if isinstance(sys.stdout, TextIOWrapper):
            # Paths that are not Unicode are written byte for byte as they were read.
            sys.stdout.reconfigure(errors="surrogateescape")
        try:
            with heeded(at_once=not self.writes):
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
            if isinstance(error, ImportError):  # Such as Numba with a NumPy that is too new.
                text += "; a package is missing or does not fit, install gearchaos again"
            return _report(error, [f"error: {text}"], CANNOT_READ_OR_WRITE)

    def start(self, module: str) -> Self:
        """Run the command and exit if its module, given by ``__name__``, is the main program."""
        if module == "__main__":
            sys.exit(self())
        return self

    def _code(self, arguments: list[str]) -> int:
        """Read the options, run the body, and return the exit code."""
        try:
            parser = self.parser()
            options, quiet = parser.read(arguments)
            # Importing matplotlib fails if this variable names an unknown backend.
            os.environ["MPLBACKEND"] = "agg"
            with _logged(parser.log_file), speaking(quiet=quiet):
                try:
                    return self.body(options) or OK
                except GearchaosError as error:
                    # Printed later, when the file is closed.
                    for text in error.problems:
                        log("error", text)
                    raise
        except SystemExit as leaving:
            return leaving.code if isinstance(leaving.code, int) else OK

    def parser(self) -> "OptionParser[Options]":
        """Return the parser of the command's arguments."""
        from gearchaos.argument_parser import OptionParser

        text = f"{self.text.strip()}\n\n{EXIT_CODES}"
        return OptionParser(f"gearchaos {self.name}", text, self.options)


@contextmanager
def _logged(path: str | None) -> Iterator[None]:
    """Append all messages to a file, with time and level; without a path nothing is logged.

    Raises FileError if the file cannot be written.
    """
    if path is None:
        yield
        return
    import logging

    try:
        handler = logging.FileHandler(path, encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise FileError(f"--log {path}: cannot be written: {reason}; choose another file") from None
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logger = logging.getLogger("gearchaos")
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.setLevel(before)
        logger.removeHandler(handler)
        handler.close()


def _report(fault: BaseException, texts: list[str], code: int) -> int:
    complain(*texts, *getattr(fault, "__notes__", []))
    return code
