"""The configuration as JSON Schema for editors, and as a table of keys for the documentation."""

from typing import Any

from gearchaos.configuration.base import Configuration, configuration_keys
from gearchaos.configuration.docstrings import docstring_of
from gearchaos.configuration.keys import Key
from gearchaos.configuration.messages import shown
from gearchaos.configuration.plausible import PLAUSIBLE


def json_schema(kind: type[Configuration]) -> dict[str, Any]:
    """Return the JSON Schema of a configuration file of this kind."""
    schema: dict[str, Any] = _without_null(kind.model_json_schema())
    _describe(schema, kind)
    parameter = schema["$defs"]["Sweep"]["properties"]["parameter"]
    parameter["enum"] = list(kind.parameters)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _describe(schema: dict[str, Any], kind: type[Configuration]) -> None:
    """Add the descriptions that are docstrings to the properties of a schema."""
    declared: dict[str, list[Key]] = {}
    for key in configuration_keys(kind).values():
        declared.setdefault(key.place[0].__name__, []).append(key)
    for table in (schema, *schema["$defs"].values()):
        for key in declared.get(table["title"], ()):
            text = docstring_of(*key.place)
            name = key.path.rpartition(".")[2]
            if text:
                table["properties"][name].setdefault("description", text)


def _without_null(node: Any) -> Any:
    """Return a schema without null: in TOML an absent key is simply not required."""
    if isinstance(node, list):
        return [_without_null(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    result = {name: _without_null(entry) for name, entry in node.items()}
    choices = [entry for entry in result.pop("anyOf", []) if entry != {"type": "null"}]
    if len(choices) == 1:
        result = {**choices[0], **result}
    elif choices:
        result["anyOf"] = choices
    return {name: entry for name, entry in result.items() if entry is not None}


def key_tables(kind: type[Configuration]) -> str:
    """Return one Markdown table of keys for every table of a configuration file of this kind."""
    rows: dict[str, list[Key]] = {}
    for path, key in configuration_keys(kind).items():
        if not key.tables:
            rows.setdefault(path.rpartition(".")[0], []).append(key)
    return "\n\n".join(_table(kind, name, keys) for name, keys in rows.items()) + "\n"


def _table(kind: type[Configuration], name: str, keys: list[Key]) -> str:
    """Return the Markdown table of one table."""
    title = f"### `[{name}]`" if name else "### Top level"
    lines = [
        title,
        "",
        "| key | type | unit | range or choices | default | example | meaning |",
        "|---|---|---|---|---|---|---|",
    ]
    for key in keys:
        column, unit = key.path.rpartition(".")[2], "" if key.units == "1" else key.units
        usual = PLAUSIBLE.get(column)
        bounds = [key.valid.bounds, f"usually {usual.words}" if usual and usual.low else ""]
        limits = "; ".join(filter(None, bounds))
        # A key that selects the kind of a table has one choice per kind; it is not a range.
        choices = ", ".join(f"`{one}`" for one in key.choices if len(key.choices) > 1)
        example = f"`{key.example}`" if key.example else ""
        given = [limits or choices, _default(kind, key), example]
        cells = [f"`{column}`", key.type_word, unit, *given, key.wording]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _default(kind: type[Configuration], key: Key) -> str:
    """Return the default of a key as TOML."""
    if key.field.is_required():
        return "required"
    default = kind.default_of(key)
    return "" if default is None else f"`{shown(default)}`"
