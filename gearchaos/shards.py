"""Finished blocks of lanes, kept beside the output until all are there and become one file."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from gearchaos.atomic_file import PARTIAL, reason, replacing, writing
from gearchaos.errors import FileError
from gearchaos.result_file import Block, Metadata, Parameter, write_result
from gearchaos.store_lock import StoreLock
from gearchaos.variables import Variable

SHARDS_SCHEMA = "gearchaos-shards"
SHARDS_SCHEMA_VERSION = "1.0"
_NAME = re.compile(r"(\d{12})-(\d{12})\.shard")


class Finished(NamedTuple):
    """What `ShardStore.finished` has found.

    Attributes
    ----------
    bounds : list of (first, last)
        Blocks that are complete and verified, by lane, without overlap; last is exclusive.
    problems : list of str
        One sentence for each shard that is bad and has to be computed again.
    """

    bounds: list[tuple[int, int]]
    problems: list[str]


class ShardStore:
    """The finished blocks of one sweep, in the folder ``<output>.shards``.

    Use it as a context manager: it holds a lock that keeps a second sweep away from the same
    output, and leaves no empty folder behind. `merge` makes the result file and removes the
    folder; before that, nothing that was written is ever removed.

    Parameters
    ----------
    output : path
        The result file to be.
    variables : sequence of Variable
        What the sweep yields.
    lanes : int
        Lanes of the sweep.
    configuration : str
        The resolved configuration in TOML. Shards of another one are refused.
    axis : str
        Name of the dimension of the lanes.
    resume : bool
        Whether there may be shards of an earlier run, to be continued.

    Raises
    ------
    FileError
        If there are shards and `resume` is not set, if they belong to another configuration
        (the message names the keys that differ), if another sweep is writing to the same output,
        or if the folder cannot be made.
    """

    def __init__(
        self,
        output: str | os.PathLike[str],
        variables: Sequence[Variable],
        lanes: int,
        configuration: str,
        *,
        axis: str,
        resume: bool = False,
    ) -> None:
        self.output = Path(output)
        self.folder = Path(os.path.realpath(output) + ".shards")
        self.variables = list(variables)
        self.lanes = lanes
        self.axis = axis
        self._manifest = {
            "schema": SHARDS_SCHEMA,
            "schema_version": SHARDS_SCHEMA_VERSION,
            "lanes": lanes,
            "variables": [[v.name, v.dtype, self._row(v)] for v in self._on_lanes()],
            "configuration": configuration,
        }
        text = json.dumps(self._manifest, sort_keys=True)
        self.fingerprint = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
        self._lock = StoreLock(self.folder, self.output)
        try:
            self._open(resume)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the lock; finished blocks stay."""
        if self._lock.held and not self._names():
            shutil.rmtree(self.folder, ignore_errors=True)
        self._lock.release()

    def finished(self) -> Finished:
        """Verify the shards that are there: schema, configuration, bounds, checksum."""
        bounds: list[tuple[int, int]] = []
        problems: list[str] = []
        for name in self._names():
            first, last = (int(number) for number in name.removesuffix(".shard").split("-"))
            try:
                if bounds and first < bounds[-1][1]:
                    raise FileError(f"{self.folder / name}: overlaps the shard before it")
                self.read(first, last)
            except FileError as error:
                problems += error.problems
            else:
                bounds.append((first, last))
        return Finished(bounds, problems)

    def missing(self, bounds: Sequence[tuple[int, int]], block: int) -> list[tuple[int, int]]:
        """List blocks of at most so many lanes that cover what the given bounds leave out."""
        gaps = []
        done = 0
        for first, last in [*sorted(bounds), (self.lanes, self.lanes)]:
            gaps += [(start, min(start + block, first)) for start in range(done, first, block)]
            done = max(done, last)
        return gaps

    def write(self, first: int, last: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep the lanes first to last - 1 of every variable that runs over the lanes.

        Raises
        ------
        FileError
            If the shard cannot be written.
        ValueError
            If the arrays are not what the variables say.
        """
        pieces = []
        for variable in self._on_lanes():
            array = np.ascontiguousarray(arrays[variable.name], dtype=_stored(variable))
            if array.shape != (last - first, *self._row(variable)):
                raise ValueError(f"{variable.name} of lanes {first} to {last} has {array.shape}")
            pieces.append(array)
        head = self._head(first, last)
        digest = hashlib.sha256(head)
        for array in pieces:
            digest.update(array)
        path = self._path(first, last)
        with replacing(path, overwrite=True) as partial, open(partial, "wb") as file:
            file.write(head + digest.digest())
            for array in pieces:
                file.write(array)

    def read(self, first: int, last: int) -> dict[str, NDArray[Any]]:
        """Give the arrays of one shard, verified.

        Raises
        ------
        FileError
            If the shard is missing or damaged, or belongs to another sweep.
        """
        path = self._path(first, last)
        head = self._head(first, last)
        on_lanes = [(v, (last - first, *self._row(v))) for v in self._on_lanes()]
        sizes = [int(np.prod(shape)) * _stored(v).itemsize for v, shape in on_lanes]
        try:
            size = path.stat().st_size
            if not 0 <= first < last <= self.lanes:
                raise FileError(f"{path}: has bounds outside of the {self.lanes} lanes")
            if size != len(head) + hashlib.sha256().digest_size + sum(sizes):
                raise FileError(f"{path}: has {size} bytes, which is not what its lanes take")
            content = memoryview(path.read_bytes())
        except OSError as error:
            raise FileError(f"{path}: cannot be read: {reason(error)}") from error
        start = len(head) + hashlib.sha256().digest_size
        if content[: len(head)] != head:
            raise FileError(f"{path}: belongs to another sweep")
        digest = hashlib.sha256(head)
        digest.update(content[start:])
        if content[len(head) : start] != digest.digest():
            raise FileError(f"{path}: is damaged, its checksum does not fit")
        arrays = {}
        for (variable, shape), length in zip(on_lanes, sizes, strict=True):
            values = np.frombuffer(content[start : start + length], dtype=_stored(variable))
            arrays[variable.name] = values.reshape(shape)
            start += length
        return arrays
