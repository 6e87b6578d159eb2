"""TOML text: reading files, conversion to tables and back, and `key.path=value` overrides."""

import json
import os
import re
import stat
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from gearchaos.errors import ConfigurationError, FileError

LARGEST_FILE = 4 * 1024 * 1024
"""Largest file in bytes: several hundred thousand values, and any content is read in seconds."""

CONFIGURATION = "configuration"
"""Name of a configuration file in messages."""

_DEEPEST = 8
"""Largest number of parts of the key of an override."""
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+"""
_ENDLESS_KEY = re.compile(rf"(?<![A-Za-z0-9_-])(?:{_PART}\.[ \t]*+){{64}}")
"""A key with 64 parts, which no configuration has: tomllib takes quadratic time for it."""

_DECIMAL_COMMA = re.compile(
    r"^[^\n#=\[\"']{1,200}=[ \t]*([+-]?\d{1,20}),(\d{1,20})[ \t]*(?:#|\r?$)", re.M
)
"""A number with a decimal comma as the whole value of a key."""

_ENDLESS_INTEGER = re.compile(r"0[xob][0-9A-Fa-f_]{1000}")
"""An integer that Python reads but does not print."""


def text_of_file(source: str, what: str = CONFIGURATION) -> str:
    """Read the text of a configuration file, or of another file that messages call ``what``.

    A configuration may come from a pipe; other files must be regular. Raises FileError or
    ConfigurationError if the file cannot be read.
    """
    if not source:
        raise FileError("no configuration file: the path is empty; name a TOML file")
    try:
        content = _content(source, regular=what != CONFIGURATION)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        rule = f"cannot be read: {reason}"
        raise FileError(f"{source}: {rule}; check the path of the {what}") from None
    if content.startswith(b"\x89HDF") and what == CONFIGURATION:
        remedy = f"`gearchaos info {source}` shows that of a result"
        raise ConfigurationError(f"{source}: is HDF5, and a configuration is TOML; {remedy}")
    if len(content) > LARGEST_FILE:
        size = f"larger than {LARGEST_FILE // 1024**2} MB, so hardly a {what}"
        remedy = "give many swept values as sweep.from, sweep.to and sweep.count"
        raise ConfigurationError(f"{source}: {size}; name another file, or {remedy}")
    try:
        # utf-8-sig: some editors begin a file with a byte order mark.
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ConfigurationError(
            f"{source}: line {line} is not UTF-8 text; save the {what} as UTF-8"
        ) from None


def _content(source: str, regular: bool) -> bytes:
    """Read a file up to the largest size plus one byte; ValueError if it is not regular."""
    if source == "-":
        with open(0, "rb", closefd=False) as file:
            return file.read(LARGEST_FILE + 1)
    # Non-blocking: opening a pipe would wait for its writer; it is then rejected.
    more = getattr(os, "O_NONBLOCK", 0) if regular else 0
    with open(source, "rb", opener=lambda path, flags: os.open(path, flags | more)) as file:
        if regular and not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise ValueError("it is not a regular file")
        return file.read(LARGEST_FILE + 1)


def quoted_key(name: str) -> str:
    """Return a key as TOML writes it: bare where possible, else in quotes."""
    return name if _BARE_KEY.fullmatch(name) else toml_literal(name)


def tables_from_toml(text: str, source: str) -> dict[str, Any]:
    """Parse TOML text; ConfigurationError with the line and column of the first error."""
    try:
        if _ENDLESS_KEY.search(text):
            raise RecursionError
        if _ENDLESS_INTEGER.search(text):
            raise ValueError("an integer of thousands of digits")
        text.encode()
        return tomllib.loads(text)
    except RecursionError:
        raise ConfigurationError(
            f"{source}: nested too deeply to be a configuration; tables go three levels deep"
        ) from None
    # Besides TOMLDecodeError: endless integers and invalid Unicode raise a plain ValueError.
    except ValueError as error:
        remedy = "write `key = value`, each key once, text in double quotes, tables as [name]"
        if comma := _DECIMAL_COMMA.search(text):
            remedy = f"write decimals with a point: {comma[1]}.{comma[2]} for {comma[1]},{comma[2]}"
        raise ConfigurationError(f"{source}: not valid TOML: {error}; {remedy}") from None


def with_overrides(
    tables: Mapping[str, Any], overrides: Iterable[str], source: str
) -> dict[str, Any]:
    """Return the tables with ``key.path=value`` overrides applied in order.

    A value that is not TOML is a text, so that ``start.kind=rest`` needs no quotes. Raises
    ConfigurationError with one message per override that has another form or passes through a
    value; the messages call the file ``source``.
    """
    result = dict(tables)
    problems = []
    for override in overrides:
        path, equals, value = override.partition("=")
        names = [name.strip() for name in path.split(".")]
        if not equals or not all(names) or len(names) > _DEEPEST:
            problems.append(
                f"override {override!r}: must have the form key.path=value, "
                "such as integration.steps_per_period=100"
            )
            continue
        try:
            override.encode()
            result = with_value(result, names, _value(value))
        except UnicodeEncodeError:
            problems.append(f"override {override!r}: is not UTF-8 text; write it as UTF-8")
        except KeyError as error:
            problems.append(
                f"override {override!r}: {error.args[0]} is not a table in {source}; "
                "name a key inside a table"
            )
    if problems:
        raise ConfigurationError(problems)
    return result


def with_value(tables: Mapping[str, Any], names: list[str], value: Any) -> dict[str, Any]:
    """Return a copy of nested tables in which one value is replaced; None removes it.

    Raises KeyError with the path of a value that would have to be a table.
    """
    head, *rest = names
    result = dict(tables)
    if not rest:
        result[head] = value
        return {key: entry for key, entry in result.items() if entry is not None}
    inner = result.get(head, {})
    if not isinstance(inner, Mapping):
        raise KeyError(head)
    result[head] = with_value(inner, rest, value)
    return result


def flat_tables(tables: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """Return the values of nested tables by dotted path; an empty table is a value."""
    flat: dict[str, Any] = {}
    for name, value in tables.items():
        here = f"{path}{quoted_key(name)}"
        inner = isinstance(value, Mapping) and len(value) > 0
        flat |= flat_tables(value, f"{here}.") if inner else {here: value}
    return flat


def toml_text(tables: Mapping[str, Any]) -> str:
    """Write nested tables of texts, numbers, booleans and lists as TOML, one line per value."""
    flat = flat_tables(tables)
    return "".join(f"{path} = {toml_literal(value)}\n" for path, value in flat.items())


def toml_literal(value: Any) -> str:
    """Write one value as TOML, a mapping as an inline table; ValueError if not finite."""
    # JSON values are TOML except for the colon and for DEL, which TOML escapes.
    separators = (", ", " = ")
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=separators)
    return text.replace("\x7f", "\\u007f")


def _value(text: str) -> Any:
    """Return the value of an override."""
    try:
        parsed = tables_from_toml(f"value = {text}", "override")
    except ConfigurationError:
        return text.strip()
    # With a line break, the text could contain further keys.
    return parsed["value"] if parsed.keys() == {"value"} else text
