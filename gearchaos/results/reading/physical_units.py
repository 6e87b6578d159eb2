"""Variables of a result in physical units."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gearchaos.arrays import Array
from gearchaos.errors import ConfigurationError
from gearchaos.outputs.variable import Variable


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
    if not scale.parameters or variable.units != "1":
        return variable, values
    for name in scale.parameters:
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
        values = values * np.reshape(parameter.values, shape)
    long_name, symbol = scale.long_name or variable.long_name, scale.symbol or variable.symbol
    changed = replace(variable, units=scale.units, long_name=long_name, symbol=symbol)
    return changed, scale.factor * values
