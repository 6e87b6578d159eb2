"""Locks of an open file: held by one process alone, or shared by several.

A lock is one of three kinds. Unix has ``flock``. On Windows a range of bytes is locked: all bytes
by one process alone, one byte by each of those that share the lock. Where the file system has no
locks, a process makes a claim, a file beside the locked one. The first two kinds end with their
process. A claim of a process that was killed on this machine is removed by the next process; a
claim of another machine stays, and the message names it.
"""

import os
import platform
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from secrets import token_hex
from typing import Any


def _module(name: str) -> Any:
    """Return a module that only some systems have; None on the others."""
    try:
        return import_module(name)
    except ImportError:
        return None


fcntl, msvcrt = _module("fcntl"), _module("msvcrt")

SHARERS = 1024
"""The largest number of processes that share a lock on Windows."""
_HOST = re.sub(r"\W", "-", platform.node()) or "unnamed"
_CLAIM = re.compile(r"\.(alone|shared)\.([\w-]+)\.(\d+)-\w+\.claim$")


class FileLock:
    """A lock of an open file, for this process alone or shared with others.

    Parameters
    ----------
    descriptor : int
        The open file, readable and writable. It stays open as long as the lock is held.
    path : Path
        Its path, beside which claims are made.
    shared : bool
        Whether other processes may share the lock.

    Raises
    ------
    BlockingIOError
        If another process holds the lock. Its text names the remedy where there is one.
    """

    def __init__(self, descriptor: int, path: Path, shared: bool) -> None:
        self._descriptor, self._path = descriptor, path
        self._byte: int | None = None
        self._claim: Path | None = None
        try:
            self._lock(shared)
        except BlockingIOError:
            raise
        except OSError:  # The file system has no locks.
            self._claim = self._claimed(shared)

    def become_alone(self) -> None:
        """Turn a shared lock into one of this process alone, or raise BlockingIOError."""
        if self._claim is not None:
            shared, self._claim = self._claim, self._claimed(shared=False)
            shared.unlink(missing_ok=True)
        elif fcntl is not None:
            try:
                self._flock(fcntl.LOCK_EX)
            except BlockingIOError:
                # flock gives up the shared lock before it tries the other one.
                self._flock(fcntl.LOCK_SH)
                raise
        else:
            self._lock_all_bytes()

    def release(self) -> None:
        """Remove a claim; the other locks end when the file is closed."""
        if self._claim is not None:
            self._claim.unlink(missing_ok=True)
            self._claim = None

    def _lock(self, shared: bool) -> None:
        """Lock the file by the means of the system."""
        if fcntl is not None:
            self._flock(fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
        elif msvcrt is None:
            raise OSError("this system has no locks")
        elif shared:
            self._byte = next(filter(self._try_byte, range(SHARERS)), None)
            if self._byte is None:
                raise BlockingIOError
        else:
            self._lock_all_bytes()

    def _flock(self, kind: int) -> None:
        fcntl.flock(self._descriptor, kind | fcntl.LOCK_NB)

    def _lock_all_bytes(self) -> None:
        """Lock the whole range; bytes that this process has locked are given back before."""
        byte = self._byte
        if byte is not None:
            self._range(msvcrt.LK_UNLCK, byte, 1)
        try:
            self._range(msvcrt.LK_NBLCK, 0, SHARERS)
        except PermissionError:
            if byte is not None:
                self._range(msvcrt.LK_NBLCK, byte, 1)
            raise BlockingIOError from None
        self._byte = None

    def _try_byte(self, byte: int) -> bool:
        try:
            self._range(msvcrt.LK_NBLCK, byte, 1)
        except PermissionError:
            return False
        return True

    def _range(self, how: int, first: int, length: int) -> None:
        os.lseek(self._descriptor, first, os.SEEK_SET)
        msvcrt.locking(self._descriptor, how, length)

    def _claimed(self, shared: bool) -> Path:
        """Make a claim, unless one of another process forbids it."""
        kind = "shared" if shared else "alone"
        number = f"{os.getpid()}-{token_hex(4)}"
        own = self._path.with_name(f"{self._path.name}.{kind}.{_HOST}.{number}.claim")
        # Made before the others are read: of two that begin at once neither overlooks the other.
        os.close(os.open(own, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        for other, alone in self._claims_beside(own):
            if alone or not shared:
                own.unlink(missing_ok=True)
                raise BlockingIOError(f"if its process has ended, delete {other}")
        return own

    def _claims_beside(self, own: Path) -> Iterator[tuple[Path, bool]]:
        """Yield the claims of others, and whether they are for one alone."""
        for path in self._path.parent.glob(f"{self._path.name}.*.claim"):
            found = _CLAIM.search(path.name)
            if found is None or path in (own, self._claim):
                continue
            if found[2] == _HOST and _has_ended(int(found[3])):
                path.unlink(missing_ok=True)
            else:
                yield path, found[1] == "alone"


def _has_ended(process: int) -> bool:
    """Whether a process of this machine has ended; never on Windows, which has no such question."""
    if os.name != "posix":
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    except OSError:
        return False
    return False
