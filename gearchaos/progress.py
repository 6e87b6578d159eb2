"""How far a sweep has come: a bar on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

from tqdm import tqdm

SECONDS_BETWEEN_LINES = 30.0
SECONDS_BEFORE_NOTICE = 0.5


class Progress:
    """Lanes done, with lanes per second and the time left.

    Parameters
    ----------
    lanes : int
        Lanes of the whole sweep.
    done : int
        Those finished before.
    quiet : bool
        Show nothing.
    """

    def __init__(self, lanes: int, done: int = 0, quiet: bool = False) -> None:
        self._lanes, self._done, self._began_with = lanes, done, done
        self._lines = not quiet and not sys.stderr.isatty()
        self._began = self._spoke = time.monotonic()
        self._bar = tqdm(
            total=lanes, initial=done, unit="lane", disable=quiet or self._lines, dynamic_ncols=True
        )

    def advance(self, lanes: int) -> None:
        """Tell that more lanes are done."""
        self._done += lanes
        self._bar.update(lanes)
        now = time.monotonic()
        if self._lines and (now - self._spoke > SECONDS_BETWEEN_LINES or self._done == self._lanes):
            self._spoke = now
            rate = (self._done - self._began_with) / max(now - self._began, 1e-9)
            left = (self._lanes - self._done) / rate
            text = f"{self._done} of {self._lanes} lanes, {rate:.0f} lanes/s, {left:.0f} s left"
            print(f"gearchaos sweep: {text}", file=sys.stderr, flush=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()


def say(text: str, quiet: bool = False) -> None:
    """Print a line on stderr."""
    if not quiet:
        print(f"gearchaos sweep: {text}", file=sys.stderr, flush=True)


@contextmanager
def notice(text: str, quiet: bool = False) -> Iterator[None]:
    """Print a line on stderr if what follows takes longer than a moment."""
    timer = threading.Timer(
        SECONDS_BEFORE_NOTICE, print, [text], {"file": sys.stderr, "flush": True}
    )
    timer.daemon = True
    if not quiet:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
