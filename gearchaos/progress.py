"""What is said on stderr while a command runs, and how far a sweep has come."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout, suppress
from contextvars import ContextVar, copy_context
from functools import cache
from io import StringIO
from typing import Any, TextIO

SECONDS_BETWEEN_LINES = 30.0
SECONDS_BEFORE_NOTICE = 0.5

# Who speaks, and whether only complaints are to be heard: as a library, nothing is said unasked.
_name = ContextVar("name", default="gearchaos")
_quiet = ContextVar("quiet", default=True)


@contextmanager
def speaking(name: str | None = None, *, quiet: bool = False) -> Iterator[None]:
    """Let every line begin with a name, by default the one there is, or let none be said."""
    named, hushed = _name.set(name or _name.get()), _quiet.set(quiet)
    try:
        yield
    finally:
        _name.reset(named)
        _quiet.reset(hushed)


@contextmanager
def standing_streams() -> Iterator[None]:
    """Connect every standard stream that is closed to the null device.

    A file opened later would get the number of the closed stream, and then receive what libraries
    print there. A stream that the interpreter lacks is replaced within the context.
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


def print_error(text: str) -> None:
    """Print text on stderr; if stderr is closed or full, the text is lost and the work goes on."""
    # Without this test, print would write to stdout.
    if sys.stderr is None:
        return
    try:
        print(text, file=sys.stderr, flush=True)
    except (OSError, ValueError):
        discard(sys.stderr)


def discard(stream: TextIO) -> None:
    """Connect a stream that cannot be written to the null device.

    The interpreter flushes once more when it exits, and would replace the exit code.
    """
    with suppress(OSError, ValueError):
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, stream.fileno())
        os.close(sink)


def complain(*texts: str) -> None:
    """Print lines on stderr, also where it is quiet."""
    print_error("\n".join(f"{_name.get()}: {text}" for text in texts))


def say(*texts: str) -> None:
    """Print lines on stderr unless it is quiet."""
    if texts and not _quiet.get():
        complain(*texts)


@contextmanager
def notice(text: str) -> Iterator[None]:
    """Say something if what follows takes longer than a moment."""
    timer = threading.Timer(SECONDS_BEFORE_NOTICE, copy_context().run, [say, text])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def progress(total: int, done: int = 0, unit: str = "lanes") -> Any:
    """Print how many of so many lanes or pages are done.

    On a terminal that is a bar, elsewhere a plain line now and then, and one at the end.
    """
    bar, lines = _bars()
    # Of one there is nothing to tell but that it is done.
    told: dict[str, Any] = {"total": total, "initial": done, "unit": f" {unit}"}
    told["disable"] = _quiet.get() or total < 2
    if sys.stderr is not None and sys.stderr.isatty():
        return bar(**told, dynamic_ncols=True, miniters=1)
    text = "{n} of {total}{unit}, {rate_noinv_fmt}, {remaining} left"
    return lines(
        **told, mininterval=SECONDS_BETWEEN_LINES, miniters=1, bar_format=text, file=StringIO()
    )


@cache
def _bars() -> tuple[Any, Any]:
    """Return the classes of bars and of plain lines, made with the first of them."""
    from tqdm import tqdm

    class Bar(tqdm):  # type: ignore[misc]
        # No thread that looks after bars: it outlives them, and every update is looked at anyway.
        monitor_interval = 0

    class Lines(Bar):
        def display(self, **_: object) -> None:
            if self.n > self.last_print_n:
                say(str(self))

    return Bar, Lines
