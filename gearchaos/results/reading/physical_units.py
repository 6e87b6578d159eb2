"""Variables of a result in physical units."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.arrays import Array
from gearchaos.errors import ConfigurationError
from gearchaos.outputs.variable import Variable

if TYPE_CHECKING:
    from gearchaos.results.reading.result import Result


def in_units(result: "Result", units: str | None, physical: bool) -> "Result":
    """Return a result in the units of ``--units``.

    Without a choice (None) it is in physical units if ``physical`` and the result knows them.
    """
    if units == "physical":
        return result.physical()
    if units is None and physical:
        with suppress(ConfigurationError):
            return result.physical()
    return result


def in_physical_units(
    variable: Variable, values: Array, parameters: Mapping[str, Variable]
) -> tuple[Variable, Array]:
    """Convert a variable and its values to physical units; pure numbers are returned unchanged.

    Parameters
    ----------
    variable : Variable
        Its scale gives the parameters by which the values are multiplied.
    values : array
        Values of the shape of the dimensions of the variable.
    parameters : mapping of str to Variable
        Parameters of the result, by name.

    Raises
    ------
    ConfigurationError
        If a scale is not among the parameters, or varies along an axis that the variable lacks.
    """
    scale = variable.scale
    if not (scale.parameters or scale.per) or variable.units != "1":
        return variable, values
    for name in (*scale.parameters, *scale.per):
        if name not in parameters:
            raise ConfigurationError(
                f"{variable.name}: the configuration of the result does not give the {name} of "
                f"its pair: {scale.remedy}, and run the sweep again"
            )
        parameter = parameters[name]
        if not {*parameter.dims} <= {*variable.dims}:
            varied = f"{name} varies along {', '.join(parameter.dims)}"
            raise ConfigurationError(f"{variable.name}: {varied}: select one value there first")
        sizes = zip(variable.dims, values.shape, strict=True)
        shape = [size if dim in parameter.dims else 1 for dim, size in sizes]
        factor = np.reshape(parameter.values, shape)
        values = values / factor if name in scale.per else values * factor
    long_name, symbol = scale.long_name or variable.long_name, scale.symbol or variable.symbol
    changed = replace(variable, units=scale.units, long_name=long_name, symbol=symbol)
    return changed, scale.factor * values


SECONDS = {"s": 1.0, "ms": 1e-3}
"""Units of the mesh period of a physical system, in seconds."""


def in_seconds(
    time: tuple[Variable, Array], period: tuple[Variable, Array]
) -> tuple[Variable, Array]:
    """Convert the time of a response from mesh periods to seconds, if all lanes share the period.

    ``time`` and ``period``: variable and values of the time and of the mesh period of each lane.
    """
    (variable, values), (of_period, periods) = time, period
    known = np.unique(periods[np.isfinite(periods)])
    if variable.units != "1" or known.size != 1 or of_period.units not in SECONDS:
        return time
    changed = replace(variable, units="s", long_name="time", symbol="$t$")
    return changed, SECONDS[of_period.units] * known[0] * values
