"""What is said on stderr while a command runs, and how far a sweep has come."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
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
    """Tell of so many lanes or pages how many are done.

    On a terminal that is a bar, elsewhere a plain line now and then, and one at the end.
    """
    from tqdm import tqdm

    class Lines(tqdm):  # type: ignore[misc]
        def display(self, **_: object) -> None:
            if self.n > self.last_print_n:
                say(str(self))

    # Of one there is nothing to tell but that it is done.
    told: dict[str, Any] = {"total": total, "initial": done, "unit": f" {unit}"}
    told["disable"] = _quiet.get() or total < 2
    if sys.stderr.isatty():
        return tqdm(**told, dynamic_ncols=True)
    text = "{n} of {total}{unit}, {rate_noinv_fmt}, {remaining} left"
    seldom = {"mininterval": SECONDS_BETWEEN_LINES, "miniters": 1}
    return Lines(**told, **seldom, bar_format=text, file=StringIO())
