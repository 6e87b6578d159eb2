"""The manifest beside an unfinished output: whose its finished blocks are."""

import json
import os
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

from gearchaos.configuration.toml_text import flat_tables
from gearchaos.errors import FileError
from gearchaos.results.atomic_file import reason, replacing, unlinked_content
from gearchaos.version import Software

Facts: TypeAlias = Mapping[str, Any]
MANIFEST = "manifest.json"
_LARGEST = 64 << 20
_LONGEST = 60


def settle_manifest(
    folder: Path, decisive: Facts, beside: Facts, *, write: bool, overwrite: bool
) -> None:
    """Write the manifest of a folder, and refuse a folder of another sweep.

    ``beside`` decides nothing: ``text``, the configuration as it was written, and ``shards``, into
    how many whoever began divided the sweep. A manifest that somebody else has just written stays
    unless `overwrite` is set. Raises FileError as `require_same` does.
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
    """Refuse what was computed for another configuration or by another gearchaos.

    ``earlier`` and ``now`` are decisive facts, of which those are compared that there are now;
    ``what`` says where what was found, and ``otherwise`` what to do unless one goes back to it.
    Raises a FileError that names what differs, with both values.
    """
    if keys := [key for key in now if earlier.get(key) != now[key]]:
        facts = ({key: said[key] for key in keys if key in said} for said in (earlier, now))
        raise FileError(
            f"{what} of another gearchaos or configuration, which differs in "
            f"{', '.join(_differing(*facts)) or keys[0]}; go back to that one, {otherwise} or "
            "choose another --output"
        )


def _differing(*facts: Facts) -> list[str]:
    """Word software and keys of the configuration in which two rows of facts differ."""
    first, second = map(_flat, facts)
    return [
        f"{key} ({_short(first.get(key, 'absent'))}, now {_short(second.get(key, 'absent'))})"
        for key in {**first, **second}
        if key not in first or key not in second or repr(first[key]) != repr(second[key])
    ]


def _short(value: object) -> str:
    """Word a value, of a list or the text of a file no more than where it begins."""
    text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]!r}..."


def _flat(facts: Facts) -> dict[str, Any]:
    flat = {key: facts[key] for key in (*Software._fields, "schema_version") if key in facts}
    with suppress(ValueError, RecursionError):  # Not written by us: all keys are absent.
        flat |= flat_tables(tomllib.loads(facts.get("configuration", "")))
    return flat


def folder_of(output: str | os.PathLike[str]) -> Path:
    """Return the folder of the blocks of a result file to be."""
    return Path(os.path.realpath(output) + ".blocks")


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a folder; FileError if there is none, or it is damaged."""
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
