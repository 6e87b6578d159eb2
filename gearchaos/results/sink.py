"""A file that remembers its first failure instead of raising it in the middle of HDF5.

The HDF5 library ends the process with a segmentation fault when the disk turns out to be full
while it closes a file. So it is never told: it writes into a sink, whose error is raised later.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self


class Sink:
    """What h5py needs of a file that is open for writing, without the failures.

    Parameters
    ----------
    path : Path
        The file; it is emptied.
    """

    def __init__(self, path: Path) -> None:
        # Unbuffered: the error of a buffered write would surface in any later call.
        self._file = path.open("w+b", buffering=0)
        self._error: BaseException | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._try(self._file.close)
        # An error that HDF5 has met in what it reads back is but a consequence of ours.
        if self._error is not None and (kind is None or issubclass(kind, Exception)):
            raise self._error

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self._error is not None:
            raise self._error

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def read(self, size: int = -1) -> bytes:
        return self._file.read(size)

    def readinto(self, buffer: memoryview) -> int:
        return self._file.readinto(buffer)

    def write(self, data: memoryview) -> int:
        self._try(lambda: self._write_all(memoryview(data).cast("B")))
        return len(data)

    def truncate(self, size: int) -> None:
        self._try(lambda: self._file.truncate(size))

    def flush(self) -> None:
        """Do nothing: nothing is buffered."""

    def _write_all(self, data: memoryview) -> None:
        while data:
            data = data[self._file.write(data) :]

    def _try(self, action: Callable[[], object]) -> None:
        if self._error is None:
            try:
                action()
            except BaseException as error:
                # An interrupt, too, must not reach the library.
                self._error = error
