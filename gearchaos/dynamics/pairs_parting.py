"""Points of a curve that part two special points of one kind.

Two special points between the same two points change the sign of their test function twice. Where
a test function comes near to zero, a point of the curve is therefore searched between them. It does
so at a point with the least value among three, or between two points if it heads for zero.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from gearchaos.arrays import Floats, Mask
from gearchaos.dynamics.arclength import OnCurve
from gearchaos.dynamics.side_by_side import Search, together

NEAR_ZERO = 0.5
"""Largest ratio of the extreme of a parabola to the value with which it begins to be searched.

Where the extreme is larger, there are no two special points to part.
"""

SHORT_STRETCH = 1e-5
"""Length of a stretch in which two special points count as one."""

SAME_PLACE = 1e-9
"""Distance below which two points that were found are one."""

MOST_PARTINGS = 8
"""Largest number of points with which a point between two special points is searched."""

MISSES, PROGRESS = 1, 0.75
"""How many of them may have a value above this share of the least value before."""

Point = TypeVar("Point", bound=OnCurve)
Asked = TypeVar("Asked")
Answered = TypeVar("Answered")


class _Expected(NamedTuple):
    """Where a test function is expected to come near to zero between two points of a curve.

    ``stretch``: number of the point with which the stretch between both begins; ``share``: share of
    the way to the next point; ``extreme``: expected value, positive if it has the sign of both.
    """

    stretch: int
    share: float
    extreme: float


def nearly_zero(points: Sequence[OnCurve], values: Floats) -> list[int]:
    """Return the points near which a test function may be zero without a change of its sign.

    ``values``: those of all points, (points,). There its amount is the least among three points,
    and the parabola through them comes near to zero.
    """
    near, _, _ = _among_three(values, _lengths(points))
    return (np.flatnonzero(near) + 1).tolist()


def partings(
    points: Sequence[Point],
    values: Floats,
    test: Callable[[Sequence[Point]], Floats],
    between: Callable[[Point, Point, float], Search[Asked, Answered, Point | None]],
) -> list[tuple[int, Search[Asked, Answered, Point | None]]]:
    """Return the searches of points that part two zeros of a test function, for `with_parted`.

    ``values``: those of the function at all points, (points,); others as in `parting`. Each search
    comes with the number of the point beside which its result lies.
    """
    near = nearly_zero(points, values)
    ranges = [(at, at - 1, at + 1) for at in near]
    headed = {one.stretch for one in _headed_both_ways(values, _lengths(points))}
    beside = {at - 1 for at in near} | {*near}
    ranges += [(at, at, at + 1) for at in sorted(headed - beside)]
    found = []
    for at, begin, end in ranges:
        first = max(begin - 1, 0)
        within = begin - first, end - first
        found.append((at, parting(points[first : end + 2], within, test, between)))
    return found


def _lengths(points: Sequence[OnCurve]) -> Floats:
    """Return the distances of successive points, (points - 1,)."""
    places = np.array([one.place for one in points])
    return np.asarray(np.linalg.norm(np.diff(places, axis=0), axis=1))


def _among_three(values: Floats, lengths: Floats) -> tuple[Mask, Floats, Floats]:
    """Return where the parabola through three values comes near to zero, (points - 2,) each.

    Returned are whether it does so, its distance from the second point, and its extreme, which is
    positive if it has the sign of the values. The second value has the least amount of the three.
    """
    size = np.abs(values)
    same = (values[:-2] * values[1:-1] > 0.0) & (values[1:-1] * values[2:] > 0.0)
    least = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    before, after = lengths[:-1], lengths[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.diff(size) / lengths
        bend = (slopes[1:] - slopes[:-1]) / (before + after)
        slope = (slopes[:-1] * after + slopes[1:] * before) / (before + after)
        away = -slope / (2.0 * bend)
        extreme = size[1:-1] - slope**2 / (4.0 * bend)
        near = same & least & (bend > 0.0)
        near &= (-before < away) & (away < after) & (extreme <= NEAR_ZERO * size[1:-1])
    return near, away, extreme


def _headed_both_ways(values: Floats, lengths: Floats) -> list[_Expected]:
    """Return where values head for zero, seen from both ends of the curve."""
    last = lengths.size - 1
    backwards = _headed(values[::-1], lengths[::-1])
    return [
        *_headed(values, lengths),
        *(_Expected(last - one.stretch, 1.0 - one.share, one.extreme) for one in backwards),
    ]


def _headed(values: Floats, lengths: Floats) -> list[_Expected]:
    """Return where values head for zero with the slope of the stretch before.

    Next to a grazing a test function may turn within a stretch, like the root of the distance. The
    parabola through three points then stays far from zero, or no point has the least value. The
    parabola through both ends of a stretch has the slope with which the values arrive there.
    """
    begin, end, length = values[1:-1], values[2:], lengths[1:]
    sign = np.sign(begin)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (begin - values[:-2]) / lengths[:-1] * length
        share = 0.5 * slope / (slope - (end - begin))
        extreme = sign * (begin + 0.5 * slope * share)
        near = (begin * end > 0.0) & (begin * slope < 0.0) & (share > 0.0) & (share < 1.0)
        near &= (length > SHORT_STRETCH) & (extreme <= NEAR_ZERO * np.abs(begin))
    return [
        _Expected(at + 1, float(share[at]), float(extreme[at]))
        for at in np.flatnonzero(near).tolist()
    ]


def _expected(points: Sequence[OnCurve], values: Floats, stretches: range) -> _Expected | None:
    """Return where a test function is expected to come nearest to zero within some stretches.

    A least value among three points says more than a slope from one side.
    """
    lengths = _lengths(points)
    near, away, extreme = _among_three(values, lengths)
    found = []
    for at in np.flatnonzero(near).tolist():
        back = away[at] < 0.0
        share = 1.0 + away[at] / lengths[at] if back else away[at] / lengths[at + 1]
        found.append(_Expected(at + (not back), float(share), float(extreme[at])))
    for some in (found, _headed_both_ways(values, lengths)):
        within = [one for one in some if one.stretch in stretches]
        if within:
            return min(within, key=lambda one: one.extreme)
    return None


def parting(
    points: Sequence[Point],
    within: tuple[int, int],
    test: Callable[[Sequence[Point]], Floats],
    between: Callable[[Point, Point, float], Search[Asked, Answered, Point | None]],
) -> Search[Asked, Answered, Point | None]:
    """Search a point of a curve at which a test function has another sign than at its neighbours.

    Each step takes the place where the function is expected to come nearest to zero.

    Parameters
    ----------
    points : sequence of Point
        Points of the curve, in order.
    within : (int, int)
        Numbers of the points between which the point is searched. Those beside them show how the
        values arrive there.
    test : callable
        Returns the function at some points, (points,).
    between : callable
        Searches the point of the curve at a share of the way between two points.
    """
    some, values = list(points), test(points)
    first, last = within
    misses = 0
    for _ in range(MOST_PARTINGS):
        expected = _expected(some, values, range(first, last))
        if expected is None:
            return None
        at, share, _ = expected
        new = yield from between(some[at], some[at + 1], min(max(share, 1e-3), 1.0 - 1e-3))
        if new is None:
            return None
        (value,) = test([new])
        if not np.isfinite(value):
            return None
        if value * values[at] <= 0.0:
            return new
        misses += abs(value) > PROGRESS * np.min(np.abs(values[first : last + 1]))
        if misses > MISSES:
            return None
        some.insert(at + 1, new)
        values, last = np.insert(values, at + 1, value), last + 1
    return None


def with_parted(
    points: list[Point], searches: Sequence[tuple[int, Search[Asked, Answered, Point | None]]]
) -> Search[Asked, Answered, list[Point]]:
    """Search points beside some points of a curve; return all of them in order.

    ``searches``: numbers of points, and the search of the point beside each.
    """
    results = yield from together([search for _, search in searches])
    parted: list[tuple[int, float, Point]] = []
    for (at, _), one in zip(searches, results, strict=True):
        if one is not None:
            first = at if _along(points[at], one, points[at + 1]) > 0.0 else at - 1
            parted.append((first, _along(points[first], one, points[first + 1]), one))
    joined = list(points)
    # The last ones first: the numbers of those before stay.
    for first, _, one in sorted(parted, key=lambda it: it[:2], reverse=True):
        # Two searches may have found the same point.
        if np.linalg.norm(joined[first + 1].place - one.place) > SAME_PLACE:
            joined.insert(first + 1, one)
    return joined


def _along(before: OnCurve, point: OnCurve, after: OnCurve) -> float:
    """Return how far a point lies on the way from one to another."""
    return float((point.place - before.place) @ (after.place - before.place))
