"""Attractors as sets of section points: how far they lie apart, and which goes on as which."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gearchaos.records.period import coordinate_scale

Floats = NDArray[np.float64]

Sets: TypeAlias = Sequence[Sequence[Floats]]

GOES_ON = 0.1
"""Largest distance of an attractor from where it is expected, as `numbers_along` measures it."""

ENOUGH = 256
"""Section points by which attractors of different values are compared."""

_PAIRS_AT_ONCE = 1 << 20


def distances(points: Floats, others: Floats, scale: Floats | None = None) -> Floats:
    """Return how far each point (points, states) lies from the nearest of others (others, states).

    The root mean square over the states, each in parts of its ``scale`` (states,), by default of
    its size on the others as `coordinate_scale` has it. Shape (points,).
    """
    scale = coordinate_scale(others[np.newaxis])[0] if scale is None else scale
    nearest = np.empty(len(points))
    step = max(1, _PAIRS_AT_ONCE // len(others))
    for first in range(0, len(points), step):
        apart = np.zeros(())
        for mine, theirs, unit in zip(points[first : first + step].T, others.T, scale, strict=True):
            apart = apart + ((mine[:, np.newaxis] - theirs) / unit) ** 2
        nearest[first : first + step] = apart.min(axis=1)
    return np.sqrt(nearest / len(scale))


def numbers_along(sets: Sets, ahead: Sets) -> list[list[int]]:
    """Number the attractors of consecutive values such that what goes on keeps its number.

    ``sets``: of every value the section points (points, states) of each attractor; ``ahead``: those
    of the motion to which it leads at the next value. An attractor goes on as that on which this
    motion lies, to `GOES_ON`, on average over the points of the set that has fewer; where several
    lead to one, the nearest of them does. One that is missing at some values returns with its
    number. A state is measured by its range over the sweep, or half its largest size if that is
    more.
    """
    every = np.concatenate([points for found in sets for points in found] or [np.zeros((1, 1))])
    scale = np.maximum(np.ptp(every, axis=0), np.abs(every).max(axis=0) / 2.0)
    scale = np.where(scale > 0.0, scale, 1.0)
    # Of each number: the value at which it was seen last, its points there and ahead.
    latest: list[tuple[int, Floats, Floats]] = []
    numbers = []
    for value, found in enumerate(sets):
        pairs = []
        for i, one in enumerate(found):
            for k, (seen, before, led) in enumerate(latest):
                off = _apart(one, led, scale)
                if off <= GOES_ON:
                    pairs.append((value - seen, off + _apart(one, before, scale), i, k))
        own: dict[int, int] = {}
        for _, _, i, k in sorted(pairs):
            if i not in own and k not in own.values():
                own[i] = k
        for i, points in enumerate(found):
            k = own.setdefault(i, len(latest))
            latest[k:] = [(value, points, ahead[value][i]), *latest[k + 1 :]]
        numbers.append([own[i] + 1 for i in range(len(found))])
    return numbers


def _apart(one: Floats, other: Floats, scale: Floats) -> float:
    fewer, more = sorted((one[:ENOUGH], other[:ENOUGH]), key=len)
    return float(np.mean(distances(fewer, more, scale)))
