"""The configuration that a result was computed with, key by key, and where each value is from."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from gearchaos.configuration.messages import shown
from gearchaos.configuration.toml_text import flat_tables, tables_from_toml
from gearchaos.errors import ConfigurationError

OF_INTEGRATION = "transient_periods", "recorded_periods", "steps_per_period"
"""Numbers of an integration that may differ from the configuration, or be missing there."""


class Setting(NamedTuple):
    """A key of a configuration, its value as TOML, and the origin of the value.

    The origin is empty for a value that the configuration gives itself.
    """

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
    origins = {
        key: "" if key in written else _unwritten(key, value, written) for key, value in ran.items()
    }
    origins |= {key: "set for this run" for key in ran if by_itself.get(key) != ran[key]}
    for name in OF_INTEGRATION:
        key, used = f"integration.{name}", metadata.get(name)
        if used is not None and key not in ran:
            ran[key], origins[key] = used, "chosen for this run"
        elif used is not None and used != ran[key]:
            origins[key] = ", ".join(filter(None, [origins[key], f"{used} were computed"]))
    return [Setting(key, shown(value), origins[key]) for key, value in ran.items()]


def _unwritten(key: str, value: Any, written: Mapping[str, Any]) -> str:
    """Return the origin of a value that the configuration does not write itself."""
    file = written.get(f"{key.rpartition('.')[0]}.file")
    return f"from {file}" if file is not None and isinstance(value, list) else "by default"
