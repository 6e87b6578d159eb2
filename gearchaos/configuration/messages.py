"""Faults of a configuration as sentences: file, key, value, rule, remedy."""

import difflib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from gearchaos.configuration.keys import NAME, Key
from gearchaos.configuration.toml_text import quoted_key, toml_literal

MOST_SHOWN = 100
"""Largest number of faults in words; a file with more is hardly a configuration."""
MOST_CHARACTERS = 80
"""Largest number of characters of a value in a message."""

_RULES = {
    "missing": "is missing",
    "extra_forbidden": "unknown key",
    "greater_than_equal": "must be at least {ge:.12g}",
    "less_than_equal": "must be at most {le:.12g}",
    "multiple_of": "must be a whole number",
    "too_short": "needs at least {min_length} value(s)",
    "too_long": "takes at most {max_length} value(s)",
    "literal_error": "must be one of {expected}",
    "union_tag_invalid": "must be one of {expected_tags}",
    "union_tag_not_found": "is missing",
    "string_pattern_mismatch": "has another form",
    "value_error": "{error}",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be a text",
    "tuple_type": "must be a list",
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type"), "must be a table"),
}
"""Rules by the type of the fault in pydantic; other faults have the message of pydantic."""

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")

_TAGS = ("kind", "shape")
"""Keys that select the kind of a table."""


class Fault(NamedTuple):
    """One fault: dotted path of the key, broken rule, remedy, and value if any."""

    key: str
    rule: str
    remedy: str = ""
    value: object = None

    def text(self, source: str) -> str:
        """Return the fault as one line that begins with the name of the file."""
        value = "" if self.value is None else f" = {shown(self.value)}"
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{source}: {self.key}{value}: {self.rule}{remedy}"


def fault_texts(faults: Iterable[Fault], source: str, more: int = 0) -> list[str]:
    """Return the first hundred faults as lines, without repetitions.

    ``more``: number of further faults that have no words.
    """
    lines = list(dict.fromkeys(fault.text(source) for fault in faults))
    rest = max(0, len(lines) - MOST_SHOWN) + more
    return lines if rest == 0 else [*lines[:MOST_SHOWN], f"{source}: and {rest} more faults"]


IN_UM = {"um": 1.0, "mm": 1e3, "m": 1e6, "nm": 1e-3}
"""Units of length at the end of keys, in um."""


def shown(value: object) -> str:
    """Return a value as TOML writes it, shortened, with printable characters only."""
    try:
        text = toml_literal(value)
    except (TypeError, ValueError):  # A date or a number that is not finite.
        try:
            text = str(value)
        except ValueError:  # The integer has more digits than Python prints.
            text = "an integer of thousands of digits"
    text = text if len(text) <= MOST_CHARACTERS else f"{text[:MOST_CHARACTERS]}..."
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def suggestion(word: str, words: Iterable[str]) -> str:
    """Return ``did you mean `x`?`` for the nearest word, or an empty text."""
    by_lower = {candidate.lower(): candidate for candidate in words}
    start = word[:100].lower()
    close = difflib.get_close_matches(start, by_lower, n=1) or [
        candidate for candidate in by_lower if len(start) > 2 and candidate.startswith(start)
    ]
    return f"did you mean `{by_lower[close[0]]}`?" if close else ""


def faults_of(error: ValidationError, keys: Mapping[str, Key]) -> tuple[list[Fault], int]:
    """Return the first hundred faults in words, and the number of others; ``keys`` by path."""
    found = error.errors(include_url=False)
    # A long invalid list can contain a million faults.
    worded = [_fault_of(one, keys) for one in found[:MOST_SHOWN]]
    return worded, len(found) - len(worded)


def _fault_of(error: ErrorDetails, keys: Mapping[str, Key]) -> Fault:
    """Return one fault of pydantic in words."""
    kind, value = error["type"], error["input"]
    rule = _RULES.get(kind, error["msg"].replace("Input should", "must"))
    rule = rule.format(**error.get("ctx", {}))
    names = _names(error, keys)
    if kind.startswith("union_tag"):
        names.append(error["ctx"]["discriminator"].strip("'"))
        value = value.get(names[-1])
    path = declared_path([name for name in names if isinstance(name, str)], keys)
    remedy = keys[path].remedy if path in keys and kind != "value_error" else ""
    if kind == "extra_forbidden":
        table = path.rpartition(".")[0]
        remedy = _in_unit(str(names[-1]), value, table, keys)
        remedy = remedy or _elsewhere(str(names[-1]), table, keys)
        if path in keys:
            # Another kind of this table has the key; in pydantic the kind precedes the key.
            tag = next(name for name in _TAGS if f"{table}.{name}" in keys)
            rule = f'has no meaning with {tag} = "{error["loc"][-2]}"'
            here = ".".join(map(str, names[:-1]))
            remedy = f"drop it, or choose another {here}.{tag}"
    elif isinstance(value, str) and kind in ("literal_error", "union_tag_invalid"):
        remedy = suggestion(value, re.findall(r"'([^']*)'", rule)) or remedy
    elif isinstance(value, str) and kind == "float_type" and NUMBER.fullmatch(value.strip()):
        remedy = f"write it without the quotes: {value.strip()}"
    if kind in ("missing", "value_error") or error["loc"][-1] == "[key]":
        value = None
    dotted = "".join(
        f"[{name}]" if isinstance(name, int) else f".{quoted_key(name)}" for name in names
    )
    return Fault(dotted.lstrip("."), rule, remedy, value)


def declared_path(names: Sequence[str], keys: Collection[str]) -> str:
    """Return the path under which a key is declared: tables that a file names are called NAME."""
    path = ""
    for name in names:
        here = f"{path}.{name}".lstrip(".")
        named = f"{path}.{NAME}."
        known = here in keys or not any(key.startswith(named) for key in keys)
        path = here if known else named.rstrip(".")
    return path


def _names(error: ErrorDetails, keys: Mapping[str, Key]) -> list[int | str]:
    """Return the names of the keys, and the indices in lists, on the path to an error."""
    names: list[int | str] = []
    tagged = False
    for name in error["loc"]:
        # pydantic adds the kind of a table that has several, and "[key]" for an invalid key.
        added = tagged or (name == "[key]" and error["type"] != "extra_forbidden")
        names += [] if added else [name]
        words = [one for one in names if isinstance(one, str)]
        key = keys.get(declared_path(words, keys))
        tagged = not added and key is not None and len(key.tables) > 1
    return names


def _in_unit(name: str, value: object, table: str, keys: Mapping[str, Key]) -> str:
    """Return the remedy for a key that is known with another unit of length; empty for others."""
    stem, _, unit = name.rpartition("_")
    if unit not in IN_UM or not isinstance(value, int | float) or isinstance(value, bool):
        return ""
    for other, size in IN_UM.items():
        if f"{table}.{stem}_{other}".lstrip(".") in keys:
            return f"write {stem}_{other} = {float(f'{value * IN_UM[unit] / size:.12g}')}"
    return ""


def _elsewhere(name: str, table: str, keys: Mapping[str, Key]) -> str:
    """Return the remedy for an unknown key of a table."""
    here = [path.rpartition(".")[2] for path in keys if path.rpartition(".")[0] == table]
    if near := suggestion(name, here):
        return near
    for path in keys:
        if path.rpartition(".")[2] == name:
            return f"it belongs elsewhere: `{path}`"
    place = f"[{table}]" if table else "the top level"
    return f"the keys of {place} are {', '.join(here)}"
