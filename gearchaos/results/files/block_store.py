"""Finished blocks of lanes, kept beside the output until they are merged into one file."""

import hashlib
import json
import math
import os
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from gearchaos.arrays import Array, Arrays, Integers
from gearchaos.errors import FileError
from gearchaos.outputs.variable import Variable, lane_axes, require_listed
from gearchaos.progress import count_of
from gearchaos.results.files.atomic_file import PARTIAL, reason, replacing, unlinked_content
from gearchaos.results.files.block_folder import (
    LOCK,
    MANIFEST,
    StoreLock,
    folder_of,
    settle_manifest,
)
from gearchaos.results.files.result_file import Metadata, write_result
from gearchaos.version import Software

Bounds: TypeAlias = tuple[int, int]  # First lane of a range, and the one after its last.

PIECE_BYTES = 1 << 28
"""Memory for sorting lanes that were computed in another order than that of the file."""

SCHEMA = {"schema": "gearchaos-blocks", "schema_version": "5.0"}
_DIGEST = hashlib.sha256().digest_size
_NAME = re.compile(r"\d{12}-\d{12}\.block")


class Finished(NamedTuple):
    """Bounds of the sound blocks, without overlap, and a sentence for each damaged block."""

    bounds: list[Bounds]
    problems: list[str]


class OwnBlocks(NamedTuple):
    """The blocks of one shard, and how many shards share the sweep."""

    blocks: Sequence[Bounds]
    shards: int


