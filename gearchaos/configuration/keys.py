"""Every key a configuration can have, by its dotted path, as the models declare it."""

from __future__ import annotations

import difflib
import math
import operator
import types
import typing
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Union

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gearchaos.configuration.toml_text import toml_literal


@dataclass(frozen=True)
class Key:
    """One key: where it stands and what the models say about it.

    Attributes
    ----------
    path : str
        Dotted path, such as ``pair.teeth``.
    field : FieldInfo
        The declaration.
    tables : tuple of model classes
        The tables that may stand here; empty for a value.
    """

    path: str
    field: FieldInfo
    tables: tuple[type[BaseModel], ...]

    @property
    def units(self) -> str:
        """Unit of the value; empty where there is none."""
        extra = self.field.json_schema_extra
        return str(extra.get("units", "")) if isinstance(extra, dict) else ""

    @property
    def wording(self) -> str:
        """The meaning without the unit."""
        return (self.field.description or "").removesuffix(f", in {self.units}")

    @property
    def is_number(self) -> bool:
        """Whether the value is a single float."""
        return float in (self.field.annotation, *typing.get_args(self.field.annotation))

    @property
    def bounds(self) -> str:
        """The range of the value in words, such as ``> 0 and < 90``; empty where unbounded."""
        signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
        found = [
            f"{sign} {getattr(rule, name):.12g}"
            for rule in self.field.metadata
            for name, sign in signs.items()
            if getattr(rule, name, None) is not None
        ]
        return " and ".join(found)

    def admits(self, value: float) -> bool:
        """Whether a number is finite and lies in the range."""
        holds = {"gt": operator.gt, "ge": operator.ge, "lt": operator.lt, "le": operator.le}
        return math.isfinite(value) and all(
            test(value, getattr(rule, name))
            for rule in self.field.metadata
            for name, test in holds.items()
            if getattr(rule, name, None) is not None
        )

    @property
    def remedy(self) -> str:
        """What belongs here, with an example where there is one."""
        example = f", such as {toml_literal(self.field.examples[0])}" if self.field.examples else ""
        return f"expected: {self.field.description}{example}"


def keys_of(model: type[BaseModel], path: str = "") -> Iterator[Key]:
    """List the keys of a model and of the tables inside it, in the order of declaration."""
    for name, field in model.model_fields.items():
        here = f"{path}.{field.alias or name}".lstrip(".")
        tables = tuple(_models(field.annotation))
        yield Key(here, field, tables)
        for table in tables:
            yield from keys_of(table, here)


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif typing.get_origin(annotation) in (Union, types.UnionType, Annotated):
        for part in typing.get_args(annotation):
            yield from _models(part)


def suggestion(word: str, words: Iterable[str]) -> str:
    """Return ``did you mean `x`?`` for the nearest word, or an empty text."""
    by_lower = {candidate.lower(): candidate for candidate in words}
    start = word[:100].lower()
    close = difflib.get_close_matches(start, by_lower, n=1) or [
        candidate for candidate in by_lower if len(start) > 2 and candidate.startswith(start)
    ]
    return f"did you mean `{by_lower[close[0]]}`?" if close else ""
