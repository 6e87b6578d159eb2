"""Let processes of the tests that need the same loop at the same time compile it once.

Loops are kept on disk, so that later processes find them. Those that need one which another process
is compiling would each compile it, too: here they wait for it, for a while.
"""

import time
from typing import IO, Any

from gearchaos_kernels.cache import KernelCache

try:
    import fcntl
except ImportError:  # Windows: every process compiles for itself.
    fcntl = None

LONGEST = 120.0
"""Seconds after which a process compiles for itself: whoever has the lock may be hanging."""

_load, _save = KernelCache.load_overload, KernelCache.save_overload
_held: dict[tuple[Any, Any], IO[str]] = {}


def install() -> None:
    """Replace how this process reads and writes loops, where files can be locked."""
    if fcntl is None:
        return
    KernelCache.load_overload, KernelCache.save_overload = load_overload, save_overload


def load_overload(self: KernelCache, sig: Any, target_context: Any) -> Any:
    """Load a loop, wait for whoever is compiling it, or take the lock to compile it."""
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
    """Keep a loop, and let others load it."""
    _save(self, sig, data)
    if lock := _held.pop((self, sig), None):
        lock.close()
