"""Parallel kernels run for one thread at a time, and not in a process forked after their use.

Each of them uses all cores, so waiting costs nothing. Two calls at once would fill the store of
flow maps at the same place, and Numba's threading layer "workqueue" ends the process if two
threads enter it. GNU OpenMP, the layer "omp" on Linux, keeps threads that a fork does not copy:
Numba ends a forked process that enters it, and a pool of processes starts another one for ever.
"""

import os
import sys
from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import ParamSpec, TypeVar

import numba

_Given = ParamSpec("_Given")
_Returned = TypeVar("_Returned")


class ForkedProcessError(RuntimeError):
    """This process was forked from one whose threads it would need."""


class _Turns:
    """The lock of this process, and whether it was forked without the threads of its kernels."""

    def __init__(self) -> None:
        self.lock = RLock()
        self.forked = False

    def begin_in_fork(self) -> None:
        """Replace the lock, which another thread may hold that a fork does not copy."""
        self.lock = RLock()
        self.forked = self.forked or (sys.platform == "linux" and _threading_layer() == "omp")


def _threading_layer() -> str:
    """Return the name of Numba's threading layer, "" before the first parallel kernel."""
    try:
        return str(numba.threading_layer())
    except ValueError:
        return ""


_turns = _Turns()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_turns.begin_in_fork)


def require_threads() -> None:
    """Raise ForkedProcessError in a process that was forked after kernels had run."""
    if _turns.forked:
        raise ForkedProcessError(
            f"process {os.getpid()} was forked from a process that had computed before, and "
            "OpenMP cannot be used in both; start processes with the method 'spawn', such as "
            'multiprocessing.get_context("spawn").Pool() or '
            'ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn"))'
        )


def in_turn(function: Callable[_Given, _Returned]) -> Callable[_Given, _Returned]:
    """Let threads call a function one after the other; raises ForkedProcessError."""

    # Without its attributes: those of a compiled function are of no use apart from it.
    @wraps(function, updated=())
    def alone(*given: _Given.args, **named: _Given.kwargs) -> _Returned:
        require_threads()
        with _turns.lock:
            return function(*given, **named)

    return alone
