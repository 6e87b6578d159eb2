"""Where an HDF5 file keeps texts and references, walked before the HDF5 library does it for ever.

Our own texts could have a fixed length, the lists of dimension scales that make the file netCDF-4
could not: every result file has such a heap.
"""

from __future__ import annotations

import mmap
import os
import struct
from pathlib import Path

_COLLECTION = b"GCOL\x01\x00\x00\x00"
_SIZE = struct.Struct("<8xQ")
_OBJECT = struct.Struct("<HHIQ")


def heaps_end(path: str | os.PathLike[str]) -> bool:
    """Tell whether every global heap of an HDF5 file can be walked from its start to its end.

    In a collection with a free object of no size, which only damage makes, the library
    (H5HG__cache_heap_deserialize, HDF5 2.0) stays at that object for ever. Collections that lie
    within one another are damage as well, so that no byte is walked over twice.
    """
    with Path(path).open("rb") as file:
        if not os.fstat(file.fileno()).st_size:
            return True
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            start = content.find(_COLLECTION)
            while 0 <= start <= len(content) - _SIZE.size:
                end = start + _SIZE.unpack_from(content, start)[0]
                following = content.find(_COLLECTION, start + _SIZE.size)
                if 0 <= following < end or not _walkable(content, start + _SIZE.size, end):
                    return False
                start = following
    return True


def _walkable(content: mmap.mmap, place: int, end: int) -> bool:
    while place + _OBJECT.size <= min(end, len(content)):
        number, _, _, used = _OBJECT.unpack_from(content, place)
        # The size of free space counts its own head.
        if number == 0 and used < _OBJECT.size:
            return False
        place += used if number == 0 else _OBJECT.size + -(-used // 8) * 8
    return True
