"""The ranges of both parameters of a map, and lines across it on which branches are traced."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem

from gearchaos.arrays import Floats, Integers
from gearchaos.dynamics.boundary_passages import PARAMETERS
from gearchaos.dynamics.branch_range import BranchRange
from gearchaos.engine.map_changes import MapChange
from gearchaos.models import Configuration, swept_values
from gearchaos.models.registry import system_of


class Line(NamedTuple):
    """A line on which parameter ``number`` has a value, and the ends of the other parameter."""

    number: int
    value: float
    low: float
    high: float


class Ranges(NamedTuple):
    """The ranges of both parameters: their names, and the lowest and the highest values."""

    config: Configuration
    parameters: tuple[str, ...]
    low: Floats
    high: Floats

    @classmethod
    def of(cls, config: Configuration) -> "Ranges":
        """Return the ranges of the sweeps of a configuration."""
        values = [swept_values(sweep) for sweep in config.sweeps.values()]
        names = tuple(sweep.parameter for sweep in config.sweeps.values())
        low, high = (np.array([one[at] for one in values]) for at in (0, -1))
        return cls(config, names, low, high)

    def values(self, shares: Floats) -> Floats:
        """Return the values of both parameters at shares of the ranges, (..., 2)."""
        values: Floats = self.low + shares * (self.high - self.low)
        return values

    def system_at(self, shares: Floats) -> LaneSystem:
        """Return the systems of lanes at shares of both ranges, (lanes, 2)."""
        columns = dict(zip(self.parameters, self.values(shares).T, strict=True))
        return system_of(self.config, columns, self.config.needed_effects)

    def maps_depend(self, method: str) -> tuple[bool, ...]:
        """Return of each parameter whether the maps of a method depend on it."""
        depend = []
        for number in range(PARAMETERS):
            shares = np.full((2, PARAMETERS), 0.5)
            shares[1, number] = 0.75
            depend.append(np.unique(METHODS[method].sharing(self.system_at(shares))).size > 1)
        return tuple(depend)

    def line(self, line: Line, number: int, lines: Sequence[Line]) -> BranchRange:
        """Return the range along a line, which has a number among others."""

        table = np.array(lines, dtype=np.float64)

        def systems(numbers: Integers, shares: Floats) -> LaneSystem:
            fixed, value, low, high = table[numbers].T
            values, lanes, at = (
                np.empty((numbers.size, PARAMETERS)),
                np.arange(numbers.size),
                fixed.astype(int),
            )
            values[lanes, at] = value
            values[lanes, 1 - at] = low + shares * (high - low)
            columns = dict(zip(self.parameters, values.T, strict=True))
            return system_of(self.config, columns, self.config.needed_effects)

        def systems_of(at: Floats) -> LaneSystem:
            values = {self.parameters[1 - line.number]: at}
            values[self.parameters[line.number]] = np.full(at.size, line.value)
            return system_of(self.config, values, self.config.needed_effects)

        return BranchRange(systems_of, line.low, line.high, number, systems)

    def whole(self, number: int, value: float) -> Line:
        """Return the line across the map on which a parameter has a value."""
        return Line(number, value, float(self.low[1 - number]), float(self.high[1 - number]))

    def across(self, change: MapChange) -> Line:
        """Return the line through both cells of a change of the map, and one cell beyond each."""
        line = self.whole(change.number, float(self.values(change.shares)[change.number]))
        here, beside = (one[1 - change.number] for one in (change.shares, change.other))
        ends = np.clip(np.sort([2.0 * here - beside, 2.0 * beside - here]), 0.0, 1.0)
        low, high = (line.low + ends * (line.high - line.low)).tolist()
        return line._replace(low=low, high=high)

    def along(self, line: Line, shares: Floats) -> float:
        """Return the share of a line at which a place lies, at shares (2,) of both ranges."""
        return float((self.values(shares)[1 - line.number] - line.low) / (line.high - line.low))

    def shares(self, line: Line, along: float) -> Floats:
        """Return the shares of both ranges, (2,), at a share of a line."""
        values = np.full(PARAMETERS, line.low + along * (line.high - line.low))
        values[line.number] = line.value
        shares: Floats = (values - self.low) / (self.high - self.low)
        return shares
