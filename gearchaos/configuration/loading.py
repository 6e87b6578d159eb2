"""A configuration file, read and checked."""

import os
from collections.abc import Iterable
from typing import TypeAlias

from gearchaos.configuration.files import text_of_file
from gearchaos.configuration.models import Configuration

Given: TypeAlias = Configuration | str | os.PathLike[str]


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
