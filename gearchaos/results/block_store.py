"""Finished blocks of lanes, kept beside the output until all are there and become one file."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import PARTIAL
from gearchaos.results.block_file import read_block, write_block
from gearchaos.results.lane_ranges import Bounds, lanes_text, uncovered
from gearchaos.results.manifest import (
    MANIFEST,
    decisive_facts,
    fingerprint,
    folder_of,
    read_manifest,
    settle_manifest,
)
from gearchaos.results.result_file import Metadata, Parameter, write_result
from gearchaos.results.store_lock import LOCK, StoreLock
from gearchaos.results.variables import Variable, lane_axes
from gearchaos.version import Software

_NAME = re.compile(r"\d{12}-\d{12}\.block")


class Finished(NamedTuple):
    """Bounds of the sound blocks, without overlap, and a sentence for each that is not."""

    bounds: list[Bounds]
    problems: list[str]


class BlockStore:
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
        self.output = Path(output)
        self.folder = folder_of(output)
        sizes = {v.name: len(v.values) for v in variables if v.values is not None}
        axes = lane_axes(variables)
        self.lanes = math.prod(sizes[axis] for axis in axes)
        self._record = np.dtype(
            [
                (v.name, np.dtype(v.dtype), tuple(sizes[dim] for dim in v.dims[len(axes) :]))
                for v in variables
                if v.values is None
            ]
        ).newbyteorder("<")
        facts = {"lanes": self.lanes, "variables": self._record.descr}
        decisive = decisive_facts(software, **facts, configuration=configuration)
        self._fingerprint = fingerprint(decisive)
        self._blocks = [(0, self.lanes)] if blocks is None else list(blocks)
        self._lock = StoreLock(self.folder, self.output, shared=blocks is not None)
        try:
            own = self._own_blocks()
            # Of several shards, whoever comes first writes it.
            shared, beside = blocks is not None, {"text": text, "shards": shards}
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
        if blocks is None:
            self._remove([partial.name for partial in self.folder.glob(f".*{PARTIAL}")])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the lock; finished blocks stay."""
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

    @property
    def shards(self) -> int | None:
        """Into how many shards whoever began divided the sweep; None for one process."""
        number = read_manifest(self.folder).get("shards")
        return number if isinstance(number, int) and number > 0 else None

    def finished(
        self, visit: Callable[[Mapping[str, NDArray[Any]]], None] | None = None
    ) -> Finished:
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

    def write(self, first: int, last: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep the lanes first to last - 1 of every computed variable.

        Raises FileError if they cannot be kept, ValueError if an array has a wrong shape.
        """
        records = np.empty(last - first, self._record)
        for name in self._record.names or ():
            if (shape := np.shape(arrays[name])) != records[name].shape:
                raise ValueError(f"{name} of lanes {first} to {last - 1} has shape {shape}")
            records[name] = arrays[name]
        write_block(self._path(first, last), self._owner(first, last), records)

    def read(self, first: int, last: int) -> dict[str, NDArray[Any]]:
        """Give the arrays of one block; FileError if it is missing, damaged or of another sweep."""
        path = self._path(first, last)
        if not 0 <= first < last <= self.lanes:
            raise FileError(f"{path}: its lanes are none of the {self.lanes} of this sweep")
        records = read_block(path, self._owner(first, last), self._record, last - first)
        return {name: records[name] for name in self._record.names or ()}

    def merge(
        self,
        variables: Sequence[Variable],
        parameters: Mapping[str, Parameter],
        metadata: Metadata,
        *,
        overwrite: bool = False,
        found: Finished | None = None,
    ) -> Path:
        """Make the result file of all blocks, one block in memory at a time, and tidy up.

        The first four are those of `write_result`; ``found`` is what `finished` has just given.
        Raises FileError if blocks are missing or the file cannot be written; the blocks stay.
        """
        bounds, problems = found or self.finished()
        if gaps := self.missing(bounds, self.lanes):
            raise FileError([*problems, f"{self.folder}: {lanes_text(gaps)} missing; use --resume"])
        write_result(
            self.output,
            variables,
            ((first, last, self.read(first, last)) for first, last in bounds),
            parameters,
            metadata,
            overwrite=overwrite,
            scratch=self.folder,
        )
        self.remove()
        return self.output

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

    def _owner(self, first: int, last: int) -> dict[str, Any]:
        return {"fingerprint": self._fingerprint, "first": first, "last": last}

    def _path(self, first: int, last: int) -> Path:
        return self.folder / f"{first:012d}-{last:012d}.block"