class BlockStore(AbstractContextManager["BlockStore"]):
    """The finished blocks of one sweep, in the folder ``<output>.blocks``.

    A context manager: a lock keeps other sweeps from writing to the same output. `merge` makes the
    result file and removes the folder. Before that, no block is ever removed.

    Parameters
    ----------
    output : path-like
        Name of the result file.
    variables : sequence of Variable
        The variables of the sweep.
    configuration : str
        The resolved configuration in TOML. Own blocks of another configuration are refused.
    software : Software
        Versions that decide the numbers. Own blocks of other software are refused.
    text : str
        The configuration as it was written.
    resume : bool
        Whether own blocks of an earlier run are kept. Otherwise they are refused.
    own : OwnBlocks, optional
        The own blocks, if this is a shard; other shards may be computed in the same folder. By
        default all lanes are own.

    Raises
    ------
    FileError
        If blocks are refused (the message names the differences), if another sweep is writing to
        the same output, or if the folder cannot be made. Earlier files stay as they were.
    """

    def __init__(
        self,
        output: str | os.PathLike[str],
        variables: Sequence[Variable],
        configuration: str,
        software: Software,
        *,
        text: str = "",
        resume: bool = False,
        own: OwnBlocks | None = None,
    ) -> None:
        self.output, self.folder = Path(output), folder_of(output)
        self.lanes, self._record = lanes_and_record(variables)
        facts = {**SCHEMA, **software._asdict(), "configuration": configuration}
        facts |= {"lanes": self.lanes, "variables": self._record.descr}
        self._owner = json.dumps(facts)
        # Through JSON, since a manifest that is read has lists in place of tuples.
        decisive = json.loads(self._owner)
        shared = own is not None
        self._blocks = [(0, self.lanes)] if own is None else list(own.blocks)
        self._lock = StoreLock(self.folder, self.output, shared)
        try:
            finished = self._own_blocks()
            beside = {"text": text, "shards": own and own.shards}
            # The first of several shards writes the manifest.
            how = {"write": shared or not finished, "overwrite": not shared}
            settle_manifest(self.folder, decisive, beside, **how)
            if finished and not resume:
                raise FileError(
                    f"{self.folder}: holds {count_of(len(finished), 'finished block')} of an "
                    "earlier run; continue it with --resume, or delete this folder"
                )
        except BaseException:
            self._end([LOCK] if self._lock.new and self._lock.alone() else [])
            raise
        # Partial files of other shards may be in use.
        if not shared:
            self._remove([partial.name for partial in self.folder.glob(f".*{PARTIAL}")])

    def __exit__(self, *_: object) -> None:
        if not self._names() and self._lock.alone():
            self.remove()
        self._lock.release()

    def remove(self) -> None:
        """Remove the blocks, the folder if nothing else is in it, and release the lock."""
        # Only files of the store: the folder may hold files of the user.
        self._end([*self._names(), MANIFEST, LOCK])

    def _end(self, names: Sequence[str]) -> None:
        """Remove some files, and the folder if it is empty then, and release the lock."""
        if names:
            self._remove(names)
        # Released last: files that appear from now on belong to another sweep.
        self._lock.release()
        if names:
            # Claims lie in the folder until then, and Windows keeps files that are open.
            self._remove([LOCK] if os.name == "nt" else [])

    @property
    def own_lanes(self) -> int:
        """Number of lanes of the own blocks."""
        return sum(last - first for first, last in self._blocks)

    def finished(self, visit: Callable[[Arrays], None] | None = None) -> Finished:
        """Verify the own blocks that exist; call ``visit`` with the arrays of each sound one."""
        bounds: list[Bounds] = []
        problems: list[str] = []
        for first, last in self._own_blocks():
            try:
                if bounds and first < bounds[-1][1]:
                    raise FileError(f"{self._path(first, last)}: overlaps the block before it")
                arrays = self.read(first, last)
            except FileError as error:
                problems += error.problems
            else:
                bounds.append((first, last))
                if visit is not None:
                    visit(arrays)
        return Finished(bounds, problems)

    def missing(self, bounds: Sequence[Bounds], block: int) -> list[Bounds]:
        """List own blocks of at most ``block`` lanes that cover all lanes outside the bounds."""
        return [
            (start, min(start + block, last))
            for own in self._blocks
            for first, last in uncovered(own, sorted(bounds))
            for start in range(first, last, block)
        ]

    def write(self, first: int, last: int, arrays: Arrays) -> None:
        """Write the lanes first to last - 1 of every computed variable as a block.

        Raises FileError if the block cannot be written, ValueError if an array has a wrong shape or
        belongs to no variable.
        """
        require_listed(arrays, self._record.names or ())
        records = np.empty(last - first, self._record)
        for name in self._record.names or ():
            if (shape := np.shape(arrays[name])) != records[name].shape:
                raise ValueError(f"{name} of lanes {first} to {last - 1} has shape {shape}")
            records[name] = arrays[name]
        path = self._path(first, last)
        with (
            replacing(path, overwrite=True, through_links=False) as partial,
            partial.open("wb") as file,
        ):
            file.write(self._digest(first, last, records.data))
            file.write(records.data)

    def read(self, first: int, last: int) -> dict[str, Array]:
        """Return the arrays of one block; FileError if it is missing, damaged or does not fit."""
        path = self._path(first, last)
        if not 0 <= first < last <= self.lanes:
            raise FileError(f"{path}: its lanes are none of the {self.lanes} of this sweep")
        size = _DIGEST + (last - first) * self._record.itemsize
        try:
            # Limited: a damaged block may be larger than the memory.
            content = memoryview(unlinked_content(path, size + 1))
        except OSError as error:
            raise FileError(f"{path}: cannot be read: {reason(error)}") from error
        if len(content) != size:
            raise FileError(f"{path}: has not the {size} bytes of its lanes")
        if content[:_DIGEST] != self._digest(first, last, content[_DIGEST:]):
            raise FileError(f"{path}: is damaged or of another sweep; its checksum does not fit")
        records = np.frombuffer(content[_DIGEST:], self._record)
        return {name: records[name] for name in self._record.names or ()}

    def merge(
        self,
        variables: Sequence[Variable],
        parameters: Mapping[str, Variable],
        metadata: Metadata,
        *,
        overwrite: bool = False,
        found: Finished | None = None,
        computed_at: Callable[[Integers], Integers] | None = None,
    ) -> Path:
        """Merge all blocks into the result file, one block in memory at a time, and remove them.

        Parameters
        ----------
        variables, parameters, metadata, overwrite
            As for `write_result`.
        found : Finished, optional
            The result of `finished`, if it is known already.
        computed_at : callable, optional
            Returns the lanes at places in the order of computation, if that is not the order of
            the file. Sorting takes `PIECE_BYTES` of memory.

        Returns
        -------
        Path
            The result file.

        Raises
        ------
        FileError
            If blocks are missing or the file cannot be written. The blocks are kept.
        """
        found = found or self.finished()
        self.require_all(found, "use --resume")
        by_block = ((first, last, self.read(first, last)) for first, last in found.bounds)
        ordered = computed_at and self._in_order_of_lanes(found.bounds, computed_at)
        blocks = ordered or by_block
        content = variables, blocks, parameters, metadata
        write_result(self.output, *content, overwrite=overwrite, scratch=self.folder)
        self.remove()
        return self.output

    def require_all(self, found: Finished, remedy: str) -> None:
        """Raise a FileError with the lanes that `finished` has not found, and with a remedy."""
        if gaps := self.missing(found.bounds, self.lanes):
            names = ", ".join(f"{first} to {last - 1}" for first, last in gaps[:3])
            more = f" and {len(gaps) - 3} more ranges" if len(gaps) > 3 else ""
            missing = f"{self.folder}: lanes {names}{more} are missing; {remedy}"
            raise FileError([*found.problems, missing])

    def _in_order_of_lanes(
        self, bounds: Sequence[Bounds], computed_at: Callable[[Integers], Integers]
    ) -> Iterator[tuple[int, int, dict[str, Array]]]:
        size = max(1, PIECE_BYTES // self._record.itemsize)
        for first in range(0, self.lanes, size):
            last = min(first + size, self.lanes)
            records = np.empty(last - first, self._record)
            arrays = {name: records[name] for name in self._record.names or ()}
            for block in bounds:
                at = computed_at(np.arange(*block))
                mine = (first <= at) & (at < last)
                for name, values in self.read(*block).items() if mine.any() else ():
                    arrays[name][at[mine] - first] = values[mine]
            yield first, last, arrays

    def _remove(self, names: Sequence[str]) -> None:
        for name in names:
            with suppress(OSError):
                (self.folder / name).unlink()
        with suppress(OSError):
            self.folder.rmdir()

    def _own_blocks(self) -> list[Bounds]:
        every = ((int(name[:12]), int(name[13:25])) for name in self._names())
        return [one for one in every if list(uncovered(one, self._blocks)) != [one]]

    def _names(self) -> list[str]:
        with suppress(OSError):
            return sorted(filter(_NAME.fullmatch, os.listdir(self.folder)))
        return []

    def _path(self, first: int, last: int) -> Path:
        return self.folder / f"{first:012d}-{last:012d}.block"

    def _digest(self, first: int, last: int, records: memoryview) -> bytes:
        """Return a checksum of these numbers, of their lanes and of the sweep."""
        digest = hashlib.sha256(f"{self._owner} {first} {last}\n".encode())
        digest.update(records)
        return digest.digest()


def lanes_and_record(variables: Sequence[Variable]) -> tuple[int, np.dtype[Any]]:
    """Return the number of lanes of a sweep, and the record type of one: a field per variable."""
    sizes = {v.name: len(v.values) for v in variables if v.values is not None}
    axes, of_the_lanes = lane_axes(variables), [v for v in variables if v.values is None]
    record = [(v.name, v.dtype, tuple(sizes[d] for d in v.dims[len(axes) :])) for v in of_the_lanes]
    return math.prod(sizes[axis] for axis in axes), np.dtype(record).newbyteorder("<")


def uncovered(block: Bounds, finished: Sequence[Bounds]) -> Iterator[Bounds]:
    """Yield the parts of a block that finished blocks, sorted and without overlap, leave out."""
    first, last = block
    for begin, end in finished[bisect_right(finished, first, key=lambda bounds: bounds[1]) :]:
        if begin >= last:
            break
        if first < begin:
            yield first, begin
        first = end
    if first < last:
        yield first, last
