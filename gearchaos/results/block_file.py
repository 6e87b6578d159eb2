"""The file of one finished block of lanes: whose it is, a checksum, and the numbers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import reason, replacing, unlinked_content

BLOCK_SCHEMA = "gearchaos-block"
BLOCK_SCHEMA_VERSION = "2.0"


def write_block(path: Path, owner: Mapping[str, Any], records: NDArray[Any]) -> None:
    """Write the records of the lanes of a block; the file appears complete or not at all.

    ``owner`` says of which sweep and which lanes they are, and ``records`` has shape (lanes,).
    Raises FileError if the file cannot be written.
    """
    head = _head(owner)
    with (
        replacing(path, overwrite=True, through_links=False) as partial,
        partial.open("wb") as file,
    ):
        file.write(head + _digest(head, records.data))
        file.write(records.data)


def read_block(
    path: Path, owner: Mapping[str, Any], record: np.dtype[Any], lanes: int
) -> NDArray[Any]:
    """Give the records of so many lanes, shape (lanes,), verified.

    Raises FileError if the file is missing, damaged or of another owner.
    """
    head = _head(owner)
    start = len(head) + hashlib.sha256().digest_size
    size = start + lanes * record.itemsize
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
    return np.frombuffer(content[start:], record)


def _head(owner: Mapping[str, Any]) -> bytes:
    schema = {"schema": BLOCK_SCHEMA, "schema_version": BLOCK_SCHEMA_VERSION}
    return json.dumps({**schema, **owner}).encode() + b"\n"


def _digest(head: bytes, records: memoryview) -> bytes:
    digest = hashlib.sha256(head)
    digest.update(records)
    return digest.digest()
