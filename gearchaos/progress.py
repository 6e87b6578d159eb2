"""Messages and progress on stderr while a command runs, and standard streams that are closed."""

import os
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout, suppress
from contextvars import ContextVar, copy_context
from functools import cache
from io import StringIO
from typing import Any, TextIO

SECONDS_BETWEEN_LINES = 30.0
SECONDS_BEFORE_NOTICE = 0.5

# The name before every line, and whether only warnings are printed: the library itself is quiet.
_name = ContextVar("name", default="gearchaos")
_quiet = ContextVar("quiet", default=True)


@contextmanager
def speaking(name: str | None = None, *, quiet: bool = False) -> Iterator[None]:
    """Set the name that begins every line, by default the current one, and whether to be quiet."""
    named, hushed = _name.set(name or _name.get()), _quiet.set(quiet)
    try:
        yield
    finally:
        _name.reset(named)
        _quiet.reset(hushed)


@contextmanager
def standing_streams() -> Iterator[None]:
    """Connect every standard stream that is closed to the null device.

    Otherwise a file that is opened later would get the number of the closed stream, and receive
    what libraries print to it. A stream that the interpreter lacks is replaced within the context.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    with ExitStack() as stack:
        for stream, redirect in (sys.stdout, redirect_stdout), (sys.stderr, redirect_stderr):
            if stream is None:
                sink = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
                stack.enter_context(redirect(sink))
        yield


def count_of(number: int, noun: str, several: str = "") -> str:
    """Return a number with its noun: 1 lane, 2 branches; ``several``: plural, by default with s."""
    return f"{number} {noun if number == 1 else several or noun + 's'}"


def print_error(text: str) -> None:
    """Print text on stderr; if stderr is closed or full, the text is lost without an error."""
    # With file=None, print would write to stdout.
    if sys.stderr is None:
        return
    try:
        print(text, file=sys.stderr, flush=True)
    except (OSError, ValueError):
        discard(sys.stderr)


def discard(stream: TextIO) -> None:
    """Connect a stream that cannot be written to the null device.

    Otherwise the interpreter would flush it at exit, fail, and replace the exit code.
    """
    with suppress(OSError, ValueError):
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, stream.fileno())
        os.close(sink)


def complain(*texts: str) -> None:
    """Print and log warnings or errors on stderr, one per line, also with --quiet."""
    for text in texts:
        log("error" if text.startswith("error: ") else "warning", text)
    if texts:
        _print(texts)


def say(*texts: str) -> None:
    """Log lines, and print them on stderr, but not with --quiet."""
    for text in texts:
        log("info", text)
    if texts and not _quiet.get():
        _print(texts)


def _print(texts: Sequence[str]) -> None:
    print_error("\n".join(f"{_name.get()}: {text}" for text in texts))


def log(level: str, text: str) -> None:
    """Pass a message to the logger of the command, such as ``gearchaos.sweep``.

    It is not imported here, which would take time: without it no handler exists.
    """
    if logging := sys.modules.get("logging"):
        # The handler of the module for loggers without one would repeat warnings on stderr.
        if not (root := logging.getLogger("gearchaos")).handlers:
            root.addHandler(logging.NullHandler())
        getattr(logging.getLogger(_name.get().replace(" ", ".")), level)("%s", text)


@contextmanager
def notice(text: str) -> Iterator[None]:
    """Print a line if the body of the context takes longer than a moment."""
    timer = threading.Timer(SECONDS_BEFORE_NOTICE, copy_context().run, [say, text])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def progress(total: int | None, done: int = 0, unit: str = "lanes") -> Any:
    """Return a tqdm bar that prints how many units of ``total`` are done.

    On a terminal this is a bar; elsewhere, a plain line every half minute and one at the end. If
    the total is not known (None), units are counted in plain lines, and work of less than half a
    minute prints none.
    """
    bar, lines = _bars()
    # The progress of a single unit is of no interest.
    disable = _quiet.get() or (total is not None and total < 2)
    common: dict[str, Any] = {"total": total, "initial": done, "unit": f" {unit}"}
    common |= {"disable": disable, "miniters": 1}
    if total is not None and sys.stderr is not None and sys.stderr.isatty():
        return bar(**common, dynamic_ncols=True)
    text = "{n} of {total}{unit}, {rate_noinv_fmt}, {remaining} left"
    if total is None:
        text = "{n}{unit}, {rate_noinv_fmt}, {elapsed}"
    return lines(**common, mininterval=SECONDS_BETWEEN_LINES, bar_format=text, file=StringIO())


@cache
def _bars() -> tuple[Any, Any]:
    """Return the classes of bars and of plain lines; tqdm is imported with the first of them."""
    from tqdm import tqdm

    class Bar(tqdm):  # type: ignore[misc]
        # No monitor thread: it would outlive the bar, and every update is checked anyway.
        monitor_interval = 0

    class Lines(Bar):
        def display(self, **_: object) -> None:
            late = self.format_dict["elapsed"] >= SECONDS_BETWEEN_LINES
            if self.n > self.last_print_n and (self.total is not None or late):
                say(str(self))

    return Bar, Lines
