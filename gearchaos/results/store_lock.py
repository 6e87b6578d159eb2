"""Locks: two sweeps do not work on the same output, unless each knows its shard."""

import os
import stat
from contextlib import suppress
from pathlib import Path

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import UNDISTURBED, writing

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOCK = "lock"


class StoreLock:
    """A locked file in a folder that is made if need be; a killed process leaves it unlocked.

    A sweep that takes all blocks has the folder to itself. Shards share it among each other; two
    that are the same do the same work and write the same bits. Where the system has no such locks,
    two sweeps on one output are not noticed. `new` tells whether there was no such file before.
    Raises FileError if another process holds the lock, if the folder is another user's or a link,
    or if it cannot be made.
    """

    def __init__(self, folder: Path, output: Path, shared: bool = False) -> None:
        path = folder / LOCK
        self._descriptor: int | None = None
        with writing(folder):
            while self._descriptor is None:
                with suppress(FileExistsError):
                    folder.mkdir(mode=0o700)
                # A sweep that finishes may remove the folder, or the file that was just opened.
                with suppress(FileNotFoundError):
                    _require_own(folder)
                    self.new = not os.path.lexists(path)
                    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | UNDISTURBED, 0o600)
                    try:
                        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                            raise FileError(f"{path}: is not a regular file; delete it")
                        _lock(descriptor, shared)
                        if os.path.samestat(os.fstat(descriptor), path.lstat()):
                            self._descriptor = descriptor
                    except BlockingIOError as error:
                        raise FileError(
                            f"{output}: another sweep is writing to it; wait for its end or "
                            "choose another --output"
                        ) from error
                    finally:
                        if self._descriptor is None:
                            os.close(descriptor)

    def alone(self) -> bool:
        """Tell whether nobody else works in the folder, and keep it so."""
        with suppress(BlockingIOError):
            if self._descriptor is not None:
                _lock(self._descriptor, shared=False)
                return True
        return False

    def release(self) -> None:
        """Let other sweeps in."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


def _require_own(folder: Path) -> None:
    """Refuse a link, which leads who knows where, and what another user can put files into."""
    found = folder.lstat()
    ours = fcntl is None or found.st_uid == os.geteuid()
    if not (ours and stat.S_ISDIR(found.st_mode)):
        raise FileError(f"{folder}: is a link or not your folder; choose another --output")


def _lock(descriptor: int, shared: bool) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass  # A file system without locks.
