"""The last line of a result file, a checksum of all that comes before it.

HDF5 checks the numbers of a dataset, but neither texts nor the bookkeeping between datasets, and
damage in the latter can make its library run forever. A line after the end of the HDF5 data
disturbs no reader, and is checked before the library sees the file.
"""

import hashlib
import os
from pathlib import Path

_PREFIX = b"gearchaos sha256 "
_LENGTH = len(_PREFIX) + 2 * hashlib.sha256().digest_size + 1
_PIECE = 1 << 20


def append_checksum(path: Path) -> None:
    """Append the checksum line to a complete file."""
    with path.open("r+b") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        file.seek(0, os.SEEK_END)
        file.write(_PREFIX + digest.encode() + b"\n")


def checksum_fits(path: Path) -> bool | None:
    """Tell whether a file is as it was written; None if it has no checksum line.

    Other programs that change a result file drop the line, so that its absence is no damage.
    """
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _LENGTH))
        _, prefix, told = file.read().rpartition(_PREFIX)
        if not prefix:
            return None
        remaining = size - len(prefix) - len(told)
        file.seek(0)
        digest = hashlib.sha256()
        while remaining > 0 and (piece := file.read(min(_PIECE, remaining))):
            digest.update(piece)
            remaining -= len(piece)
    return told == digest.hexdigest().encode() + b"\n"
