"""Selection of lanes by the values of their axes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, TypeAlias

import numpy as np

from gearchaos.arguments import finite_number
from gearchaos.arrays import Array
from gearchaos.errors import ConfigurationError
from gearchaos.outputs.variable import Variable

Matching: TypeAlias = Literal["nearest", "within"] | None


def number_on(axis: Variable, wanted: float | str, method: Matching) -> int:
    """Return the number of the value of an axis that was wanted.

    ``method`` is that of `Result.sel`. Raises ConfigurationError if there is no such value.
    """
    values: Array = np.asarray(axis.values)
    value = _as_number(axis, wanted)
    # Clipped: beyond 1e300 all differences round to the same number.
    near = np.clip(value, values[0], values[-1])
    # Reversed, since argmin returns the first of two equal distances and the larger value is taken.
    number = values.size - 1 - int(np.argmin(np.abs(values - near)[::-1]))
    if method is None and values[number] != value:
        raise ConfigurationError(
            f"{axis.name} = {value:g}: is none of the {values.size} values of the result; the "
            f'nearest is {values[number]!s}: give it, or method="nearest"'
        )
    steps = np.diff(values) if values.size > 1 else [math.inf]
    lowest, highest = values[0] - steps[0] / 2.0, values[-1] + steps[-1] / 2.0
    if method == "within" and not lowest <= value <= highest:
        raise ConfigurationError(
            f"{axis.name} = {value:g}: lies beyond the values of the result, {values[0]:g} to "
            f"{values[-1]:g}; give one between these"
        )
    return number


def _as_number(axis: Variable, wanted: float | str) -> float:
    """Return a coordinate as a number; ``wanted`` may be the name of a direction."""
    try:
        number = axis.flags.index(wanted) if isinstance(wanted, str) else wanted
        return finite_number(axis.name, number)
    except (ValueError, ConfigurationError):
        rule = " or ".join(["a number", *axis.flags])
        raise ConfigurationError(f"{axis.name} = {wanted}: must be {rule}") from None


def remaining(dims: Sequence[str], fixed: Mapping[str, int]) -> tuple[str, ...]:
    """Return those dimensions that are not fixed."""
    return tuple(dim for dim in dims if dim not in fixed)


def part_of(values: Any, dims: Sequence[str], fixed: Mapping[str, int]) -> Any:
    """Return the part of an array at the fixed number of each of some dimensions."""
    return values[tuple(fixed.get(dim, slice(None)) for dim in dims)] if dims else values


def parameters_at(
    parameters: Mapping[str, Variable], fixed: Mapping[str, int]
) -> dict[str, Variable]:
    """Return the parameters of a result at the fixed number of each of some axes."""
    return {
        name: replace(
            parameter,
            values=part_of(parameter.values, parameter.dims, fixed),
            dims=remaining(parameter.dims, fixed),
        )
        for name, parameter in parameters.items()
    }
