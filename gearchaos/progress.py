"""What is said on stderr while a command runs, and how far a sweep has come."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import cache
from io import StringIO
from typing import Any

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


def complain(*texts: str) -> None:
    """Print lines on stderr, also where it is quiet."""
    print(*(f"{_name.get()}: {text}" for text in texts), sep="\n", file=sys.stderr, flush=True)


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
    if sys.stderr.isatty():
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
