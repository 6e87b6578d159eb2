"""Basins in physical units."""

from dataclasses import replace
from typing import Any

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.models.catalogues import scale_of
from gearchaos.outputs.names import LARGEST_EXPONENT, STATE
from gearchaos.outputs.variable import Variable
from gearchaos.results.reading.ensembles import Basin, Basins
from gearchaos.results.reading.physical_units import in_physical_units
from gearchaos.results.reading.tables import unit_text


def physical_basins(found: Basins) -> Basins:
    """Return basins with values, starts, sections, exponents and means in physical units.

    Raises ConfigurationError if the configuration of the result describes no physical system.
    """
    result = found.result.physical()
    swept = found.parameter in result
    values = np.asarray(result[found.parameter] if swept else found.values, dtype=np.float64)
    states = found.result.variables[STATE].flags
    units, factors = dict[str, str](), dict[str, Floats]()
    for name in (*states, *found.units):
        units[name], factors[name] = _factors(found, name)

    def converted(one: Basin) -> Basin:
        at = int(np.flatnonzero(found.values == one.value)[0])
        here: dict[str, Any] = {name: float(factor[at]) for name, factor in factors.items()}
        return one._replace(
            value=float(values[at]),
            exponent=one.exponent * here.get(LARGEST_EXPONENT, 1.0),
            means={name: mean * here.get(name, 1.0) for name, mean in one.means.items()},
            section=one.section * [here[state] for state in states],
        )

    return found._replace(
        result=result,
        values=values,
        basins=[converted(one) for one in found.basins],
        grid={state: starts * factors[state][0] for state, starts in found.grid.items()},
        units=units,
    )


def _factors(found: Basins, name: str) -> tuple[str, Floats]:
    """Return the physical unit of a quantity, and what to multiply it by at each value."""
    known = found.result.variables.get(name)
    if known is None:
        scale = scale_of(name, found.result.metadata)
        known = Variable(name, (), "float64", "1", name, scale=scale)
    of_value = replace(known, dims=(found.parameter,))
    changed, factors = in_physical_units(
        of_value, np.ones(found.values.size), found.result.parameters
    )
    return unit_text(changed), factors
