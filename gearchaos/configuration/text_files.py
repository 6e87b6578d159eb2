"""Text files of a user, read whole."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gearchaos.errors import ConfigurationError, FileError

LARGEST_FILE = 4 * 1024 * 1024
"""Bytes: room for several hundred thousand swept values, and read in seconds whatever it holds."""

CONFIGURATION = "configuration"
_TOO_LARGE = {
    CONFIGURATION: "give many swept values as sweep.from, sweep.to and sweep.count",
}


def text_of_file(source: str, what: str = CONFIGURATION) -> str:
    """Read the text of a file at a path, a configuration or what else the messages call it.

    Raises FileError or ConfigurationError if it cannot be read.
    """
    if not source:
        raise FileError("no configuration file: the path is empty; name a TOML file")
    try:
        if source == "-":
            content = _standard_input()
        else:
            with Path(source).open("rb") as file:
                content = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise FileError(f"{source}: no such file; check the path of the {what}") from None
    except IsADirectoryError:
        kind = "TOML file" if what == CONFIGURATION else "file"
        raise FileError(f"{source}: is a directory; name a {kind} in it") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise FileError(f"{source!r}: cannot be read: {reason}") from None
    if content.startswith(b"\x89HDF") and what == CONFIGURATION:
        remedy = f"`gearchaos info {source}` shows that of a result"
        raise ConfigurationError(f"{source}: is HDF5, and a configuration is TOML; {remedy}")
    if len(content) > LARGEST_FILE:
        raise ConfigurationError(
            f"{source}: larger than {LARGEST_FILE // 1024**2} MB, so hardly a {what}; "
            + _TOO_LARGE.get(what, "name another file")
        )
    try:
        # utf-8-sig: some editors begin a file with a byte order mark.
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ConfigurationError(
            f"{source}: line {line} is not UTF-8 text; save the {what} as UTF-8"
        ) from None


@cache
def _standard_input() -> bytes:
    """Read it for whoever asks first, and keep it for who asks again."""
    with open(0, "rb", closefd=False) as stream:
        return stream.read(LARGEST_FILE + 1)
