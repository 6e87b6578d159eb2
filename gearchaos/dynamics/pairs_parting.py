"""Points of a curve that part two special points of one kind.

Two special points between the same two points change the sign of their test function twice. Where
a test function comes near to zero, a point of the curve is therefore searched between them.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.dynamics.arclength import OnCurve
from gearchaos.dynamics.side_by_side import Search

NEAR_ZERO = 0.5
"""Largest ratio of the extreme of a parabola through three values to the one in the middle.

Where the extreme is larger, there are no two special points to part.
"""

MOST_PARTINGS = 8
"""Largest number of points with which a point between two special points is searched."""

Point = TypeVar("Point", bound=OnCurve)
Asked = TypeVar("Asked")
Answered = TypeVar("Answered")


def nearly_zero(points: Sequence[OnCurve], values: Floats) -> list[int]:
    """Return the points near which a test function may be zero without a change of its sign.

    ``values``: those of all points, (points,). There its amount is the least among three points,
    and the parabola through them comes near to zero.
    """
    size = np.abs(values)
    same = (values[:-2] * values[1:-1] > 0.0) & (values[1:-1] * values[2:] > 0.0)
    least = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    return [
        at
        for at in (np.nonzero(same & least)[0] + 1).tolist()
        if extreme_near_zero(points[at - 1 : at + 2], values[at - 1 : at + 2]) is not None
    ]


def extreme_near_zero(three: Sequence[OnCurve], values: Floats) -> float | None:
    """Return where the parabola through three values (3,) comes near to zero.

    The result is the distance from the second point. None if it does not come near to zero between
    the points.
    """
    before, after = (float(np.linalg.norm(one.place - three[1].place)) for one in three[::2])
    sign = np.sign(values[1])
    bend, slope, height = np.polyfit(np.array([-before, 0.0, after]), sign * values, 2)
    if not bend > 0.0:
        return None
    at, extreme = -slope / (2.0 * bend), height - slope**2 / (4.0 * bend)
    if not -before < at < after or extreme > NEAR_ZERO * abs(values[1]):
        return None
    return float(at)


def parting(
    three: Sequence[Point],
    test: Callable[[Sequence[Point]], Floats],
    between: Callable[[Point, Point, float], Search[Asked, Answered, Point | None]],
) -> Search[Asked, Answered, Point | None]:
    """Search a point among three at which a test function has another sign than at them.

    Each step takes the extreme of the parabola through the three points nearest to it.

    ``test`` returns the function at some points, (points,); ``between`` searches the point of the
    curve at a share of the way between two points.
    """
    for _ in range(MOST_PARTINGS):
        values = test(three)
        at = extreme_near_zero(three, values)
        if at is None or at == 0.0:
            return None
        before = at < 0.0
        one, other = three[:2] if before else three[1:]
        length = float(np.linalg.norm(other.place - one.place))
        share = (at + length if before else at) / length
        new = yield from between(one, other, min(max(share, 1e-3), 1.0 - 1e-3))
        if new is None:
            return None
        value = float(test([new])[0])
        if value * values[1] <= 0.0:
            return new
        if abs(value) > abs(values[1]):
            three = [new, *three[1:]] if before else [*three[:2], new]
        else:
            three = [one, new, other]
    return None


def joined_with(points: list[Point], found: Sequence[tuple[int, Point | None]]) -> list[Point]:
    """Return the points of a curve in order, with some that were found beside them.

    ``found``: numbers of points, and the point found beside each, or None where there is none.
    """
    parted: list[tuple[int, float, Point]] = []
    for at, one in found:
        if one is not None:
            first = at if _along(points[at], one, points[at + 1]) > 0.0 else at - 1
            parted.append((first, _along(points[first], one, points[first + 1]), one))
    joined = list(points)
    # The last ones first: the numbers of those before stay.
    for first, _, one in sorted(parted, key=lambda it: it[:2], reverse=True):
        joined.insert(first + 1, one)
    return joined


def _along(before: OnCurve, point: OnCurve, after: OnCurve) -> float:
    """Return how far a point lies on the way from one to another."""
    return float((point.place - before.place) @ (after.place - before.place))
