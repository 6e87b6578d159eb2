"""What the finished blocks beside an output belong to: the manifest of their folder."""

from __future__ import annotations

import hashlib
import json
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gearchaos.configuration.toml_text import flat_tables
from gearchaos.errors import FileError
from gearchaos.results.atomic_file import reason, replacing, unlinked_content
from gearchaos.results.block_file import BLOCK_SCHEMA_VERSION

STORE_SCHEMA = "gearchaos-blocks"
MANIFEST = "manifest.json"
_LARGEST = 64 << 20


class Manifest:
    """What decides the numbers of a sweep, and with it whose blocks are whose.

    Parameters
    ----------
    folder : Path
        Where the manifest is.
    decisive : mapping
        ``lanes``, ``variables`` and ``configuration``, the resolved one in TOML.
    beside : mapping
        What decides nothing: ``text``, the configuration as it was written, and ``shards``, into
        how many the sweep was divided by whoever began it.
    """

    def __init__(
        self, folder: Path, decisive: Mapping[str, Any], beside: Mapping[str, Any]
    ) -> None:
        self._folder, self._path, self._beside = folder, folder / MANIFEST, beside
        versions = {"schema": STORE_SCHEMA, "schema_version": BLOCK_SCHEMA_VERSION}
        # As it is read again: with lists for tuples.
        self._decisive = json.loads(json.dumps({**versions, **decisive}))

    @property
    def fingerprint(self) -> str:
        """A hash of all that decides the numbers."""
        return hashlib.sha256(json.dumps(self._decisive, sort_keys=True).encode()).hexdigest()

    def write(self, overwrite: bool = True) -> None:
        """Write the manifest; one that somebody else has just written may be left as it is."""
        text = json.dumps({**self._decisive, **self._beside}, indent=1)
        try:
            with replacing(self._path, overwrite=overwrite, through_links=False) as partial:
                partial.write_text(text, encoding="utf-8")
        except FileError:
            if overwrite or not self._path.exists():
                raise

    def compare(self) -> None:
        """Raise a FileError that names the keys that differ if the folder is of another sweep."""
        earlier = read_manifest(self._folder)
        keys = differing_keys(earlier["configuration"], self._decisive["configuration"])
        keys = keys or [key for key in self._decisive if self._decisive[key] != earlier.get(key)]
        if keys:
            raise FileError(
                f"{self._folder}: holds blocks of another configuration, which differs in "
                f"{', '.join(keys)}; restore these values, delete the folder or choose another "
                "--output"
            )


def folder_of(output: str | os.PathLike[str]) -> Path:
    """Return the folder of the blocks of a result file to be."""
    return Path(os.path.realpath(output) + ".blocks")


def stored_configuration(output: str | os.PathLike[str]) -> tuple[str, str]:
    """Return the configuration of the blocks beside an output: resolved, and as it was written.

    Raises FileError if there are no blocks, or if what describes them is damaged.
    """
    folder = folder_of(output)
    if not folder.is_dir():
        raise FileError(
            f"{folder}: no such folder; name the result file to be, beside which the blocks are"
        )
    manifest = read_manifest(folder)
    return manifest["configuration"], manifest["text"] or manifest["configuration"]


def differing_keys(one: str, other: str) -> list[str]:
    """List the dotted keys in which two TOML texts differ, with both values."""
    first, second = (flat_tables(tomllib.loads(text)) for text in (one, other))
    return [
        f"{key} ({first.get(key, 'absent')}, now {second.get(key, 'absent')})"
        for key in {**first, **second}
        if key not in first or key not in second or repr(first[key]) != repr(second[key])
    ]


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a folder; FileError if there is none, or none of this version."""
    path = folder / MANIFEST
    try:
        manifest: dict[str, Any] = json.loads(unlinked_content(path, _LARGEST))
        version, own = str(manifest.get("schema_version", "")), BLOCK_SCHEMA_VERSION.split(".")[0]
        if version.split(".")[0] != own:
            raise FileError(
                f"{folder}: has version {version!r} of the format of blocks, of which this "
                f"gearchaos reads {own}.x; finish it with the gearchaos that began it, or delete "
                "the folder"
            )
        tomllib.loads(manifest["configuration"])
        manifest["text"] = str(manifest["text"])
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise FileError(
            f"{path}: is damaged or missing ({reason(error)}); delete the folder to start again"
        ) from error
    return manifest
