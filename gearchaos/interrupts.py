"""Ctrl-C and SIGTERM: noted when they arrive, and acted upon between two pieces of work.

An exception that is raised wherever a signal arrives can get lost in a callback of the interpreter,
or interrupt a library that then damages a file. A command that writes therefore calls `check` at
safe moments. A command that only reads ends at once.
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
    """SIGTERM, which batch systems send to end a job: the command stops as after Ctrl-C."""


@contextmanager
def heeded(*, at_once: bool) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the process at once, or note them for `check`.

    A second signal ends the process at once in both cases.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # Shells let processes in the background ignore Ctrl-C; that stays so.
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
    """Raise KeyboardInterrupt if Ctrl-C has arrived, or `Termination` if SIGTERM has.

    This happens only in the main thread.
    """
    if _arrived and threading.current_thread() is threading.main_thread():
        raise Termination if _arrived[0] == signal.SIGTERM else KeyboardInterrupt


def _take_note(number: int, _frame: FrameType | None) -> None:
    _arrived.append(number)
    signal.signal(number, signal.SIG_DFL)
    # Not through sys.stderr: the signal may have interrupted its write.
    with suppress(OSError):
        os.write(2, _ENDING)
