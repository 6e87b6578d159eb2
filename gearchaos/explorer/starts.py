"""A sweep from a grid of starts, with the states of the grid as axes in place of the start."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gearchaos.arrays import Array, Floats
from gearchaos.engine.basins import find_basins
from gearchaos.engine.recomputing import computable
from gearchaos.engine.running import compiling
from gearchaos.errors import GearchaosError
from gearchaos.models.catalogues import scale_of, subject_of
from gearchaos.outputs.names import LABELS, START
from gearchaos.outputs.variable import Variable, coordinate
from gearchaos.results.reading.basin_units import physical_basins
from gearchaos.results.reading.ensembles import Basins
from gearchaos.results.reading.result import Result

ATTRACTOR = "attractor"
"""Name of the attractor that a start leads to, in the menu of variables."""

AT_START = "start_"
"""Prefix of the name of a state as an axis of starts."""


class StartGrid:
    """A result whose axis of starts is replaced by one axis for each state of its grid.

    Parameters
    ----------
    whole : Result
        A result with the axis `START`.
    path : str
        Its file, for texts.
    box : dict of str to array
        Start values along the grid by state, in C order.

    Attributes
    ----------
    result : Result
        The same lanes. The first state of the grid is the last axis: it runs along x of a map.
    axes : list of str
        The axes of the grid, the first state first.
    """

    def __init__(self, whole: Result, path: str, box: dict[str, Floats]) -> None:
        self.whole, self.axes = whole, [AT_START + state for state in box]
        self.result = _on_grid(whole, box)
        self._path, self._box = path, box
        self._found: dict[tuple[float, ...], Basins] = {}

    @property
    def has_basins(self) -> bool:
        """Whether the lanes have the labels from which attractors are found."""
        return all(label in self.whole for label in LABELS)

    def start(self, place: Mapping[str, float]) -> dict[str, float]:
        """Return the same place on the axes of the file: the nearest start of the grid."""
        at = [
            int(np.abs(values - place[axis]).argmin())
            for axis, values in zip(self.axes, self._box.values(), strict=True)
        ]
        number = np.ravel_multi_index(at, [values.size for values in self._box.values()])
        kept = {axis: value for axis, value in place.items() if axis not in self.axes}
        return kept | {START: float(self.whole[START][number])}

    def basins(self, place: Mapping[str, float], units: str) -> Basins:
        """Find the basins over the first two states of the grid, once at every place.

        ``place``: values of all axes that are not drawn. Further states of the grid are sliced.
        Raises what `find_basins` and `physical_basins` raise.
        """
        swept = {axis: value for axis, value in place.items() if axis not in self.axes}
        if (key := tuple(swept.values())) not in self._found:
            with compiling():
                self._found[key] = find_basins(self.whole.sel(None, **swept), self._path)
        found = self._found[key]
        values = [*self._box.items()]
        numbers = found.numbers.reshape(-1, *(one.size for _, one in values))
        for axis, (_, starts) in [*zip(self.axes, values, strict=True)][:1:-1]:
            numbers = numbers[..., int(np.abs(starts - place[axis]).argmin())]
        found = found._replace(grid=dict(values[:2]), numbers=numbers.reshape(len(numbers), -1))
        return physical_basins(found) if units == "physical" else found


def start_grid(result: Result, path: str) -> StartGrid | None:
    """Return the grid of the starts of a result, or None where the starts are none."""
    if START not in result.axes:
        return None
    try:
        start = computable(result, path).start
    except GearchaosError:  # Without its configuration, or with [control].
        return None
    if start.kind != "grid" or start.carry != "none" or start.size != result[START].size:
        return None
    box = {str(state): np.linspace(*ends, start.count) for state, ends in start.box.items()}
    return StartGrid(result, path, box)


def _on_grid(whole: Result, box: dict[str, Floats]) -> Result:
    """Replace the axis of starts by the states of the grid, the last one first."""
    names = tuple(AT_START + state for state in box)[::-1]
    sizes = tuple(values.size for values in box.values())

    def dims_of(dims: tuple[str, ...]) -> tuple[str, ...]:
        at = dims.index(START) if START in dims else len(dims)
        return dims[:at] + (names if START in dims else ()) + dims[at + 1 :]

    def placed(values: Any, dims: tuple[str, ...]) -> Array:
        array = np.asarray(values)
        if START not in dims:
            return array
        at = dims.index(START)
        array = array.reshape(array.shape[:at] + sizes + array.shape[at + 1 :])
        order = [*range(array.ndim)]
        order[at : at + len(sizes)] = order[at : at + len(sizes)][::-1]
        return array.transpose(order)

    axes = [_axis(state, values, whole) for state, values in box.items()]
    kept = [one for one in whole.variables.values() if one.name != START]
    parameters = {
        name: replace(one, dims=dims_of(one.dims), values=placed(one.values, one.dims))
        for name, one in whole.parameters.items()
    }
    variables = [*axes, *(replace(one, dims=dims_of(one.dims)) for one in kept)]
    data = {one.name: placed(whole[one.name], one.dims) for one in kept}
    return Result(dims_of(whole.axes), variables, data, parameters, whole.metadata)


def _axis(state: str, values: Floats, whole: Result) -> Variable:
    subject, scale = subject_of(state), scale_of(state, whole.metadata)
    words = f"{subject.long_name} at the start"
    return coordinate(AT_START + state, "1", words, subject.symbol, values, scale)
