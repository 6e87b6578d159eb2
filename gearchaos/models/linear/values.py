"""Numbers inside nested tables: which ones there are, and copies with other values."""

from collections.abc import Iterator, Mapping
from typing import Any

from gearchaos.configuration.keys import Table
from gearchaos.models.stiffness_table import StiffnessTable


def numbers_in(tables: Any, path: str = "") -> Iterator[tuple[str, Table, str]]:
    """Give dotted path, table and name of every number (float) inside a table or named tables.

    The settings of a fit are no numbers of the machine.
    """
    if isinstance(tables, StiffnessTable):
        return
    if isinstance(tables, Mapping):
        for name, table in tables.items():
            yield from numbers_in(table, f"{path}.{name}".lstrip("."))
    elif isinstance(tables, Table):
        for name, value in tables:
            here = f"{path}.{name}".lstrip(".")
            if isinstance(value, float):
                yield here, tables, name
            else:
                yield from numbers_in(value, here)


def with_numbers(tables: Any, values: Mapping[str, float], path: str = "") -> Any:
    """Return a table, or named tables, with other numbers at dotted paths; nothing is checked."""
    below = {at: value for at, value in values.items() if at.startswith(f"{path}." if path else "")}
    if not below:
        return tables
    if isinstance(tables, Mapping):
        return {
            name: with_numbers(one, below, f"{path}.{name}".lstrip("."))
            for name, one in tables.items()
        }
    changed: dict[str, Any] = {}
    for name, value in tables:
        here = f"{path}.{name}".lstrip(".")
        if here in below:
            changed[name] = float(below[here])
        elif isinstance(value, Mapping | Table):
            changed[name] = with_numbers(value, below, here)
    return tables.model_copy(update=changed)
