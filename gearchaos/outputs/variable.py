"""A variable of a result: the description of one named array."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.outputs.names import STATUS
from gearchaos.outputs.scales import PURE, Scale

ORIGINS = ("given", "derived", "default", "swept")
"""Where the value of a parameter of the model may come from."""


@dataclass(frozen=True, eq=False)
class Variable:
    """One named array of a result.

    Parameters of the model are variables as well. They have an origin and values; their dimensions
    are none, ``harmonic``, or the axes along which they are swept.

    Attributes
    ----------
    name : str
        Name in the file.
    dims : tuple of str
        Names of the dimensions. Those of an array that differs from lane to lane begin with all
        axes of the result.
    dtype : str
        ``"float64"``, ``"int32"`` or ``"uint8"``.
    units : str
        Units as udunits and pint read them, ``"1"`` for dimensionless numbers.
    long_name, symbol : str
        Wording for people, and mathtext for axis labels.
    fill_value : float or int, optional
        Value that marks "none here". None: every value means something.
    flags : tuple of str
        Meanings of the values 0, 1, 2, ... of an enumeration, one word each.
    errors : tuple of str
        Names of the variables that give the error of this one.
    values : array, optional
        Values of the shape of the dimensions, where they are known before the sweep.
    origin : str
        Origin of a parameter, one of `ORIGINS`.
    scale : Scale
        Unit of the dimensionless numbers, by which they become physical ones.
    """

    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str
    long_name: str
    symbol: str = ""
    fill_value: float | int | None = None
    flags: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()
    values: Any = None
    origin: str = ""
    scale: Scale = PURE

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes that a file gives the array."""
        texts = {name: getattr(self, name) for name in ("units", "long_name", "symbol", "origin")}
        texts["flag_meanings"] = " ".join(self.flags)
        texts["ancillary_variables"] = " ".join(self.errors)
        written: dict[str, Any] = {name: text for name, text in texts.items() if text}
        if self.flags:
            written["flag_values"] = np.arange(len(self.flags), dtype=self.dtype)
        return written


def coordinate(
    name: str, units: str, long_name: str, symbol: str, values: Floats, scale: Scale = PURE
) -> Variable:
    """Return the axis of a swept parameter; its values (values,) ascend."""
    return Variable(name, (name,), "float64", units, long_name, symbol, values=values, scale=scale)


def lane_axes(variables: Sequence[Variable]) -> tuple[str, ...]:
    """Return the names of the axes of a result: the dimensions of ``status``."""
    return next(variable.dims for variable in variables if variable.name == STATUS)


def require_listed(arrays: Collection[str], variables: Collection[str]) -> None:
    """Raise ValueError if one of the arrays, by name, is not among the variables of the result."""
    if unlisted := sorted(set(arrays) - set(variables)):
        raise ValueError(
            f"{', '.join(unlisted)}: would not be written: no variable of the result has this "
            "name; add an entry to the catalogue of outputs, or list its part"
        )
