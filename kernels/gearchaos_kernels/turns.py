"""Parallel kernels run for one Python thread at a time, and not in a process forked after use.

Each kernel uses all cores, so taking turns costs no time. Two calls at once would write to the same
place in the store of flow maps, and Numba's threading layer "workqueue" terminates the process if
two threads enter it. GNU OpenMP, the layer "omp" on Linux, owns threads that a fork does not copy.
Numba terminates a forked process that enters it, and a process pool then starts another one,
without end.
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
    """Raised in a process that was forked from one in which kernels had already run.

    Examples
    --------
    Start worker processes anew instead of forking them::

        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(mp_context=context) as pool:
            ...
    """


class _Turns:
    """The lock of this process, and whether a fork left it without the threads of its kernels."""

    def __init__(self) -> None:
        self.lock = RLock()
        self.forked = False

    def begin_in_fork(self) -> None:
        """Replace the lock: a thread that the fork did not copy may hold the old one."""
        self.lock = RLock()
        self.forked = self.forked or (sys.platform == "linux" and _threading_layer() == "omp")


def _threading_layer() -> str:
    """Return the name of Numba's threading layer, or "" before the first parallel kernel."""
    try:
        return str(numba.threading_layer())
    except ValueError:
        return ""


_turns = _Turns()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_turns.begin_in_fork)


def require_threads() -> None:
    """Check that kernels can run in this process.

    Raises
    ------
    ForkedProcessError
        If the process was forked from one in which kernels had already run with OpenMP.

    Examples
    --------
    >>> require_threads()
    """
    if _turns.forked:
        raise ForkedProcessError(
            f"process {os.getpid()} was forked from a process that had computed before, and "
            "OpenMP cannot be used in both; start processes with the method 'spawn', such as "
            'multiprocessing.get_context("spawn").Pool() or '
            'ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn"))'
        )


def in_turn(function: Callable[_Given, _Returned]) -> Callable[_Given, _Returned]:
    """Return a function that threads call one after the other; it may raise ForkedProcessError."""

    # The attributes of a compiled function are not copied: they make no sense on another one.
    @wraps(function, updated=())
    def alone(*given: _Given.args, **named: _Given.kwargs) -> _Returned:
        require_threads()
        with _turns.lock:
            return function(*given, **named)

    return alone
