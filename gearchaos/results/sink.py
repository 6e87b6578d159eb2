"""A file that remembers its first failure instead of raising it in the middle of HDF5.

The HDF5 library ends the process with a segmentation fault when the disk turns out to be full
while it closes a file. So it is never told: it writes into a sink, whose error is raised later.
"""

from __future__ import annotations

from collections.abc import Callable
from io import FileIO
from pathlib import Path
from types import TracebackType
from typing import Any


class Sink(FileIO):
    """A file that is emptied and open for writing, without the failures."""

    def __init__(self, path: Path) -> None:
        self._error: BaseException | None = None
        # Unbuffered: the error of a buffered write would surface in any later call.
        super().__init__(path, "w+")

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._try(self.close)
        # An error that HDF5 has met in what it reads back is but a consequence of ours.
        if kind is None or issubclass(kind, Exception):
            self.check()

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self._error is not None:
            raise self._error

    def write(self, data: Any) -> int:
        """Write all of it, or nothing once something has failed."""
        self._try(lambda: self._write_all(memoryview(data).cast("B")))
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        """Set the size, unless something has failed."""
        self._try(lambda: super(Sink, self).truncate(size))
        return size or 0

    def _write_all(self, data: memoryview) -> None:
        while data:
            data = data[super().write(data) :]

    def _try(self, action: Callable[[], object]) -> None:
        if self._error is None:
            try:
                action()
            except BaseException as error:
                # An interrupt, too, must not reach the library.
                self._error = error
