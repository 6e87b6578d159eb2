"""Ctrl-C and SIGTERM, taken note of at any moment and acted upon between two pieces of work.

An exception raised wherever a signal happens to arrive can get lost in a callback of the
interpreter, or surface in a library as damage to a file. A command that writes therefore asks
at moments of its own choice; one that only reads has nothing to put in order and just ends.
"""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

_ENDING = b"\ngearchaos: ending what is running; interrupt again to stop at once\n"
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_arrived: list[int] = []


class Termination(KeyboardInterrupt):
    """SIGTERM, with which batch systems end a job: the command stops as after Ctrl-C."""


@contextmanager
def heeded(*, at_once: bool) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the process at once, or take note of them for `check`.

    A second one ends it at once in any case.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # What runs in the background may have been told to ignore Ctrl-C.
    before = {n: signal.getsignal(n) for n in _SIGNALS if signal.getsignal(n) != signal.SIG_IGN}
    for number in before:
        signal.signal(number, signal.SIG_DFL if at_once else _take_note)
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous or signal.SIG_DFL)
        _arrived.clear()


def check() -> None:
    """Raise what has arrived, a KeyboardInterrupt after Ctrl-C and a `Termination` after SIGTERM.

    Only the main thread is interrupted.
    """
    if _arrived and threading.current_thread() is threading.main_thread():
        raise Termination if _arrived[0] == signal.SIGTERM else KeyboardInterrupt


def _take_note(number: int, _frame: FrameType | None) -> None:
    _arrived.append(number)
    signal.signal(number, signal.SIG_DFL)
    # Not through sys.stderr, which may be in the middle of a line of its own.
    with suppress(OSError):
        os.write(2, _ENDING)
