"""What the numbers of a result are multiples of: scales of the pair, periods of its excitation."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gearchaos.arrays import Array
from gearchaos.errors import ConfigurationError
from gearchaos.models.gear_pair.derivation import FREQUENCY, LENGTH, STIFFNESS
from gearchaos.results.variables import Variable


class Unit(NamedTuple):
    """A product of scales of a pair, worded, and how many physical units it is.

    ``renamed``: what a variable is called in these units where that is another name.
    """

    stands_for: str
    units: str
    factor: float
    scales: tuple[str, ...]
    renamed: Mapping[str, Any] = {}


# The prime is written out, since one in superscript stands apart from its letter.
_LENGTH = Unit(r"unit $b\prime$", "um", 1.0, (LENGTH,))
_SPEED = Unit(r"unit $b\prime\omega_h$", "m/s", 1e-6, (LENGTH, FREQUENCY))
_ACCELERATION = Unit(r"unit $b\prime\omega_h^2$", "m/s^2", 1e-6, (LENGTH, FREQUENCY, FREQUENCY))
_FORCE = Unit(r"unit $k_mb\prime$", "N", 1e-6, (STIFFNESS, LENGTH))
_GROWTH = Unit(r"per unit of $\tau$", "s^-1", 1.0, (FREQUENCY,))
_ORDINARY = {"long_name": "mesh frequency", "symbol": "$f$"}
_HERTZ = Unit(r"unit $\omega_h$", "Hz", 0.5 / np.pi, (FREQUENCY,), _ORDINARY)
_PURE = Unit("", "1", 1.0, ())
_STATE = r"(section_|amplitude_)?delta_\d%s(_largest|_smallest|_peak_to_peak)?"
_UNITS = {
    _STATE % "" + r"|mesh_error|(amplitude_)?transmission_error\w*": _LENGTH,
    _STATE % "_rate" + r"|approach_\w+|slowest_crossing": _SPEED,
    r"delta_\d_acceleration": _ACCELERATION,
    r"mesh_force_\w+": _FORCE,
    r"lyapunov_(exponent|sum)\w*|exponent_step_error": _GROWTH,
    "mesh_frequency": _HERTZ,
}
"""By a pattern of the names of variables: docs/model.md."""


def unit_of(name: str) -> Unit:
    """Return what the numbers of a dimensionless variable are multiples of, nothing if pure."""
    return next((unit for names, unit in _UNITS.items() if re.fullmatch(names, name)), _PURE)


def in_physical_units(
    variable: Variable, values: Array, parameters: Mapping[str, Variable]
) -> tuple[Variable, Array]:
    """Return a variable and its values in physical units; pure numbers come as they are.

    Raises ConfigurationError if a scale is not among the parameters, or varies along an axis that
    the variable does not have.
    """
    unit = unit_of(variable.name)
    if unit is _PURE or variable.units != "1":
        return variable, values
    for name in unit.scales:
        if name not in parameters:
            raise ConfigurationError(
                f"{variable.name}: the configuration of the result does not give the {name} of its "
                "pair: give [pair] and [mesh] with mean_stiffness_N_per_um_mm and "
                "length_scale_um, and run the sweep again"
            )
        scale = parameters[name]
        if not {*scale.dims} <= {*variable.dims}:
            varied = f"{name} varies along {', '.join(scale.dims)}"
            raise ConfigurationError(f"{variable.name}: {varied}: select one value there first")
        sizes = zip(variable.dims, values.shape, strict=True)
        values = values * np.reshape(scale.values, [n if d in scale.dims else 1 for d, n in sizes])
    return replace(variable, units=unit.units, **unit.renamed), unit.factor * values


class Excitation(NamedTuple):
    """The excitation of all lanes, by the attributes of these names.

    ``excitation_period``: mesh periods after which it repeats, 1 for a sine; the others, 0 where
    not known, are numbers of teeth that have errors of their own.
    """

    excitation_period: int = 1
    driving_teeth: int = 0
    driven_teeth: int = 0

    @property
    def of_teeth(self) -> bool:
        """Whether teeth have errors of their own, whose numbers are known."""
        return self.driving_teeth > 0 and self.driven_teeth > 0

    @property
    def in_words(self) -> str:
        """What the periods of motions are, where they are not mesh periods."""
        n = self.excitation_period
        return f"periods are those of the excitation, {n} mesh periods each" if n > 1 else ""


def excitation_of(metadata: Mapping[str, Any]) -> Excitation:
    """Read the excitation from the metadata of a result; what makes no sense is not known."""
    # Beyond that is no number of teeth.
    sound = {
        name: value
        for name, default in Excitation._field_defaults.items()
        if isinstance(value := metadata.get(name), type(default)) and 0 < value < 1e9
    }
    return Excitation(**sound)
