"""Where a map changes between neighbouring cells: places from which boundaries can be started."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.results.reading.jumps import jump_sizes, sections_of, size_of
from gearchaos.results.reading.result import Result

JUMP = -2
"""In place of a flank: the motion jumps to another one of the same period."""

DOUBLES = -3
"""In place of a flank: the motion in the other cell has twice the period."""

PARTS = 8
"""Parts of each range; in each part of the map, one change of every kind is a start at a time."""


class MapChange(NamedTuple):
    """A periodic motion in a cell of a map, next to a cell where it has changed.

    Attributes
    ----------
    flank : int
        Number of the flank whose impacts change, -1 if the period changes, or `JUMP` or `DOUBLES`.
    period : int
        Its period in excitation periods.
    state : array, shape (states,)
        Its state at the end of the record, dimensionless.
    shares : array, shape (2,)
        Where the cell lies in the ranges of both parameters.
    other : array, shape (2,)
        The same of the cell next to it.
    number : int
        The parameter that both cells have in common.
    """

    flank: int
    period: int
    state: Floats
    shares: Floats
    other: Floats
    number: int


class Changes(NamedTuple):
    """The changes of a map, one row each.

    Attributes
    ----------
    flank, period, number : array of int, shape (changes,)
        As in `MapChange`.
    state : array, shape (changes, states)
        As in `MapChange`.
    growth : array, shape (changes,)
        Largest exponent of the motion, 0 if the map has none.
    cells : array of int, shape (changes, 2, 2)
        Both cells of each change, that of the motion first; each has its numbers along the first
        and the second parameter.
    counts : array of int, shape (2,)
        Number of cells along the first and the second parameter.
    shares, other : array, shape (changes, 2)
        As in `MapChange`.
    """

    flank: Integers
    period: Integers
    number: Integers
    state: Floats
    growth: Floats
    cells: Integers
    counts: Integers
    shares: Floats
    other: Floats

    def of(self, chosen: Mask | Integers) -> Self:
        """Return some of the changes."""
        return self._replace(
            flank=self.flank[chosen],
            period=self.period[chosen],
            number=self.number[chosen],
            state=self.state[chosen],
            growth=self.growth[chosen],
            cells=self.cells[chosen],
            shares=self.shares[chosen],
            other=self.other[chosen],
        )

    def beside(self, curve: Floats) -> Mask:
        """Return which changes have a cell next to a curve through points (points, 2) in shares."""
        marked = np.zeros(self.counts + 2, dtype=bool)
        at = curve * (self.counts - 1)
        for one, other in pairwise(at):
            parts = int(2.0 * np.max(np.abs(other - one))) + 1
            between = one + np.arange(parts + 1)[:, np.newaxis] / parts * (other - one)
            marked[tuple(np.rint(between).astype(int).T + 1)] = True
        near = np.zeros_like(marked)
        for across in (-1, 0, 1):
            for along in (-1, 0, 1):
                near |= np.roll(marked, (across, along), axis=(0, 1))
        first, second = self.cells[..., 0] + 1, self.cells[..., 1] + 1
        return np.asarray(near[first, second].any(axis=1))

    def spread(self, preferred: int) -> Integers:
        """Return the numbers of changes that are spread over the map, one of a kind in each part.

        A motion that decays slowly is near a loss of stability. Of other changes, those in the
        middle of each part come first that have one value of parameter ``preferred`` in common.
        """
        parts = np.minimum((self.shares * PARTS).astype(int), PARTS - 1)
        away = np.abs(self.shares * PARTS - parts - 0.5)
        aside = away[:, max(preferred, 0)] + (self.number != preferred)
        keys = np.column_stack([self.flank, self.period, parts])
        order = np.lexsort([aside, np.where(self.flank < 0, -self.growth, 0.0)])
        _, first = np.unique(keys[order], axis=0, return_index=True)
        return np.sort(order[first])

    def each(self) -> Iterator[MapChange]:
        """Yield the changes one by one."""
        for at in range(self.flank.size):
            yield MapChange(
                int(self.flank[at]),
                int(self.period[at]),
                self.state[at],
                self.shares[at],
                self.other[at],
                int(self.number[at]),
            )


def changes_of(
    result: Result, axes: Sequence[str], ends: Floats, longest: int, impacts: Sequence[str]
) -> Changes:
    """Return the changes of the periodic motions of a map.

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
    shape = tuple(result[axis].shape[0] for axis in axes[::-1])
    period = result.lanes("period").reshape(*shape, -1).astype(np.intp)
    counts = [result.lanes(name).reshape(period.shape) * period for name in impacts]
    periodic = (period > 0) & (period <= longest)
    sections = _sections(result)
    sections = sections.reshape(*period.shape, *sections.shape[1:])
    found = []
    for number in (0, 1):
        one, other = _neighbours(number)
        differs = period[one] != period[other]
        found.append(_marked(_rows(-1, number, differs, periodic), period))
        touches = np.zeros_like(differs)
        for flank, count in enumerate(counts):
            more = np.abs(count[one] - count[other]) > 0.5
            found.append(_rows(flank, number, more & ~differs, periodic))
            touches |= more
        # A small jump where impacts change would pass for a grazing.
        found.append(_rows(JUMP, number, _jumps(number, period, sections, touches), periodic))
    rows, growth = np.concatenate(found), np.zeros(period.size)
    if "lyapunov_exponent" in result.variables:
        growth = result.lanes("lyapunov_exponent")
    place = np.stack([result.along(axis) for axis in axes], axis=-1)
    place = (place - ends[0]) / (ends[1] - ends[0])
    lanes, beside = (
        np.ravel_multi_index(tuple(rows[:, [second, first, 6]].T), period.shape)
        for first, second in ((2, 3), (4, 5))
    )
    return Changes(
        rows[:, 0],
        period.reshape(-1)[lanes],
        rows[:, 1],
        result.lanes("end_state")[lanes],
        growth[lanes],
        rows[:, 2:6].reshape(-1, 2, 2),
        np.array(shape[::-1], dtype=np.intp),
        place[lanes],
        place[beside],
    )


