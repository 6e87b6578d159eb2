"""Finished blocks of lanes, kept beside the output until all are there and become one file."""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

from numpy.typing import NDArray

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import PARTIAL
from gearchaos.results.block_file import ShardFormat
from gearchaos.results.manifest import MANIFEST, Manifest, folder_of
from gearchaos.results.result_file import Metadata, Parameter, write_result
from gearchaos.results.store_lock import LOCK, StoreLock
from gearchaos.results.variables import Variable

_NAME = re.compile(r"(\d{12})-(\d{12})\.shard")
_PART = re.compile(LOCK + r"-(\d+)-of-(\d+)")

Bounds = tuple[int, int]


class Finished(NamedTuple):
    """What `ShardStore.finished` has found.

    Attributes
    ----------
    bounds : list of (first, last)
        Blocks that are complete and verified, by lane, without overlap; last is exclusive.
    problems : list of str
        One sentence for each shard that is bad and has to be computed again.
    """

    bounds: list[Bounds]
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
    text : str
        The configuration as it was written, for the result file.
    resume : bool
        Whether there may be shards of an earlier run, to be continued.
    part : str, optional
        Name of the part of the blocks that this process computes, such as ``2-of-8``. Others may
        compute other parts in the same folder meanwhile.
    blocks : sequence of (first, last), optional
        The blocks of this part, by lane; by default all lanes are one's own.

    Raises
    ------
    FileError
        If there are own shards and `resume` is not set, if they belong to another configuration
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
        text: str = "",
        resume: bool = False,
        part: str | None = None,
        blocks: Sequence[Bounds] | None = None,
    ) -> None:
        self.output = Path(output)
        self.folder = folder_of(output)
        self.variables = list(variables)
        self.lanes = lanes
        self.axis = axis
        sizes = {v.name: len(v.values) for v in variables if v.values is not None}
        columns = tuple(
            (v.name, v.dtype, tuple(sizes[dim] for dim in v.dims[1:]))
            for v in variables
            if v.dims[0] == axis
        )
        self._manifest = Manifest(lanes, columns, configuration, text)
        self._format = ShardFormat(self._manifest.fingerprint, lanes, columns)
        self._blocks = [(0, lanes)] if blocks is None else list(blocks)
        self._part = part
        self._lock = StoreLock(self.folder, self.output, part)
        try:
            self._open(resume)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the lock; finished blocks stay."""
        if not self._names() and self._lock.alone():
            self.remove()
        self._lock.release()

    def finished(
        self, visit: Callable[[Mapping[str, NDArray[Any]]], None] | None = None
    ) -> Finished:
        """Verify one's own shards that are there: schema, configuration, bounds, checksum.

        Parameters
        ----------
        visit : callable, optional
            Called with the arrays of each shard that is sound.
        """
        bounds: list[Bounds] = []
        problems: list[str] = []
        for first, last in self._own_shards():
            try:
                if bounds and first < bounds[-1][1]:
                    path = self._path(first, last)
                    raise FileError(f"{path}: overlaps the shard before it")
                arrays = self.read(first, last)
            except FileError as error:
                problems += error.problems
            else:
                bounds.append((first, last))
                if visit is not None:
                    visit(arrays)
        return Finished(bounds, problems)

    def missing(self, bounds: Sequence[Bounds], block: int) -> list[Bounds]:
        """List blocks of at most so many lanes that cover what the given bounds leave out.

        The blocks of a part are small enough as they are; lanes of other parts do not miss.
        """
        return [
            (start, min(start + block, last))
            for own in self._blocks
            for first, last in uncovered(own, sorted(bounds))
            for start in range(first, last, block)
        ]

    def write(self, first: int, last: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep the lanes first to last - 1 of every variable that runs over the lanes.

        Raises
        ------
        FileError
            If the shard cannot be written.
        ValueError
            If an array has another shape than the variables say.
        """
        self._format.write(self._path(first, last), first, last, arrays)

    def read(self, first: int, last: int) -> dict[str, NDArray[Any]]:
        """Give the arrays of one shard, verified.

        Raises
        ------
        FileError
            If the shard is missing or damaged, or belongs to another sweep.
        """
        return self._format.read(self._path(first, last), first, last)

    def merge(
        self,
        parameters: Mapping[str, Parameter],
        metadata: Metadata,
        *,
        overwrite: bool = False,
        found: Finished | None = None,
    ) -> Path:
        """Make the result file of all blocks, one block in memory at a time, and tidy up.

        Parameters
        ----------
        parameters, metadata, overwrite
            As for `write_result`.
        found : Finished, optional
            What `finished` has just given; by default it is asked.

        Returns
        -------
        Path
            The result file.

        Raises
        ------
        FileError
            If blocks are missing or the file cannot be written; the shards stay.
        """
        bounds, problems = found or self.finished()
        if gaps := self.missing(bounds, self.lanes):
            raise FileError([*problems, f"{self.folder}: {lanes_text(gaps)} missing; use --resume"])
        write_result(
            self.output,
            self.variables,
            ((first, last, self.read(first, last)) for first, last in bounds),
            parameters,
            {**metadata, "axis": self.axis},
            lanes=self.lanes,
            overwrite=overwrite,
            scratch=self.folder,
        )
        self.remove()
        return self.output

    @property
    def own_lanes(self) -> int:
        """Lanes of one's own blocks."""
        return sum(last - first for first, last in self._blocks)

    @property
    def parts(self) -> list[tuple[int, int]]:
        """Number and total of the parts that have ever been begun here."""
        found = (_PART.fullmatch(path.name) for path in self._entries())
        return sorted((int(match[1]), int(match[2])) for match in found if match)

    def _open(self, resume: bool) -> None:
        own = list(self._own_shards())
        if own and not resume:
            raise FileError(
                f"{self.folder}: holds {len(own)} finished blocks of an earlier run; continue "
                "it with --resume, or delete this folder"
            )
        if self._part is not None:
            # Whoever comes first writes it; all others must mean the same sweep.
            self._manifest.write_if_new(self.folder)
            self._manifest.compare(self.folder)
            return
        if own:
            self._manifest.compare(self.folder)
        # Those of other parts may be about to get their names.
        for partial in self.folder.glob(f".*{PARTIAL}"):
            partial.unlink(missing_ok=True)
        if not own:
            self._manifest.write(self.folder)

    def remove(self) -> None:
        """Remove the shards, and the folder if nothing else is in it."""
        # Only what the store has made: the folder may hold files of the user.
        parts = [path.name for path in self._entries() if _PART.fullmatch(path.name)]
        for name in [*self._names(), MANIFEST, *parts, LOCK]:
            with suppress(OSError):
                (self.folder / name).unlink()
        with suppress(OSError):
            self.folder.rmdir()

    def _own_shards(self) -> Iterator[Bounds]:
        for name in self._names():
            first, last = (int(number) for number in name.removesuffix(".shard").split("-"))
            if self._part is None or list(uncovered((first, last), self._blocks)) != [
                (first, last)
            ]:
                yield first, last

    def _names(self) -> list[str]:
        return sorted(path.name for path in self._entries() if _NAME.fullmatch(path.name))

    def _entries(self) -> list[Path]:
        try:
            return list(self.folder.iterdir())
        except OSError:
            return []

    def _path(self, first: int, last: int) -> Path:
        return self.folder / f"{first:012d}-{last:012d}.shard"


def uncovered(block: Bounds, finished: Sequence[Bounds]) -> Iterator[Bounds]:
    """Give what finished blocks, sorted and without overlap, leave out of a block."""
    first, last = block
    index = bisect_right(finished, first, key=lambda bounds: bounds[1])
    while index < len(finished) and finished[index][0] < last:
        begin, end = finished[index]
        if first < begin:
            yield first, begin
        first = end
        index += 1
    if first < last:
        yield first, last


def lanes_text(gaps: Sequence[Bounds], most: int = 3) -> str:
    """Word which lanes there are not: "lanes 0 to 255, 512 to 767 and 4 more blocks are"."""
    names = ", ".join(f"{first} to {last - 1}" for first, last in gaps[:most])
    more = f" and {len(gaps) - most} more ranges" if len(gaps) > most else ""
    return f"lanes {names}{more} are"
