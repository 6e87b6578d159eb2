"""Let test processes that need the same loop at the same time compile it only once.

Compiled loops are kept on disk for later processes. Without this module, a process would also
compile a loop that another process is compiling. With it, the process waits for the other one, for
a limited time.
"""

import time
from typing import IO, Any

from gearchaos_kernels.cache import KernelCache

try:
    import fcntl
except ImportError:  # Windows: every process compiles for itself.
    fcntl = None

LONGEST = 120.0
"""Seconds after which a process compiles for itself: the process with the lock may be hanging."""

_load, _save = KernelCache.load_overload, KernelCache.save_overload
_held: dict[tuple[Any, Any], IO[str]] = {}


def install() -> None:
    """Replace the methods that load and save loops in this process, if files can be locked."""
    if fcntl is None:
        return
    KernelCache.load_overload, KernelCache.save_overload = load_overload, save_overload


def load_overload(self: KernelCache, sig: Any, target_context: Any) -> Any:
    """Load a loop, wait for the process that compiles it, or take the lock to compile it."""
    found = _load(self, sig, target_context)
    if found is not None:
        return found
    lock = self._path(sig, target_context.codegen()).with_suffix(".lock").open("w")
    until = time.monotonic() + LONGEST
    while not _locked(lock) and time.monotonic() < until:
        time.sleep(0.1)
    found = _load(self, sig, target_context)
    if found is None:
        _held[self, sig] = lock
    else:
        lock.close()
    return found


def _locked(lock: IO[str]) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def save_overload(self: KernelCache, sig: Any, data: Any) -> None:
    """Save a loop, and release its lock so that other processes load it."""
    _save(self, sig, data)
    if lock := _held.pop((self, sig), None):
        lock.close()