def _marked(rows: Integers, period: Integers) -> Integers:
    """Mark the changes in which the period doubles; only a period doubling explains them."""
    ours, theirs = (
        period[rows[:, second], rows[:, first], rows[:, 6]] for first, second in ((2, 3), (4, 5))
    )
    marked = rows.copy()
    marked[theirs == 2 * ours, 0] = DOUBLES
    return marked


def _sections(result: Result) -> Floats:
    """Return the sections (lanes, points, states) relative to their sizes, or states of period 1.

    The states at the ends of the records show jumps of period 1 only.
    """
    sections = sections_of(result)
    if not sections.size:
        sections = result.lanes("end_state")[:, np.newaxis]
    return np.asarray(sections / size_of(sections))


def _jumps(axis: int, period: Integers, sections: Floats, faint: Mask) -> Mask:
    """Return between which cells that are neighbours along an axis motions of one period jump.

    ``period`` has the shape of the map, ``sections`` that shape and then points and states.
    ``faint``: between which cells a small jump counts, see `jump_sizes`.
    """
    along, points = np.moveaxis(period, axis, 0), np.moveaxis(sections, axis, 0)
    small = np.moveaxis(faint, axis, 0)
    found = np.zeros(small.shape, dtype=bool)
    for line in np.ndindex(along.shape[1:]):
        at = (slice(None), *line)
        found[at] = jump_sizes(along[at], points[at], alone=0.0, faint=small[at]) > 0.0
    return np.moveaxis(found, 0, axis)


def _neighbours(number: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return the parts of a map whose cells are neighbours at one value of a parameter."""
    whole, first, last = slice(None), slice(None, -1), slice(1, None)
    return ((first, whole), (last, whole)) if number == 0 else ((whole, first), (whole, last))


def _rows(flank: int, number: int, differs: Mask, periodic: Mask) -> Integers:
    """Return changes at one value of a parameter, from each side with a periodic motion.

    Each row has the flank, the parameter, both cells, and the number of the start.
    """
    second, first, start = np.nonzero(differs)
    step = np.array([0, 1]) if number == 0 else np.array([1, 0])
    begin = np.column_stack([first, second])
    found = []
    for one, other in ((begin, begin + step), (begin + step, begin)):
        kept = periodic[one[:, 1], one[:, 0], start]
        about = np.broadcast_to(np.array([flank, number]), (len(start), 2))
        found.append(np.column_stack([about, one, other, start])[kept])
    return np.concatenate(found)
