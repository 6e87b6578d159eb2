"""What is said on stderr while a command runs, and how far a sweep has come."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from typing import Self

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


class Progress:
    """Lanes or pages done of so many: a bar on a terminal, a plain line now and then elsewhere."""

    def __init__(self, lanes: int, done: int = 0, unit: str = "lane") -> None:
        from tqdm import tqdm

        self._unit = unit
        self._lanes, self._done, self._began_with = lanes, done, done
        # Of one there is nothing to tell but that it is done.
        self._lines = lanes > 1 and not sys.stderr.isatty()
        self._began = self._spoke = time.monotonic()
        hidden = _quiet.get() or self._lines or lanes < 2
        self._bar = tqdm(total=lanes, initial=done, unit=unit, disable=hidden, dynamic_ncols=True)

    def advance(self, lanes: int) -> None:
        """Tell that more lanes are done."""
        self._done += lanes
        self._bar.update(lanes)
        now = time.monotonic()
        if self._lines and (now - self._spoke > SECONDS_BETWEEN_LINES or self._done == self._lanes):
            self._spoke = now
            rate = (self._done - self._began_with) / max(now - self._began, 1e-9)
            left = (self._lanes - self._done) / rate
            done = f"{self._done} of {self._lanes} {self._unit}s"
            say(f"{done}, {rate:.{int(rate < 10)}f} {self._unit}s/s, {left:.0f} s left")

    def write(self, text: str) -> None:
        """Print a line on stdout, above the bar where both are on one terminal."""
        self._bar.write(text)
        sys.stdout.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()
