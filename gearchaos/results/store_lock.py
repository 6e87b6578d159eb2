"""The lock that keeps two sweeps from working on the same output."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import writing

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOCK = "lock"


class StoreLock:
    """A locked file in a folder that is made if need be; a killed process leaves it unlocked.

    Where the system has no such locks, two sweeps on one output are not noticed.

    Parameters
    ----------
    folder : Path
        The folder of the shards.
    output : Path
        The result file to be, for the message.

    Raises
    ------
    FileError
        If another process holds the lock, or if the folder cannot be made.
    """

    def __init__(self, folder: Path, output: Path) -> None:
        self._path = folder / LOCK
        self._descriptor: int | None = None
        with writing(folder):
            while self._descriptor is None:
                folder.mkdir(exist_ok=True)
                # A sweep that finishes may remove the folder, or the file that was just opened.
                with suppress(FileNotFoundError):
                    self._acquire(output)

    @property
    def held(self) -> bool:
        """Whether the lock has not been released yet."""
        return self._descriptor is not None

    def release(self) -> None:
        """Let other sweeps in."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _acquire(self, output: Path) -> None:
        descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(descriptor)
            if os.path.samestat(os.fstat(descriptor), self._path.stat()):
                self._descriptor = descriptor
        except BlockingIOError as error:
            raise FileError(
                f"{output}: another sweep is writing to it; wait for its end or choose another "
                "--output"
            ) from error
        finally:
            if self._descriptor is None:
                os.close(descriptor)


def _lock(descriptor: int) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass  # A file system without locks.
