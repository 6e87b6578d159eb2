"""The targets file: observations, free parameters and settings of the search."""

import math
from itertools import product
from typing import Annotated, Literal, Self, TypeAlias, TypeVar

import numpy as np
from pydantic import Field, field_validator, model_validator

from gearchaos.arrays import Floats
from gearchaos.configuration.keys import Table, key

Interval: TypeAlias = Annotated[tuple[float, float], Field(strict=False)]
Entry = TypeVar("Entry")
Coordinate: TypeAlias = Literal["delta_5", "delta_1", "delta_2", "delta_3", "delta_4"]
Several: TypeAlias = Annotated[tuple[Entry, ...], Field(strict=False)]

MOST_FREE = 16
"""Most free parameters: the 2^16 corners of their bounds are checked before a search."""


class FreeParameter(Table):
    """A parameter that is free within bounds."""

    name: str = key("a group by its name, or the path of a physical key", example="load")
    low: float = key("lower bound", example=0.1)
    high: float = key("upper bound", example=1.0)
    logarithmic: bool = key("whether steps are taken in its logarithm", default=False)

    @model_validator(mode="after")
    def _ascends(self) -> Self:
        if self.high <= self.low:
            raise ValueError(f"high = {self.high} must be greater than low = {self.low}")
        if self.logarithmic and self.low <= 0.0:
            raise ValueError(f"low = {self.low} has no logarithm; raise it, or drop logarithmic")
        return self

    def value(self, share: Floats) -> Floats:
        """Return the values at shares of the way from the lower to the upper bound."""
        if not self.logarithmic:
            return self.low + share * (self.high - self.low)
        # Not with NumPy, whose powers differ between processors.
        way = math.log(self.high / self.low)
        return np.array([self.low * math.exp(part * way) for part in share.tolist()])

    def share(self, value: float) -> float:
        """Return the position of a value between the bounds as a share; inverse of `value`."""
        if not self.logarithmic:
            return (value - self.low) / (self.high - self.low)
        return math.log(value / self.low) / math.log(self.high / self.low) if value > 0 else -1.0


class _Observed(Table):
    width: float = key("how far off counts as one unit of misfit", example=0.05, gt=0)


class ObservedStage(_Observed):
    """A span of the swept parameter in which the motion is of one kind."""

    motion: str = key(
        '"period n" or "bands n" with n up to 16, "chaotic" or "aperiodic"',
        example="period 2",
        pattern="^((period|bands) ([1-9]|1[0-6])|chaotic|aperiodic)$",
    )
    from_: float = key("where it begins", example=10.08, alias="from")
    to: float = key("where it ends", example=11.16)

    @model_validator(mode="after")
    def _ascends(self) -> Self:
        if self.to <= self.from_:
            raise ValueError(f"to = {self.to} must be greater than from = {self.from_}")
        return self


class ObservedPlace(_Observed):
    """A jump to another motion of the same period, or a crisis in which chaos suddenly grows."""

    at: float = key("where, on the axis of the sweep", example=1.12)
    within: Interval = key(
        "the search range of the value, which must be alone there", example=[0.6, 2.0]
    )

    @model_validator(mode="after")
    def _within(self) -> Self:
        if not self.within[0] < self.at < self.within[1]:
            raise ValueError(f"within must hold at = {self.at}, low end first")
        return self


class Exponent(_Observed):
    """The largest Lyapunov exponent of the whole scene at one value of the swept parameter."""

    at: float = key("value of the swept parameter", example=1.11)
    value: float = key("the exponent, per unit of dimensionless time", example=-0.0043)


class Increment(_Observed):
    """Growth of the largest acceleration of a coordinate between two values."""

    coordinate: Coordinate = key("whose acceleration", example="delta_5", default="delta_5")
    from_: float = key("the one value of the swept parameter", example=1.0, alias="from")
    to: float = key("the other one", example=3.0)
    value: float = key("by how much the largest acceleration grows", example=0.2163)


class Search(Table):
    """Size and seed of the search."""

    seed: int = key("of the random numbers", default=0, ge=0, le=2**32 - 1)
    candidates: int = key("sets that are tried", default=20_000, ge=8, le=10_000_000)
    drawn: int = key("as many of them drawn evenly within the bounds, to begin with", default=2000)
    runs: int = key("searches that share the others, from the best drawn sets", default=4, ge=1)
    population: int = key("sets of one generation", default=32, ge=4, le=10_000)
    apart: float = key(default=0.1, gt=0, le=1)
    """largest difference, as a share of its bounds, that a parameter must have for two sets to
    differ"""

    @model_validator(mode="after")
    def _drawn_are_a_part(self) -> Self:
        if not self.population <= self.drawn <= self.candidates:
            within = f"population = {self.population} and at most candidates = {self.candidates}"
            raise ValueError(f"drawn = {self.drawn} must be at least {within}")
        return self


class Targets(Table):
    """A targets file, validated on creation."""

    title: str = key("title, for people", default="")
    configuration: str = key("file with all that is known, beside this one", example="pair.toml")
    set: Several[str] = key("keys of it that are replaced, as by --set", default=())
    search: Search = key("how much is tried", default=Search())
    parameter: Several[FreeParameter] = key("free parameters", min_length=1, max_length=MOST_FREE)
    stage: Several[ObservedStage] = key("observed stages", default=())
    jump: Several[ObservedPlace] = key("observed jumps", default=())
    crisis: Several[ObservedPlace] = key("observed crises", default=())
    exponent: Several[Exponent] = key("observed exponents", default=())
    increment: Several[Increment] = key("observed increments", default=())

    @field_validator("parameter")
    @classmethod
    def _named_once(cls, given: tuple[FreeParameter, ...]) -> tuple[FreeParameter, ...]:
        if len({one.name for one in given}) < len(given):
            raise ValueError("names a parameter twice; name it once")
        return given

    def corners(self) -> dict[str, Floats]:
        """Return the free parameters at all corners of their bounds, each of shape (corners,)."""
        return self.values(np.array(list(product((0.0, 1.0), repeat=len(self.parameter)))))

    def values(self, points: Floats) -> dict[str, Floats]:
        """Return the free parameters at points of the unit cube, each of shape (candidates,).

        ``points`` (candidates, parameters): positions between the bounds as shares.
        """
        return {
            one.name: one.value(part) for one, part in zip(self.parameter, points.T, strict=True)
        }
