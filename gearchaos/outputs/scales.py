"""Physical quantities, and the scales that turn dimensionless numbers into physical units."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType
from typing import NamedTuple

import numpy as np


class Quantity(Enum):
    """The physical quantity that an output measures; `NONE` for a pure number."""

    NONE = auto()
    LENGTH = auto()
    SPEED = auto()
    ACCELERATION = auto()
    FORCE = auto()
    GROWTH_RATE = auto()
    TIME = auto()
    MESH_FREQUENCY = auto()
    ANGLE = auto()
    ANGULAR_SPEED = auto()
    ANGULAR_ACCELERATION = auto()
    TORQUE = auto()


@dataclass(frozen=True)
class Scale:
    """The unit of dimensionless numbers, as a product of scales of the model.

    Attributes
    ----------
    stands_for : str
        The unit in the symbols of the model, for axis labels. Empty for a pure number.
    units : str
        The physical units after the conversion, as udunits and pint read them.
    factor : float
        The numbers are multiplied by this factor and by all ``parameters``.
    parameters : tuple of str
        Names of the parameters of a result that the scale is a product of. A name may occur twice.
    per : tuple of str
        Names of the parameters by which the numbers are divided.
    long_name, symbol : str
        What the variable is called in physical units. Empty: it keeps its name.
    remedy : str
        What to add to a configuration that does not give the parameters.
    """

    stands_for: str = ""
    units: str = "1"
    factor: float = 1.0
    parameters: tuple[str, ...] = ()
    per: tuple[str, ...] = ()
    long_name: str = ""
    symbol: str = ""
    remedy: str = ""


PURE = Scale()
"""The scale of pure numbers, which have no other unit."""


class BaseScale(NamedTuple):
    """One of the three scales of a model: the name of its parameter and its symbol in TeX."""

    parameter: str
    symbol: str


def scales_of(
    length: BaseScale, frequency: BaseScale, stiffness: BaseScale, remedy: str
) -> Mapping[Quantity, Scale]:
    """Return the scale of every quantity of a model.

    Parameters
    ----------
    length, frequency, stiffness : BaseScale
        The scales that make the model dimensionless; their parameters are in um, 1/s and N/m.
    remedy : str
        What to add to a configuration that does not give these parameters.
    """
    (b, b_symbol), (omega, omega_symbol), (k, k_symbol) = length, frequency, stiffness
    micro = 1e-6
    rows = {
        Quantity.LENGTH: Scale(f"unit ${b_symbol}$", "um", 1.0, (b,)),
        Quantity.SPEED: Scale(f"unit ${b_symbol}{omega_symbol}$", "m/s", micro, (b, omega)),
        Quantity.ACCELERATION: Scale(
            f"unit ${b_symbol}{omega_symbol}^2$", "m/s^2", micro, (b, omega, omega)
        ),
        Quantity.FORCE: Scale(f"unit ${k_symbol}{b_symbol}$", "N", micro, (k, b)),
        Quantity.TIME: Scale(f"unit $1/{omega_symbol}$", "s", 1.0, per=(omega,)),
        Quantity.GROWTH_RATE: Scale(r"per unit of $\tau$", "s^-1", 1.0, (omega,)),
        # The angular frequency in multiples of the scale becomes an ordinary frequency.
        Quantity.MESH_FREQUENCY: Scale(
            f"unit ${omega_symbol}$",
            "Hz",
            0.5 / np.pi,
            (omega,),
            long_name="mesh frequency",
            symbol="$f$",
        ),
    }
    return MappingProxyType(
        {quantity: Scale(**{**vars(scale), "remedy": remedy}) for quantity, scale in rows.items()}
    )
