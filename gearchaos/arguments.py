"""Checks of the arguments of public functions; a wrong argument raises an error with a sentence."""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.errors import ConfigurationError, FileError


def path_text(path: Any, what: str) -> str:
    """Return a path as text; raise FileError if the value is no path."""
    try:
        return os.fsdecode(path)
    except TypeError:
        remedy = f"give the name of {what} as a text or a pathlib.Path"
        raise FileError(f"{_shown(path)}: is no path but {_kind(path)}; {remedy}") from None


def whole_number(name: str, value: Any, least: float = -math.inf) -> int:
    """Return a whole number of at least ``least``; raise ConfigurationError for any other value."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if whole and value >= least:
        return int(value)
    rule = f"must be at least {least}" if whole else f"must be a whole number, not {_kind(value)}"
    raise ConfigurationError(f"{name} = {_shown(value)}: {rule}")


def finite_number(name: str, value: Any) -> float:
    """Return a finite number as a float; raise ConfigurationError for any other value."""
    try:
        number = math.nan if isinstance(value, str) else float(value)
    except (OverflowError, TypeError, ValueError):
        number = math.nan
    if math.isfinite(number):
        return number
    raise ConfigurationError(f"{name} = {_shown(value)}: must be a finite number")


def coordinates(name: str, values: Any) -> dict[str, float]:
    """Return a mapping of names to finite numbers; raise ConfigurationError for any other value."""
    if not isinstance(values, Mapping) or not all(isinstance(one, str) for one in values):
        remedy = 'such as {"operation.speed_rpm": 12000.0}'
        raise ConfigurationError(f"{name} = {_shown(values)}: must be numbers by name, {remedy}")
    return {one: finite_number(one, value) for one, value in values.items()}


def state(name: str, value: Any, states: Sequence[str]) -> Floats:
    """Return a state, shape (1, states); raise ConfigurationError if a finite number is missing."""
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.full(0, np.nan)
    if numbers.shape not in ((len(states),), (1, len(states))) or not np.isfinite(numbers).all():
        raise ConfigurationError(
            f"{name} = {_shown(value)}: must be {len(states)} finite numbers, one of each state "
            f"({', '.join(states)})"
        )
    return numbers.reshape(1, -1)


def texts(name: str, values: Any) -> list[str]:
    """Return a list of texts; raise ConfigurationError for any other value, also a single text."""
    listed = isinstance(values, Iterable) and not isinstance(values, str)
    found = list(values) if listed else [values]
    if not (listed and all(isinstance(one, str) for one in found)):
        raise ConfigurationError(f"{name} = {_shown(values)}: must be a list of texts")
    return found


def one_of(name: str, value: Any, choices: Sequence[Any]) -> None:
    """Raise a ConfigurationError unless the value is one of the choices."""
    if not any(value is one or (isinstance(one, str) and value == one) for one in choices):
        there = ", ".join(map(repr, choices))
        raise ConfigurationError(f"{name} = {_shown(value)}: must be one of {there}")


def instance(name: str, value: Any, kind: type, remedy: str) -> None:
    """Raise a ConfigurationError unless the value has this type."""
    if not isinstance(value, kind):
        article = f"must be a {kind.__name__}, not {_kind(value)}"
        raise ConfigurationError(f"{name} = {_shown(value)}: {article}; {remedy}")


def _kind(value: object) -> str:
    return f"of the type {type(value).__name__}"


def _shown(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else f"{text[:80]}..."
