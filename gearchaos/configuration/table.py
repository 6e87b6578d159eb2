"""What every table of a configuration has in common: strict, closed, immutable, described."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, ConfigDict, Field


class Table(BaseModel):
    """One table of the file: no conversions, no unknown keys, finite numbers only, immutable."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        validate_default=True,
        serialize_by_alias=True,
        protected_namespaces=(),
    )


# TOML has lists, the models hold tuples; strictness about the entries is not affected.
_AS_LIST = Field(strict=False)
Numbers: TypeAlias = Annotated[tuple[float, ...], _AS_LIST]
NotNegative: TypeAlias = Annotated[float, Field(ge=0)]
Positive: TypeAlias = Annotated[float, Field(gt=0)]
PositivePair: TypeAlias = Annotated[tuple[Positive, Positive], _AS_LIST]
NotNegativePair: TypeAlias = Annotated[tuple[NotNegative, NotNegative], _AS_LIST]
TeethPair: TypeAlias = Annotated[
    tuple[
        Annotated[int, Field(ge=1, le=100_000)],
        Annotated[int, Field(ge=1, le=100_000)],
    ],
    _AS_LIST,
]


def key(
    description: str, *, units: str = "", default: Any = ..., example: Any = None, **rules: Any
) -> Any:
    """Declare a key: what it is, its unit, its default and the rules its value obeys.

    Parameters
    ----------
    description : str
        The meaning, without the unit.
    units : str
        Empty where there is none; ``"1"`` for a dimensionless number.
    default : object
        ``...`` makes the key required.
    example : object
        A value to show where a fault is reported.
    **rules
        Constraints and settings of `pydantic.Field`, such as ``gt=0``.
    """
    return Field(
        default,
        description=f"{description}, in {units}" if units not in ("", "1") else description,
        examples=None if example is None else [example],
        json_schema_extra={"units": units} if units else None,
        **rules,
    )
