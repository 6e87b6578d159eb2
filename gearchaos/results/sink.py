"""A file that remembers its first failure instead of raising it in the middle of HDF5.

The HDF5 library ends the process with a segmentation fault when the disk turns out to be full
while it closes a file. So it is never told: it writes into a sink, whose error is raised later.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from typing import Any


class Sink(FileIO):
    """A file that is emptied and open for writing, without the failures."""

    def __init__(self, path: Path) -> None:
        self._error: BaseException | None = None
        # Unbuffered: the error of a buffered write would surface in any later call.
        super().__init__(path, "w+")

    def __exit__(self, *fault: Any) -> None:
        with self._remembering():
            self.close()
        # An error that HDF5 has met in what it reads back is but a consequence of ours.
        if fault[0] is None or issubclass(fault[0], Exception):
            self.check()

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self._error is not None:
            raise self._error

    def write(self, data: Any) -> int:
        """Write all of it, or nothing once something has failed."""
        with self._remembering():
            left = memoryview(data).cast("B")
            while left and self._error is None:
                left = left[super().write(left) :]
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        """Set the size, unless something has failed."""
        with self._remembering():
            if self._error is None:
                super().truncate(size)
        return size or 0

    @contextmanager
    def _remembering(self) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            # An interrupt, too, must not reach the library.
            self._error = self._error or error
