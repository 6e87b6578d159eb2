"""The configuration described for others: JSON Schema for editors, a table of keys for people."""

from typing import Any

from gearchaos.configuration.keys import Key
from gearchaos.configuration.messages import shown
from gearchaos.configuration.models import Configuration, configuration_keys
from gearchaos.configuration.tables import SWEEPABLE_GROUPS, SWEEPABLE_KEYS
from gearchaos.gear.groups import GROUPS_BY_NAME


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a configuration file."""
    schema: dict[str, Any] = _without_null(Configuration.model_json_schema())
    parameter = schema["$defs"]["Sweep"]["properties"]["parameter"]
    parameter["enum"] = [*SWEEPABLE_GROUPS, *SWEEPABLE_KEYS]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _without_null(node: Any) -> Any:
    # TOML has no null: a key that may be absent is simply not required.
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


def key_tables() -> str:
    """Return one Markdown table of keys for every table of a configuration file."""
    rows: dict[str, list[Key]] = {}
    for path, key in configuration_keys().items():
        if not key.tables:
            rows.setdefault(path.rpartition(".")[0], []).append(key)
    return "\n\n".join(_table(name, keys) for name, keys in rows.items()) + "\n"


def _table(name: str, keys: list[Key]) -> str:
    title = f"### `[{name}]`" if name else "### Top level"
    lines = [
        title,
        "",
        "| key | unit | range or choices | default | meaning |",
        "|---|---|---|---|---|",
    ]
    for key in keys:
        column, unit = key.path.rpartition(".")[2], "" if key.units == "1" else key.units
        # The one choice of a key that tells kinds of a table apart is that of the first kind.
        choices = ", ".join(f"`{one}`" for one in key.choices if len(key.choices) > 1)
        cells = [f"`{column}`", unit, key.valid.bounds or choices, _default(key), key.wording]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _default(key: Key) -> str:
    if key.field.is_required():
        return "required"
    table, _, name = key.path.rpartition(".")
    default = GROUPS_BY_NAME[name].default if table == "groups" else key.field.default
    return "" if default is None else f"`{shown(default)}`"
