"""A configuration file, read and checked."""

from __future__ import annotations

import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TypeAlias

from gearchaos.configuration.models import Configuration
from gearchaos.errors import ConfigurationError, FileError

Given: TypeAlias = Configuration | str | os.PathLike[str]
LARGEST_FILE = 4 * 1024 * 1024
"""Bytes: room for several hundred thousand swept values, and read in seconds whatever it holds."""


def load_config(path: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Configuration:
    """Read a configuration from a TOML file.

    The path ``-`` is standard input. Overrides are such as ``"integration.steps_per_period=100"``;
    what is not TOML is taken as text.

    Raises
    ------
    FileError
        If the file cannot be read.
    ConfigurationError
        If it is not a sound configuration: one message per fault, all faults at once.
    """
    source = os.fspath(path)
    return Configuration.from_toml(text_of_file(source), source, overrides)


def configuration_of(given: Given) -> Configuration:
    """Return a configuration, or read it from the TOML file at a path, see `load_config`."""
    return given if isinstance(given, Configuration) else load_config(given)


def text_of_file(source: str) -> str:
    """Read the text of a file at a path; FileError or ConfigurationError if it cannot be read."""
    if not source:
        raise FileError("no configuration file: the path is empty; name a TOML file")
    try:
        if source == "-":
            content = _standard_input()
        else:
            with Path(source).open("rb") as file:
                content = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise FileError(f"{source}: no such file; check the path of the configuration") from None
    except IsADirectoryError:
        raise FileError(f"{source}: is a directory; name a TOML file in it") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise FileError(f"{source!r}: cannot be read: {reason}") from None
    if content.startswith(b"\x89HDF"):
        remedy = f"`gearchaos info {source}` shows that of a result"
        raise ConfigurationError(f"{source}: is HDF5, and a configuration is TOML; {remedy}")
    if len(content) > LARGEST_FILE:
        raise ConfigurationError(
            f"{source}: larger than {LARGEST_FILE // 1024**2} MB, so hardly a configuration; "
            "give many swept values as sweep.from, sweep.to and sweep.count"
        )
    try:
        # utf-8-sig: some editors begin a file with a byte order mark.
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ConfigurationError(
            f"{source}: line {line} is not UTF-8 text; save the file as UTF-8"
        ) from None


@cache
def _standard_input() -> bytes:
    """Read it for whoever asks first, and keep it for who asks again."""
    with open(0, "rb", closefd=False) as stream:
        return stream.read(LARGEST_FILE + 1)
