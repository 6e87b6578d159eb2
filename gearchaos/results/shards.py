"""Finished blocks of lanes, kept beside the output until all are there and become one file."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from numpy.typing import NDArray

from gearchaos.errors import FileError
from gearchaos.results.atomic_file import PARTIAL, reason, replacing
from gearchaos.results.result_file import Metadata, Parameter, write_result
from gearchaos.results.shard_file import SHARD_SCHEMA_VERSION, ShardFormat
from gearchaos.results.store_lock import LOCK, StoreLock
from gearchaos.results.variables import Variable

STORE_SCHEMA = "gearchaos-shards"
_MANIFEST = "manifest.json"
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
        sizes = {v.name: len(v.values) for v in variables if v.values is not None}
        columns = tuple(
            (v.name, v.dtype, tuple(sizes[dim] for dim in v.dims[1:]))
            for v in variables
            if v.dims[0] == axis
        )
        self._manifest: dict[str, Any] = {
            "schema": STORE_SCHEMA,
            "schema_version": SHARD_SCHEMA_VERSION,
            "lanes": lanes,
            "variables": columns,
            "configuration": configuration,
        }
        text = json.dumps(self._manifest, sort_keys=True)
        fingerprint = hashlib.sha256(text.encode()).hexdigest()
        self._format = ShardFormat(fingerprint, lanes, columns)
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
            self._remove()
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
    ) -> Path:
        """Make the result file of all blocks, one block in memory at a time, and tidy up.

        Returns
        -------
        Path
            The result file.

        Raises
        ------
        FileError
            If blocks are missing or the file cannot be written; the shards stay.
        """
        bounds, problems = self.finished()
        if gaps := self.missing(bounds, self.lanes):
            first, last = gaps[0]
            here = f"{self.folder}: lanes {first} to {last - 1} are missing; use --resume"
            raise FileError([*problems, here])
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
        self._remove()
        return self.output

    def _open(self, resume: bool) -> None:
        names = self._names()
        path = self.folder / _MANIFEST
        if names and not resume:
            raise FileError(
                f"{self.folder}: holds {len(names)} finished blocks of an earlier run; continue "
                "it with --resume, or delete this folder"
            )
        if names:
            self._compare(path)
        for partial in self.folder.glob(f".*{PARTIAL}"):
            partial.unlink(missing_ok=True)
        if not names:
            with replacing(path, overwrite=True) as partial:
                partial.write_text(json.dumps(self._manifest, indent=1), encoding="utf-8")

    def _compare(self, path: Path) -> None:
        try:
            earlier = json.loads(path.read_text(encoding="utf-8"))
            keys = differing_keys(earlier["configuration"], self._manifest["configuration"])
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as e:
            raise FileError(
                f"{path}: is damaged or missing ({reason(e)}); delete the folder to start again"
            ) from e
        own = json.loads(json.dumps(self._manifest))
        keys = keys or [key for key in own if own[key] != earlier.get(key)]
        if keys:
            raise FileError(
                f"{self.folder}: holds blocks of another configuration, which differs in "
                f"{', '.join(keys)}; restore these values, delete the folder or choose another "
                "--output"
            )

    def _remove(self) -> None:
        # Only what the store has made: the folder may hold files of the user.
        for name in [*self._names(), _MANIFEST, LOCK]:
            with suppress(OSError):
                (self.folder / name).unlink()
        with suppress(OSError):
            self.folder.rmdir()

    def _names(self) -> list[str]:
        try:
            return sorted(p.name for p in self.folder.iterdir() if _NAME.fullmatch(p.name))
        except OSError:
            return []

    def _path(self, first: int, last: int) -> Path:
        return self.folder / f"{first:012d}-{last:012d}.shard"


def differing_keys(one: str, other: str) -> list[str]:
    """List the dotted keys in which two TOML texts differ, with both values."""
    first, second = (dict(_flat(tomllib.loads(text))) for text in (one, other))
    return [
        f"{key} ({first.get(key, 'absent')}, now {second.get(key, 'absent')})"
        for key in {**first, **second}
        if key not in first or key not in second or repr(first[key]) != repr(second[key])
    ]


def _flat(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value
