"""Where a map changes between neighbouring cells: places from which boundaries can be started."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.results.reading.result import Result

PARTS = 12
"""Parts of each range; of the changes in each part of the map, one of every kind is a start."""

SLOWEST = np.log(0.5)
"""Least logarithm of the leading multiplier of a motion that may be near a loss of stability."""


class MapChange(NamedTuple):
    """A periodic motion in a cell of a map, next to a cell where it has changed.

    Attributes
    ----------
    flank : int
        Number of the flank of which the impacts change; -1 if the period does.
    period : int
        Its period in excitation periods.
    state : array, shape (states,)
        Its state at the end of the record, dimensionless.
    shares : array, shape (2,)
        Where the cell lies in the ranges of both parameters.
    number : int
        The parameter that both cells have in common.
    """

    flank: int
    period: int
    state: Floats
    shares: Floats
    number: int


class _Cells(NamedTuple):
    """A map as arrays over the second and the first parameter and the starts of each cell."""

    period: Integers
    state: Floats
    shares: Floats
    growth: Floats
    impacts: Floats


def changes_of(
    result: Result, axes: Sequence[str], ends: Floats, longest: int, impacts: Sequence[str]
) -> list[MapChange]:
    """Return changes of the periodic motions of a map, spread over the map.

    Parameters
    ----------
    result : Result
        The map.
    axes : sequence of str
        Names of the axes of both parameters, the first swept one first.
    ends : array, shape (2, 2)
        Lowest and highest values of both parameters, one row each.
    longest : int
        Longest period.
    impacts : sequence of str
        Names of the outputs with the impacts on both flanks of each element.
    """
    cells = _cells(result, axes, ends, impacts)
    periodic = (cells.period > 0) & (cells.period <= longest)
    found: list[MapChange] = []
    for number in range(2):
        one, other = _neighbours(number)
        differs = cells.period[one] != cells.period[other]
        found += _chosen(cells, -1, number, (differs, periodic))
        for flank in range(len(impacts)):
            same = ~differs & periodic[one] & periodic[other]
            more = np.abs(cells.impacts[flank][one] - cells.impacts[flank][other]) > 0.5
            found += _chosen(cells, flank, number, (same & more, periodic))
    return found


def _neighbours(number: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return the parts of a map whose cells are neighbours at one value of a parameter."""
    whole, first, last = slice(None), slice(None, -1), slice(1, None)
    return ((first, whole), (last, whole)) if number == 0 else ((whole, first), (whole, last))


def _cells(result: Result, axes: Sequence[str], ends: Floats, impacts: Sequence[str]) -> _Cells:
    """Return the arrays of a map."""
    shape = tuple(result[axis].shape[0] for axis in axes[::-1])
    period = result.lanes("period").reshape(*shape, -1)
    state = result.lanes("end_state").reshape(*period.shape, -1)
    place = np.stack([result.along(axis) for axis in axes], axis=-1)
    shares = ((place - ends[0]) / (ends[1] - ends[0])).reshape(*period.shape, 2)
    growth = np.zeros(period.shape)
    if "lyapunov_exponent" in result.variables:
        growth = result.lanes("lyapunov_exponent").reshape(period.shape)
    counts = [result.lanes(name).reshape(period.shape) for name in impacts]
    return _Cells(period, state, shares, growth, np.array(counts) * period)


def _chosen(
    cells: _Cells, flank: int, number: int, where: tuple[Mask, Mask]
) -> Iterator[MapChange]:
    """Yield one change of each part of the map, the one whose motion decays most slowly.

    ``where``: whether the neighbours at one value of parameter ``number`` differ, and whether the
    motions of all cells are periodic.
    """
    differs, periodic = where
    best: dict[tuple[int, ...], tuple[float, tuple[int, ...]]] = {}
    for beyond in (False, True):
        cell = _neighbours(number)[beyond]
        for index in zip(*np.nonzero(differs & periodic[cell]), strict=True):
            at = (index[0] + (beyond and number == 0), index[1] + (beyond and number == 1))
            whole = (*map(int, at), int(index[2]))
            growth, period = float(cells.growth[whole]), int(cells.period[whole])
            parts = np.minimum((cells.shares[whole] * PARTS).astype(int), PARTS - 1)
            key = (period, *parts.tolist())
            if key not in best or growth > best[key][0]:
                best[key] = growth, whole
    for _, at in best.values():
        yield MapChange(flank, int(cells.period[at]), cells.state[at], cells.shares[at], number)
