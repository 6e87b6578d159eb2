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
from gearchaos.results.atomic_file import reason, replacing

SHARD_SCHEMA = "gearchaos-shard"
SHARD_SCHEMA_VERSION = "1.0"


@dataclass(frozen=True)
class ShardFormat:
    """What the shards of one sweep have in common.

    Parameters
    ----------
    fingerprint : str
        Hash of all that decides the numbers: shards of another sweep are refused by it.
    lanes : int
        Lanes of the whole sweep.
    columns : tuple of (name, dtype, row)
        Variables in the order of the file; `row` is the shape of what one lane has.
    """

    fingerprint: str
    lanes: int
    columns: tuple[tuple[str, str, tuple[int, ...]], ...]

    def write(self, path: Path, first: int, last: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write the lanes first to last - 1; the file appears complete or not at all.

        Raises
        ------
        FileError
            If the file cannot be written.
        ValueError
            If an array has another shape than the columns say.
        """
        pieces = []
        for name, dtype, row in self.columns:
            array = np.ascontiguousarray(arrays[name], dtype=_little_endian(dtype))
            if array.shape != (last - first, *row):
                raise ValueError(f"{name} of lanes {first} to {last - 1} has shape {array.shape}")
            pieces.append(array.data)
        head = self._head(first, last)
        digest = hashlib.sha256(head)
        for piece in pieces:
            digest.update(piece)
        with replacing(path, overwrite=True) as partial, partial.open("wb") as file:
            file.write(head + digest.digest())
            for piece in pieces:
                file.write(piece)

    def read(self, path: Path, first: int, last: int) -> dict[str, NDArray[Any]]:
        """Give the arrays of the lanes first to last - 1, verified.

        Raises
        ------
        FileError
            If the file is missing or damaged, or belongs to other lanes or another sweep.
        """
        if not 0 <= first < last <= self.lanes:
            raise FileError(f"{path}: its lanes are none of the {self.lanes} of this sweep")
        head = self._head(first, last)
        shapes = [(last - first, *row) for _, _, row in self.columns]
        dtypes = [_little_endian(dtype) for _, dtype, _ in self.columns]
        sizes = [int(np.prod(s)) * d.itemsize for s, d in zip(shapes, dtypes, strict=True)]
        start = len(head) + hashlib.sha256().digest_size
        try:
            # Before reading: what claims to be a shard may be larger than the memory.
            found = path.stat().st_size
            content = memoryview(path.read_bytes() if found == start + sum(sizes) else b"")
        except OSError as error:
            raise FileError(f"{path}: cannot be read: {reason(error)}") from error
        if not content:
            raise FileError(f"{path}: has {found} bytes, not the {start + sum(sizes)} of its lanes")
        if content[: len(head)] != head:
            raise FileError(f"{path}: belongs to another sweep or another version of the format")
        digest = hashlib.sha256(head)
        digest.update(content[start:])
        if content[len(head) : start] != digest.digest():
            raise FileError(f"{path}: is damaged; its checksum does not fit")
        arrays = {}
        for (name, _, _), shape, dtype, size in zip(
            self.columns, shapes, dtypes, sizes, strict=True
        ):
            arrays[name] = np.frombuffer(content[start : start + size], dtype).reshape(shape)
            start += size
        return arrays

    def _head(self, first: int, last: int) -> bytes:
        head = {
            "schema": SHARD_SCHEMA,
            "schema_version": SHARD_SCHEMA_VERSION,
            "fingerprint": self.fingerprint,
            "first": first,
            "last": last,
        }
        return json.dumps(head).encode() + b"\n"


def _little_endian(dtype: str) -> np.dtype[Any]:
    return np.dtype(dtype).newbyteorder("<")
