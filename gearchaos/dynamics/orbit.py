"""One periodic orbit, and how far it goes along a parameter; `orbits` has those of many lanes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.dynamics.following import StabilityLoss


class Orbit(NamedTuple):
    """A periodic orbit.

    ``period`` in excitation periods; ``point`` (states,) at its beginning; ``multipliers``
    (states,): the Floquet multipliers, largest modulus first; ``exponent``: the largest Lyapunov
    exponent per unit of tau; ``residual``: distance after one period, relative to the scale of each
    coordinate.
    """

    period: int
    point: NDArray[np.float64]
    multipliers: NDArray[np.complex128]
    exponent: float
    residual: float

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)


class Branch(NamedTuple):
    """How far an orbit goes along a parameter.

    ``value``, ``orbit``: the last value at which it is stable, and the orbit there; ``beyond``: the
    first value at which it is unstable or not found, the end of the way if it stays stable;
    ``loss``, ``text``: how it loses stability; ``multiplier``: the one that tells.
    """

    value: float
    orbit: Orbit
    beyond: float
    loss: StabilityLoss
    text: str
    multiplier: complex
