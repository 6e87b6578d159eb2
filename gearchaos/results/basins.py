"""Basins of attraction: what a sweep from several starts has come to at each value."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.records.basin_entropy import BasinEntropy
from gearchaos.results.result import Result
from gearchaos.results.shares import Counted

Floats = NDArray[np.float64]


class Basin(NamedTuple):
    """The starts that lead to one attractor at one value of the parameter, or to none.

    ``number`` of the attractor, the same at all values, minus the code of the motion where there is
    none; ``motion``: such as "period 2", "chaotic" or "diverged"; ``multiplier``: largest modulus
    of the Floquet multipliers, not a number where the motion is not periodic; ``exponent``: largest
    Lyapunov exponent, that of the orbit or a mean over the starts; ``starts``: how many of how
    many, with the confidence interval of their share; ``means`` of other variables of the result
    over these starts; ``section`` (points, states): its points, once an excitation period.
    """

    value: float
    number: int
    motion: str
    period: int
    multiplier: float
    exponent: float
    starts: Counted
    means: dict[str, float]
    section: Floats


class Basins(NamedTuple):
    """All basins of a result.

    ``result`` has the axes of the parameter, if it is not fixed, and of the starts; ``parameter``:
    name of the axis; ``values`` (values,); ``numbers`` (values, starts) of the basin that each
    start is in; ``grid``: start values by state where
    the starts are a grid, in C order; ``entropy`` of every value, none without a grid.
    """

    result: Result
    parameter: str
    values: Floats
    numbers: NDArray[np.intp]
    basins: list[Basin]
    grid: dict[str, Floats]
    entropy: list[BasinEntropy]
