"""Finished blocks of lanes, kept beside the output until all are there and become one file."""

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

from gearchaos.arrays import Array, Integers
from gearchaos.errors import FileError
from gearchaos.outputs.variable import Variable, lane_axes, require_listed
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

Arrays: TypeAlias = Mapping[str, Array]
Bounds: TypeAlias = tuple[int, int]  # First lane of a range, and the one after its last.

PIECE_BYTES = 1 << 28
"""Memory in which lanes that were computed in another order are brought into their own."""

SCHEMA = {"schema": "gearchaos-blocks", "schema_version": "4.0"}
_DIGEST = hashlib.sha256().digest_size
_NAME = re.compile(r"\d{12}-\d{12}\.block")


class Finished(NamedTuple):
    """Bounds of the sound blocks, without overlap, and a sentence for each that is not."""

    bounds: list[Bounds]
    problems: list[str]


class BlockStore(AbstractContextManager["BlockStore"]):
    """The finished blocks of one sweep, in the folder ``<output>.blocks``.

    As long as its context lasts, a lock keeps other sweeps away from the same output. `merge` makes
    the result file and removes the folder; before that, nothing that was written is ever removed.

    The configuration is the resolved one in TOML; one's own blocks of another one, or of other
    software, are refused, and without ``resume`` all of them. ``text`` is the configuration as it
    was written. With ``blocks``, those of one's own shard of so many ``shards``, by lane, others
    may compute other shards in the same folder; by default all lanes are one's own. Raises
    FileError if blocks are refused (the message names what differs), if another sweep is writing to
    the same output, or if the folder cannot be made; what was there before stays, and nothing else.
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
        blocks: Sequence[Bounds] | None = None,
        shards: int | None = None,
    ) -> None:
        self.output, self.folder = Path(output), folder_of(output)
        self.lanes, self._record = lanes_and_record(variables)
        facts = {**SCHEMA, **software._asdict(), "configuration": configuration}
        facts |= {"lanes": self.lanes, "variables": self._record.descr}
        self._owner = json.dumps(facts)
        # As it is read again: with lists for tuples.
        decisive = json.loads(self._owner)
        shared = blocks is not None
        self._blocks = [(0, self.lanes)] if blocks is None else list(blocks)
        self._lock = StoreLock(self.folder, self.output, shared)
        try:
            own = self._own_blocks()
            beside = {"text": text, "shards": shards}
            # Of several shards, whoever comes first writes it.
            how = {"write": shared or not own, "overwrite": not shared}
            settle_manifest(self.folder, decisive, beside, **how)
            if own and not resume:
                raise FileError(
                    f"{self.folder}: holds {len(own)} finished blocks of an earlier run; continue "
                    "it with --resume, or delete this folder"
                )
        except BaseException:
            if self._lock.new and self._lock.alone():
                self._remove([LOCK])
            self._lock.release()
            raise
        # Those of other shards may be about to get their names.
        if not shared:
            self._remove([partial.name for partial in self.folder.glob(f".*{PARTIAL}")])

    def __exit__(self, *_: object) -> None:
        if not self._names() and self._lock.alone():
            self.remove()
        self._lock.release()

    def remove(self) -> None:
        """Remove the blocks, the folder if nothing else is in it, and let go of the lock."""
        # Only what the store has made: the folder may hold files of the user.
        self._remove([*self._names(), MANIFEST, LOCK])
        # What comes to be there from now on is another sweep's.
        self._lock.release()

    @property
    def own_lanes(self) -> int:
        """Lanes of one's own blocks."""
        return sum(last - first for first, last in self._blocks)

    def finished(self, visit: Callable[[Arrays], None] | None = None) -> Finished:
        """Verify one's own blocks that are there; `visit` gets the arrays of each sound one."""
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
        """List own blocks of at most so many lanes that cover what the given bounds leave out."""
        return [
            (start, min(start + block, last))
            for own in self._blocks
            for first, last in uncovered(own, sorted(bounds))
            for start in range(first, last, block)
        ]

    def write(self, first: int, last: int, arrays: Arrays) -> None:
        """Keep the lanes first to last - 1 of every computed variable.

        Raises FileError if they cannot be kept, ValueError if an array has a wrong shape or is none
        of these variables.
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
        """Give the arrays of one block; FileError if it is missing, damaged or of another sweep."""
        path = self._path(first, last)
        if not 0 <= first < last <= self.lanes:
            raise FileError(f"{path}: its lanes are none of the {self.lanes} of this sweep")
        size = _DIGEST + (last - first) * self._record.itemsize
        try:
            # Not more: what claims to be a block may be larger than the memory.
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
        """Make the result file of all blocks, one block in memory at a time, and tidy up.

        The first four are those of `write_result`; ``found`` is what `finished` has just given;
        ``computed_at`` gives the lanes at places in the order of computation, where that is not
        their own, and takes the memory of a `PIECE_BYTES`. Raises FileError if blocks are missing
        or the file cannot be written; the blocks stay.
        """
        found = found or self.finished()
        self.require_all(found, "use --resume")
        by_block = ((first, last, self.read(first, last)) for first, last in found.bounds)
        ordered = computed_at and self._in_order_of_lanes(found.bounds, computed_at)
        blocks = ordered or by_block
        told = variables, blocks, parameters, metadata
        write_result(self.output, *told, overwrite=overwrite, scratch=self.folder)
        self.remove()
        return self.output

    def require_all(self, found: Finished, remedy: str) -> None:
        """Raise a FileError that names the lanes which `finished` has not found, with a remedy."""
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
        """Return what fits only these numbers of these lanes of this sweep."""
        digest = hashlib.sha256(f"{self._owner} {first} {last}\n".encode())
        digest.update(records)
        return digest.digest()


def lanes_and_record(variables: Sequence[Variable]) -> tuple[int, np.dtype[Any]]:
    """Return how many lanes a sweep has, and the type of one: a field for all that it yields."""
    sizes = {v.name: len(v.values) for v in variables if v.values is not None}
    axes, of_the_lanes = lane_axes(variables), [v for v in variables if v.values is None]
    record = [(v.name, v.dtype, tuple(sizes[d] for d in v.dims[len(axes) :])) for v in of_the_lanes]
    return math.prod(sizes[axis] for axis in axes), np.dtype(record).newbyteorder("<")


def uncovered(block: Bounds, finished: Sequence[Bounds]) -> Iterator[Bounds]:
    """Give what finished blocks, sorted and without overlap, leave out of a block."""
    first, last = block
    for begin, end in finished[bisect_right(finished, first, key=lambda bounds: bounds[1]) :]:
        if begin >= last:
            break
        if first < begin:
            yield first, begin
        first = end
    if first < last:
        yield first, last
