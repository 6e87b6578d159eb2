"""What the finished blocks beside an output belong to: the manifest of their folder."""

from __future__ import annotations

import hashlib
import json
import os
import tomllib
from pathlib import Path
from typing import Any

from gearchaos.configuration.toml_text import flat_tables
from gearchaos.errors import FileError
from gearchaos.results.atomic_file import reason, replacing
from gearchaos.results.block_file import SHARD_SCHEMA_VERSION

STORE_SCHEMA = "gearchaos-shards"
MANIFEST = "manifest.json"

Columns = tuple[tuple[str, str, tuple[int, ...]], ...]


class Manifest:
    """What decides the numbers of a sweep, and with it whose shards are whose.

    Parameters
    ----------
    lanes : int
        Lanes of the sweep.
    columns : tuple of (name, dtype, row)
        As in `ShardFormat`.
    configuration : str
        The resolved configuration in TOML.
    text : str
        The configuration as it was written, which decides nothing.
    """

    def __init__(self, lanes: int, columns: Columns, configuration: str, text: str) -> None:
        self._decisive = {
            "schema": STORE_SCHEMA,
            "schema_version": SHARD_SCHEMA_VERSION,
            "lanes": lanes,
            "variables": columns,
            "configuration": configuration,
        }
        self._text = text

    @property
    def fingerprint(self) -> str:
        """A hash of all that decides the numbers."""
        text = json.dumps(self._decisive, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def write(self, folder: Path, overwrite: bool = True) -> None:
        """Write the manifest into the folder of the shards."""
        text = json.dumps({**self._decisive, "text": self._text}, indent=1)
        with replacing(folder / MANIFEST, overwrite=overwrite) as partial:
            partial.write_text(text, encoding="utf-8")

    def write_if_new(self, folder: Path) -> None:
        """Write the manifest unless there is one, or unless somebody else writes it just now."""
        path = folder / MANIFEST
        if path.exists():
            return
        try:
            self.write(folder, overwrite=False)
        except FileError:
            if not path.exists():
                raise

    def compare(self, folder: Path) -> None:
        """Make sure that the folder belongs to this sweep.

        Raises
        ------
        FileError
            If it does not; the message names the keys that differ.
        """
        path = folder / MANIFEST
        earlier = _read(path)
        try:
            keys = differing_keys(earlier["configuration"], str(self._decisive["configuration"]))
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            raise _damaged(path, error) from error
        own = json.loads(json.dumps(self._decisive))
        keys = keys or [key for key in own if own[key] != earlier.get(key)]
        if keys:
            raise FileError(
                f"{folder}: holds blocks of another configuration, which differs in "
                f"{', '.join(keys)}; restore these values, delete the folder or choose another "
                "--output"
            )


def folder_of(output: str | os.PathLike[str]) -> Path:
    """Return the folder of the shards of a result file to be."""
    return Path(os.path.realpath(output) + ".shards")


def stored_configuration(output: str | os.PathLike[str]) -> tuple[str, str]:
    """Return the configuration of the blocks beside an output: resolved, and as it was written.

    Raises
    ------
    FileError
        If there are no blocks, or if what describes them is damaged.
    """
    folder = folder_of(output)
    if not folder.is_dir():
        raise FileError(
            f"{folder}: no such folder; name the result file to be, beside which the blocks are"
        )
    manifest = _read(folder / MANIFEST)
    resolved, text = manifest.get("configuration"), manifest.get("text")
    if not isinstance(resolved, str) or not isinstance(text, str):
        raise _damaged(folder / MANIFEST, LookupError("it lacks the configuration"))
    return resolved, text or resolved


def differing_keys(one: str, other: str) -> list[str]:
    """List the dotted keys in which two TOML texts differ, with both values."""
    first, second = (flat_tables(tomllib.loads(text)) for text in (one, other))
    return [
        f"{key} ({first.get(key, 'absent')}, now {second.get(key, 'absent')})"
        for key in {**first, **second}
        if key not in first or key not in second or repr(first[key]) != repr(second[key])
    ]


def _read(path: Path) -> dict[str, Any]:
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise _damaged(path, error) from error
    if not isinstance(manifest, dict):
        raise _damaged(path, TypeError("it is no table"))
    version, own = str(manifest.get("schema_version", "")), SHARD_SCHEMA_VERSION.split(".")[0]
    if version.split(".")[0] != own:
        raise FileError(
            f"{path.parent}: has version {version!r} of the format of blocks, of which this "
            f"gearchaos reads {own}.x; finish it with the gearchaos that began it, or delete the "
            "folder"
        )
    return manifest


def _damaged(path: Path, error: BaseException) -> FileError:
    return FileError(
        f"{path}: is damaged or missing ({reason(error)}); delete the folder to start again"
    )
