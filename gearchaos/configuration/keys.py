"""Tables of a configuration and their keys: their declarations, and access to these."""

import typing
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.fields import FieldInfo

from gearchaos.configuration.docstrings import docstring_of
from gearchaos.configuration.ranges import Range
from gearchaos.configuration.toml_text import toml_literal


class Table(BaseModel):
    """One table of the file: no conversions, no unknown keys, finite numbers only, immutable."""

    model_config = ConfigDict(
        defer_build=True,
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        validate_default=True,
        protected_namespaces=(),
    )

    @model_validator(mode="before")
    @classmethod
    def _numbers_of_numpy(cls, given: Any) -> Any:
        """Accept numbers of NumPy as numbers of Python."""
        kinds = (np.generic, np.ndarray)
        entries = given.items() if isinstance(given, dict) else ()
        return {k: v.tolist() if isinstance(v, kinds) else v for k, v in entries} or given

    def tables(self, include: Collection[str] | None = None) -> dict[str, Any]:
        """Return nested mappings of all known values by key, defaults included.

        ``include``: keys of this table, by default all.
        """
        # Before pydantic 2.11, no setting of the model makes aliases the default.
        names = None if include is None else set(include)
        return self.model_dump(include=names, exclude_none=True, by_alias=True)


NAME = "NAME"
"""Part of the path of a key, in place of the name that a file gives one of several tables."""

MOST_SHOWN = 4
"""Most keys of a table that a message shows as an example."""

# TOML has lists, the tables have tuples; entries are still checked strictly.
AS_LIST = Field(strict=False)
Numbers: TypeAlias = Annotated[tuple[float, ...], AS_LIST]


def key(
    description: str = "", units: str = "", example: Any = None, *, default: Any = ..., **rules: Any
) -> Any:
    """Declare a key: its description without the unit, its unit, an example, and its default.

    A longer description is the docstring below the declaration. The unit is empty where there is
    none, and ``"1"`` for a dimensionless number. A key with the default ``...`` is required.
    Further arguments are constraints of `pydantic.Field`, such as ``gt=0``.
    """
    return Field(
        default,
        description=f"{description}, in {units}" if units not in ("", "1") else description or None,
        examples=None if example is None else [example],
        json_schema_extra={"units": units} if units else None,
        **rules,
    )


@dataclass(frozen=True)
class Key:
    """One key: its dotted path, its declaration, and the tables that its value may be.

    ``place``: the table in which it is declared, and the name of its attribute.
    """

    path: str
    field: FieldInfo
    tables: tuple[type[Table], ...]
    place: tuple[type[Table], str]

    @property
    def units(self) -> str:
        """Unit of the value; empty where there is none."""
        extra = self.field.json_schema_extra
        return str(extra.get("units", "")) if isinstance(extra, dict) else ""

    @property
    def wording(self) -> str:
        """The description without the unit."""
        return self._described.removesuffix(f", in {self.units}")

    @property
    def _described(self) -> str:
        """The description on one line."""
        text = self.field.description or docstring_of(*self.place)
        return " ".join(text.split())

    @property
    def is_number(self) -> bool:
        """Whether the value is a single float."""
        return float in (self.field.annotation, *typing.get_args(self.field.annotation))

    @property
    def type_word(self) -> str:
        """The type of the value in the words of TOML."""
        held = next(part for part in _parts(self.field.annotation) if _type_word(part))
        return _type_word(held)

    @property
    def example(self) -> str:
        """An example as TOML; empty where none is declared."""
        return toml_literal(self.field.examples[0]) if self.field.examples else ""

    @property
    def valid(self) -> Range:
        """The range of a number."""
        declared = [*self.field.metadata, *_rules_of_number(self.field.annotation)]
        rules = [(rule, name) for rule in declared for name in Range._fields]
        return Range(**{name: getattr(rule, name) for rule, name in rules if hasattr(rule, name)})

    @property
    def choices(self) -> tuple[str, ...]:
        """Valid values, or entries, as TOML writes them; empty where all values are valid."""
        parts = _parts(self.field.annotation)
        literals = (part for part in parts if typing.get_origin(part) is typing.Literal)
        return tuple(toml_literal(one) for part in literals for one in typing.get_args(part))

    @property
    def remedy(self) -> str:
        """The expected value, with an example where there is one."""
        example = self.example or self._example_of_a_table
        return f"expected: {self._described}{f', such as {example}' if example else ''}"

    @property
    def _example_of_a_table(self) -> str:
        """The first keys of a table that have examples, in words; empty without such keys."""
        inner = keys_of(self.tables[0]) if self.tables else ()
        shown = [f"{one.path} = {one.example}" for one in inner if one.example]
        return f"[{self.path}] with {', '.join(shown[:MOST_SHOWN])}" if shown else ""


_WORDS = {bool: "boolean", int: "integer", float: "float", str: "string", dict: "table"}


def _type_word(annotation: Any) -> str:
    """Return the word for a type; empty for one that wraps others, such as an optional one."""
    origin = typing.get_origin(annotation) or annotation
    if origin is typing.Literal:
        return _WORDS[type(typing.get_args(annotation)[0])]
    if origin in (tuple, list):
        inner = next(filter(None, map(_type_word, _parts(typing.get_args(annotation)[0]))))
        return f"list of {inner}s"
    return _WORDS.get(origin, "")


def keys_of(model: type[Table], path: str = "") -> Iterator[Key]:
    """List the keys of a model and of the tables inside it, in the order of declaration."""
    for name, field in model.model_fields.items():
        here = f"{path}.{field.alias or name}".lstrip(".")
        parts = tuple(_parts(field.annotation))
        tables = tuple(part for part in parts if isinstance(part, type) and issubclass(part, Table))
        yield Key(here, field, tables, (model, name))
        named = any(typing.get_origin(part) is dict for part in parts)
        for table in tables:
            yield from keys_of(table, f"{here}.{NAME}" if named else here)


def _rules_of_number(annotation: Any) -> Iterator[Any]:
    """Yield the constraints of the number that a value may be, besides other forms."""
    for part in typing.get_args(annotation):
        kind, *rules = typing.get_args(part) or (part,)
        if kind is float:
            yield from (one for rule in rules for one in getattr(rule, "metadata", ()))


def _parts(annotation: Any) -> Iterator[Any]:
    """List the types of an annotation: first the whole, and choices as one."""
    yield annotation
    if typing.get_origin(annotation) is not typing.Literal:
        for part in typing.get_args(annotation):
            yield from _parts(part)
