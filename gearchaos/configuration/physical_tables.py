"""The tables that describe a gear pair in the terms of its drawing and its bearings."""

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, create_model

from gearchaos.configuration.keys import (
    Harmonics,
    NotNegativePair,
    Numbers,
    PositivePair,
    Table,
    TeethPair,
    key,
)

_KEYS = tomllib.loads(Path(__file__).with_name("physical_keys.toml").read_text("utf-8"))
_HOLDS: dict[str, Any] = {
    "number": float,
    "whole number": int,
    "text": str,
    "numbers": Numbers,
    "harmonics": Harmonics,
    "teeth": TeethPair,
    "positive pair": PositivePair,
    "pair": NotNegativePair,
}


class PhysicalTable(Table):
    """A table whose keys are declared in physical_keys.toml."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...


def _table(name: str) -> type[PhysicalTable]:
    fields: dict[str, Any] = {}
    for path, declared in _KEYS[name].items():
        rules = dict(_KEYS[declared][path] if isinstance(declared, str) else declared)
        holds = _HOLDS[rules.pop("holds", "number")]
        if "choices" in rules:
            holds = Literal[tuple(rules.pop("choices"))]
        if rules.pop("optional", False):
            holds, rules["default"] = holds | None, None
        fields[path] = (holds, key(**rules))
    about = _KEYS["about"][name]
    return create_model(name, __base__=PhysicalTable, __module__=__name__, __doc__=about, **fields)


if TYPE_CHECKING:
    Pair: TypeAlias = PhysicalTable
    Operation: TypeAlias = PhysicalTable
    Mesh: TypeAlias = PhysicalTable
    Bearings: TypeAlias = PhysicalTable
    GearDeviations: TypeAlias = PhysicalTable
    SineError: TypeAlias = PhysicalTable
    TeethError: TypeAlias = PhysicalTable
    GradeError: TypeAlias = PhysicalTable
else:
    GearDeviations = _HOLDS["deviations"] = _table("GearDeviations")
    FourierStiffness, TrapezoidStiffness = map(_table, ("FourierStiffness", "TrapezoidStiffness"))
    _HOLDS["stiffness"] = Annotated[
        FourierStiffness | TrapezoidStiffness, Field(discriminator="shape")
    ]
    Pair, Operation, Mesh, Bearings = map(_table, ("Pair", "Operation", "Mesh", "Bearings"))
    SineError, TeethError, GradeError = map(_table, ("SineError", "TeethError", "GradeError"))

PitchError: TypeAlias = Annotated[
    SineError | TeethError | GradeError,
    Field(discriminator="kind"),
    BeforeValidator(lambda given: {"kind": "sine", **given} if isinstance(given, dict) else given),
]
"""``[pitch_error]``; without a kind it is a sine."""
