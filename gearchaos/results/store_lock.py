"""Locks: two sweeps do not work on the same output, unless each knows its part of the blocks."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import writing

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOCK = "lock"


class StoreLock:
    """Locked files in a folder that is made if need be; a killed process leaves them unlocked.

    A sweep that takes all blocks has the folder to itself. Sweeps that take a part each share the
    folder among themselves, and nobody else takes the same part.

    Where the system has no such locks, two sweeps on one output are not noticed.

    Parameters
    ----------
    folder : Path
        The folder of the shards.
    output : Path
        The result file to be, for the message.
    part : str, optional
        Name of the part of the blocks that is taken, such as ``2-of-8``.

    Raises
    ------
    FileError
        If another process holds the lock, or if the folder cannot be made.
    """

    def __init__(self, folder: Path, output: Path, part: str | None = None) -> None:
        self._folder = folder
        self._output = output
        self._descriptors: list[int] = []
        with writing(folder):
            try:
                self._acquire(LOCK, shared=part is not None)
                if part is not None:
                    self._acquire(f"{LOCK}-{part}", shared=False)
            except BaseException:
                self.release()
                raise
        self._exclusive = part is None

    @property
    def held(self) -> bool:
        """Whether the lock has not been released yet."""
        return bool(self._descriptors)

    def alone(self) -> bool:
        """Tell whether nobody else works in the folder, and keep it so."""
        if self.held and not self._exclusive:
            with suppress(BlockingIOError):
                _lock(self._descriptors[0], shared=False)
                self._exclusive = True
        return self.held and self._exclusive

    def release(self) -> None:
        """Let other sweeps in."""
        while self._descriptors:
            os.close(self._descriptors.pop())

    def _acquire(self, name: str, shared: bool) -> None:
        path = self._folder / name
        while True:
            self._folder.mkdir(exist_ok=True)
            # A sweep that finishes may remove the folder, or the file that was just opened.
            with suppress(FileNotFoundError):
                descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
                try:
                    _lock(descriptor, shared)
                    if os.path.samestat(os.fstat(descriptor), path.stat()):
                        self._descriptors.append(descriptor)
                        return
                except BlockingIOError as error:
                    raise FileError(
                        f"{self._output}: another sweep is writing to it; wait for its end or "
                        "choose another --output"
                    ) from error
                finally:
                    if descriptor not in self._descriptors:
                        os.close(descriptor)


@contextmanager
def waiting_lock(path: Path) -> Iterator[None]:
    """Hold the lock of a file, which is made if need be, once nobody else does.

    Where there are no locks or no such file can be made, nobody waits.
    """
    descriptor = None
    with suppress(OSError):
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        if fcntl is not None:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _lock(descriptor: int, shared: bool) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass  # A file system without locks.
