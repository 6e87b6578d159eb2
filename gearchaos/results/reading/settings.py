"""The configuration that a result was computed with, key by key, and where each value is from."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from gearchaos.configuration.messages import shown
from gearchaos.configuration.toml_text import flat_tables, tables_from_toml
from gearchaos.errors import ConfigurationError


class Setting(NamedTuple):
    """A key of a configuration, its value as TOML, and "", "by default" or "set for this run"."""

    key: str
    value: str
    origin: str


def settings_of(metadata: Mapping[str, Any]) -> list[Setting]:
    """Return all keys of the configuration of a result; none if it has no valid one."""
    from gearchaos.models import Configuration

    text = str(metadata.get("configuration", ""))
    resolved = str(metadata.get("configuration_resolved", ""))
    try:
        alone = Configuration.from_toml(text, "configuration").resolved_toml()
        written, by_itself, ran = (
            flat_tables(tables_from_toml(toml, "configuration")) for toml in (text, alone, resolved)
        )
    except ConfigurationError:  # The numbers are readable without a valid configuration.
        return []
    origins = {key: "" if key in written else "by default" for key in ran}
    origins |= {key: "set for this run" for key in ran if by_itself.get(key) != ran[key]}
    return [Setting(key, shown(value), origins[key]) for key, value in ran.items()]
