"""The folder beside an unfinished output: its lock, and the manifest of its finished blocks.

Two sweeps cannot write to the same output at the same time, except as shards of one sweep.
"""

import json
import os
import stat
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

from gearchaos.configuration.toml_text import flat_tables
from gearchaos.errors import FileError
from gearchaos.results.files.atomic_file import (
    UNDISTURBED,
    reason,
    replacing,
    unlinked_content,
    writing,
)
from gearchaos.results.files.file_locks import FileLock
from gearchaos.version import Software

LOCK = "lock"
Facts: TypeAlias = Mapping[str, Any]
MANIFEST = "manifest.json"
_LARGEST = 64 << 20
_LONGEST = 60


class StoreLock:
    """A locked file in the folder of an output; a killed process leaves it unlocked.

    A sweep of all blocks locks the folder for itself. Shards share the lock; two equal shards do
    the same work and write the same bits. `FileLock` describes the locks of each system.

    Parameters
    ----------
    folder : Path
        The folder; it is made if it does not exist.
    output : Path
        The result file, for messages.
    shared : bool
        Whether other shards may hold the lock as well.

    Attributes
    ----------
    new : bool
        Whether the file did not exist before.

    Raises
    ------
    FileError
        If another process holds the lock, if the folder is a link or belongs to another user, or
        if it cannot be made.
    """

    def __init__(self, folder: Path, output: Path, shared: bool = False) -> None:
        path = folder / LOCK
        self._descriptor: int | None = None
        self._lock: FileLock | None = None
        with writing(folder):
            while self._descriptor is None:
                with suppress(FileExistsError):
                    folder.mkdir(mode=0o700)
                # A sweep that finishes may remove the folder or the open file; then try again.
                with suppress(FileNotFoundError):
                    _require_own(folder)
                    self.new = not os.path.lexists(path)
                    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | UNDISTURBED, 0o600)
                    try:
                        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                            raise FileError(f"{path}: is not a regular file; delete it")
                        self._lock = FileLock(descriptor, path, shared)
                        if os.path.samestat(os.fstat(descriptor), path.lstat()):
                            self._descriptor = descriptor
                    except BlockingIOError as error:
                        more = f" ({error})" if error.args and error.errno is None else ""
                        raise FileError(
                            f"{output}: another sweep is writing to it; wait for its end or "
                            f"choose another --output{more}"
                        ) from error
                    finally:
                        if self._descriptor is None:
                            self._close(descriptor)

    def alone(self) -> bool:
        """Take the lock for this process alone; return whether that succeeded."""
        with suppress(BlockingIOError):
            if self._lock is not None:
                self._lock.become_alone()
                return True
        return False

    def release(self) -> None:
        """Release the lock, so that other sweeps can use the folder."""
        if self._descriptor is not None:
            self._close(self._descriptor)
            self._descriptor = None

    def _close(self, descriptor: int) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None
        os.close(descriptor)


def _require_own(folder: Path) -> None:
    """Refuse a link, and a folder into which another user can put files."""
    found = folder.lstat()
    ours = not hasattr(os, "geteuid") or found.st_uid == os.geteuid()
    if not (ours and stat.S_ISDIR(found.st_mode)):
        raise FileError(f"{folder}: is a link or not your folder; choose another --output")


def settle_manifest(
    folder: Path, decisive: Facts, beside: Facts, *, write: bool, overwrite: bool
) -> None:
    """Write the manifest of a folder, and refuse a folder of another sweep.

    ``decisive`` are the facts that must agree. ``beside`` are further facts: ``text``, the
    configuration as it was written, and ``shards``, the number of shards. A manifest that another
    process has just written is kept unless ``overwrite`` is set. Raises FileError as `require_same`
    does.
    """
    path = folder / MANIFEST
    try:
        if write:
            with replacing(path, overwrite=overwrite, through_links=False) as partial:
                partial.write_text(json.dumps({**decisive, **beside}, indent=1), encoding="utf-8")
    except FileError:
        if overwrite or not os.path.lexists(path):
            raise
    require_same(f"{folder}: holds blocks", read_manifest(folder), decisive)


def require_same(
    what: str, earlier: Facts, now: Facts, otherwise: str = "delete the folder"
) -> None:
    """Refuse data that were computed for another configuration or by another gearchaos.

    ``earlier`` and ``now`` are decisive facts; those in ``now`` are compared. ``what`` names the
    data in the message, ``otherwise`` the remedy beside going back to the earlier configuration.
    Raises a FileError that names each difference with both values.
    """
    if keys := [key for key in now if earlier.get(key) != now[key]]:
        facts = ({key: said[key] for key in keys if key in said} for said in (earlier, now))
        raise FileError(
            f"{what} of another gearchaos or configuration, which differs in "
            f"{', '.join(_differing(*facts)) or keys[0]}; go back to that one, {otherwise} or "
            "choose another --output"
        )


def _differing(*facts: Facts) -> list[str]:
    """Return the software and the keys of the configuration that differ, each in words."""
    first, second = map(_flat, facts)
    return [
        f"{key} ({_short(first.get(key, 'absent'))}, now {_short(second.get(key, 'absent'))})"
        for key in {**first, **second}
        if key not in first or key not in second or repr(first[key]) != repr(second[key])
    ]


def _short(value: object) -> str:
    """Return a value as text; only the beginning of a long one."""
    text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]!r}..."


def _flat(facts: Facts) -> dict[str, Any]:
    flat = {key: facts[key] for key in (*Software._fields, "schema_version") if key in facts}
    with suppress(ValueError, RecursionError):  # Written by another program: no key is known.
        flat |= flat_tables(tomllib.loads(facts.get("configuration", "")))
    return flat


def folder_of(output: str | os.PathLike[str]) -> Path:
    """Return the folder of the blocks of an unfinished result file."""
    return Path(os.path.realpath(output) + ".blocks")


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a folder; raise FileError if it is missing or damaged."""
    path = folder / MANIFEST
    if not folder.is_dir():
        raise FileError(
            f"{folder}: no such folder; name the result file to be, beside which the blocks are"
        )
    try:
        manifest: dict[str, Any] = json.loads(unlinked_content(path, _LARGEST))
        tomllib.loads(manifest["configuration"])
        manifest["text"] = str(manifest["text"])
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise FileError(
            f"{path}: is damaged or missing ({reason(error)}); delete the folder to start again"
        ) from error
    return manifest
