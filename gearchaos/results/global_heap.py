"""Where an HDF5 file keeps its texts, walked through before the HDF5 library does it for ever."""

from __future__ import annotations

import mmap
import os
import struct
from pathlib import Path

_COLLECTION = b"GCOL\x01\x00\x00\x00"
_OBJECT = struct.Struct("<HHIQ")


def heaps_end(path: str | os.PathLike[str]) -> bool:
    """Tell whether every global heap of an HDF5 file can be walked from its start to its end.

    In a collection with a free object of no size, which only damage makes, the library
    (H5HG__cache_heap_deserialize, HDF5 2.0) stays at that object for ever.
    """
    if Path(path).stat().st_size == 0:
        return True
    with (
        Path(path).open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content,
    ):
        start = content.find(_COLLECTION)
        while start >= 0:
            if not _ends(content, start):
                return False
            start = content.find(_COLLECTION, start + len(_COLLECTION))
    return True


def _ends(content: mmap.mmap, start: int) -> bool:
    head = len(_COLLECTION) + 8
    size = int.from_bytes(content[start + len(_COLLECTION) : start + head], "little")
    end = min(start + size, len(content))
    place = start + head
    while place + _OBJECT.size <= end:
        number, _, _, used = _OBJECT.unpack_from(content, place)
        if number == used == 0:
            return False
        # The size of free space counts its own head.
        place += used if number == 0 else _OBJECT.size + -(-used // 8) * 8
    return True
