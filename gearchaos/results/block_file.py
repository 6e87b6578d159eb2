"""The file of one finished block of lanes: whose it is, a checksum, and the numbers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import reason, replacing, unlinked_content

BLOCK_SCHEMA = "gearchaos-block"
BLOCK_SCHEMA_VERSION = "2.0"


@dataclass(frozen=True)
class BlockFormat:
    """What the block files of one sweep have in common.

    Parameters
    ----------
    fingerprint : str
        Hash of all that decides the numbers: blocks of another sweep are refused by it.
    lanes : int
        Lanes of the whole sweep.
    record : numpy.dtype
        Structured: what one lane has, by the names of the variables, little-endian.
    """

    fingerprint: str
    lanes: int
    record: np.dtype[Any]

    def write(self, path: Path, first: int, last: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write the lanes first to last - 1; the file appears complete or not at all.

        Raises FileError if it cannot be written, ValueError if an array has a wrong shape.
        """
        records = np.empty(last - first, self.record)
        for name in self.record.names or ():
            if (shape := np.shape(arrays[name])) != records[name].shape:
                raise ValueError(f"{name} of lanes {first} to {last - 1} has shape {shape}")
            records[name] = arrays[name]
        head = self._head(first, last)
        with (
            replacing(path, overwrite=True, through_links=False) as partial,
            partial.open("wb") as file,
        ):
            file.write(head + _digest(head, records.data))
            file.write(records.data)

    def read(self, path: Path, first: int, last: int) -> dict[str, NDArray[Any]]:
        """Give the arrays of the lanes first to last - 1, verified.

        Raises FileError if the file is missing, damaged or of other lanes or another sweep.
        """
        if not 0 <= first < last <= self.lanes:
            raise FileError(f"{path}: its lanes are none of the {self.lanes} of this sweep")
        head = self._head(first, last)
        start = len(head) + hashlib.sha256().digest_size
        size = start + (last - first) * self.record.itemsize
        try:
            # Not more: what claims to be a block may be larger than the memory.
            content = memoryview(unlinked_content(path, size + 1))
        except OSError as error:
            raise FileError(f"{path}: cannot be read: {reason(error)}") from error
        if len(content) != size:
            raise FileError(f"{path}: has not the {size} bytes of its lanes")
        if content[: len(head)] != head:
            raise FileError(f"{path}: belongs to another sweep or another version of the format")
        if content[len(head) : start] != _digest(head, content[start:]):
            raise FileError(f"{path}: is damaged; its checksum does not fit")
        records = np.frombuffer(content[start:], self.record)
        return {name: records[name] for name in self.record.names or ()}

    def _head(self, first: int, last: int) -> bytes:
        schema = {"schema": BLOCK_SCHEMA, "schema_version": BLOCK_SCHEMA_VERSION}
        own = {"fingerprint": self.fingerprint, "first": first, "last": last}
        return json.dumps(schema | own).encode() + b"\n"


def _digest(head: bytes, records: memoryview) -> bytes:
    digest = hashlib.sha256(head)
    digest.update(records)
    return digest.digest()
