"""Special points of a branch of periodic orbits.

Where a test function changes its sign between two points of a branch, there is a special point
between them, which is then located on the curve:

- fold: the parameter turns back;
- branch point: a real multiplier passes +1 without a fold;
- period doubling: a real multiplier passes -1;
- Neimark-Sacker: a complex pair passes the unit circle;
- grazing: an element begins or ceases to meet a flank.

Two special points of one kind between the same two points change the sign twice. Where a test
function comes near to zero, a point of the curve is therefore searched between them.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations

import numpy as np

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.arclength import Curve, CurvePoint, cubic
from gearchaos.dynamics.curve_defects import Finding
from gearchaos.dynamics.side_by_side import together
from gearchaos.records.branch import (
    BRANCH_POINT,
    FOLD,
    GRAZING,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
)

LOCATED = 1e-11
"""Largest length of the stretch of a curve in which a special point lies."""

SHORT = 0.01
"""Length of such a stretch in which the derivative by the parameter is nearly linear."""

MOST_TRIALS = 80
"""Largest number of points with which a special point is located."""

NEAR_ZERO = 0.5
"""Largest ratio of the extreme of a parabola through three values to the one in the middle.

Where the extreme is larger, there are no two special points to part.
"""

MOST_PARTINGS = 8
"""Largest number of points with which a point between two special points is searched."""


def with_pairs_parted(curve: Curve, points: list[CurvePoint]) -> Finding[list[CurvePoint]]:
    """Search points that part pairs of special points of one kind; return all points in order.

    A grazing has no test function with an amount, so pairs of them are not seen.
    """
    functions = [_test_functions(one) for one in points]
    values = np.array([[*one.values()] for one in functions])
    places = np.array([one.place for one in points])
    positions = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1)))
    sought = [
        (at, kind)
        for kind, of_kind in zip(functions[0], values.T, strict=True)
        for at in _nearly_zero(of_kind, positions)
    ]
    found = yield from together(
        [_parting(curve, points[at - 1 : at + 2], kind) for at, kind in sought]
    )
    parted: list[tuple[int, float, CurvePoint]] = []
    for (at, _), one in zip(sought, found, strict=True):
        if one is not None:
            first = at if _along(points[at], one, points[at + 1]) > 0.0 else at - 1
            parted.append((first, _along(points[first], one, points[first + 1]), one))
    joined = list(points)
    # The last ones first: the numbers of those before stay.
    for first, _, one in sorted(parted, key=lambda it: it[:2], reverse=True):
        joined.insert(first + 1, one)
    return joined


def _along(before: CurvePoint, point: CurvePoint, after: CurvePoint) -> float:
    """Return how far a point lies on the way from one to another."""
    return float((point.place - before.place) @ (after.place - before.place))


def _nearly_zero(values: Floats, positions: Floats) -> list[int]:
    """Return the points near which a test function may be zero without a change of its sign.

    ``values`` and ``positions``: those of all points, (points,). There its amount is the least
    among three points, and the parabola through them comes near to zero.
    """
    found = []
    size = np.abs(values)
    same = (values[:-2] * values[1:-1] > 0.0) & (values[1:-1] * values[2:] > 0.0)
    least = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    for at in (np.nonzero(same & least)[0] + 1).tolist():
        three = slice(at - 1, at + 2)
        extreme = _extreme(positions[three], values[three])
        if extreme is not None and extreme[1] <= NEAR_ZERO * size[at]:
            found.append(at)
    return found


def _extreme(positions: Floats, values: Floats) -> tuple[float, float] | None:
    """Return where the parabola through three values is least in amount, and how large it is there.

    It is negative if it has the other sign than the values. None if it has no such place between
    the positions.
    """
    sign = np.sign(values[1])
    bend, slope, height = np.polyfit(positions - positions[1], sign * values, 2)
    if not bend > 0.0:
        return None
    at = -slope / (2.0 * bend)
    if not positions[0] < positions[1] + at < positions[2]:
        return None
    return float(positions[1] + at), float(height - slope**2 / (4.0 * bend))


def _parting(curve: Curve, three: Sequence[CurvePoint], kind: str) -> Finding[CurvePoint | None]:
    """Search a point among three at which a test function has another sign than at them.

    Each step takes the extreme of the parabola through the three points nearest to it.
    """
    for _ in range(MOST_PARTINGS):
        lengths = [float(np.linalg.norm(one.place - three[1].place)) for one in three]
        positions = np.array([-lengths[0], 0.0, lengths[2]])
        values = np.array([_test_functions(one)[kind] for one in three])
        extreme = _extreme(positions, values)
        if extreme is None or extreme[1] > NEAR_ZERO * abs(values[1]) or extreme[0] == 0.0:
            return None
        before = extreme[0] < 0.0
        one, other = three[:2] if before else three[1:]
        share = (extreme[0] - (positions[0] if before else 0.0)) / (lengths[0 if before else 2])
        new = yield from _between(curve, one, other, min(max(share, 1e-3), 1.0 - 1e-3))
        if new is None:
            return None
        value = _test_functions(new)[kind]
        if value * values[1] <= 0.0:
            return new
        if abs(value) > abs(values[1]):
            three = [new, *three[1:]] if before else [*three[:2], new]
        else:
            three = [one, new, other]
    return None


def _test_functions(point: CurvePoint) -> dict[str, float]:
    """Return the functions that change their sign at special points of each kind."""
    multipliers = point.multipliers
    pairs = [one * other - 1.0 for one, other in combinations(multipliers, 2)]
    return {
        FOLD: float(point.tangent[-1]),
        BRANCH_POINT: float(np.prod(multipliers - 1.0).real),
        PERIOD_DOUBLING: float(np.prod(multipliers + 1.0).real),
        NEIMARK_SACKER: float(np.prod(pairs).real) if pairs else 1.0,
    }


def specials_between(
    curve: Curve, one: CurvePoint, other: CurvePoint, located: float
) -> Finding[list[tuple[str, CurvePoint, int]]]:
    """Search kind, point and flank of the special points between two points of a curve.

    A flank is that of a grazing, and otherwise -1. ``located``: length of the stretch of the curve
    in which a special point lies.
    """
    sought = [*_changes_of_sign(one, other), *_changes_of_impacts(one, other)]
    points = yield from together(
        [_located(curve, one, other, function, located) for _, function, _ in sought]
    )
    return [
        (kind, point, flank)
        for (kind, _, flank), point in zip(sought, points, strict=True)
        if point is not None and (kind != NEIMARK_SACKER or _has_pair_on_circle(point.multipliers))
    ]


_Sought = tuple[str, Callable[[CurvePoint], float], int]
"""Kind of a special point, the function that changes its sign there, and the flank or -1."""


def _changes_of_sign(one: CurvePoint, other: CurvePoint) -> Iterator[_Sought]:
    """Yield the kinds of special points of the multipliers between two points."""
    before, after = _test_functions(one), _test_functions(other)
    for kind in before:
        if before[kind] * after[kind] >= 0.0:
            continue
        if kind == BRANCH_POINT and before[FOLD] * after[FOLD] < 0.0:
            # A multiplier passes +1 at every fold.
            continue

        def test_function(at: CurvePoint, kind: str = kind) -> float:
            return _test_functions(at)[kind]

        yield kind, test_function, -1


def _has_pair_on_circle(multipliers: Complex) -> bool:
    """Whether the pair of multipliers whose product is nearest to 1 is complex, not real."""
    pairs = list(combinations(multipliers.tolist(), 2))
    nearest = min(pairs, key=lambda pair: abs(pair[0] * pair[1] - 1.0))
    return bool(nearest[0].imag != 0.0)


def _changes_of_impacts(one: CurvePoint, other: CurvePoint) -> Iterator[_Sought]:
    """Yield the flanks on which impacts appear or vanish between two points."""
    for flank, (before, after) in enumerate(zip(one.impacts, other.impacts, strict=True)):
        if before == after:
            continue

        def changed(at: CurvePoint, flank: int = flank, before: int = before) -> float:
            return 1.0 if at.impacts[flank] == before else -1.0

        yield GRAZING, changed, flank


def _located(
    curve: Curve,
    one: CurvePoint,
    other: CurvePoint,
    function: Callable[[CurvePoint], float],
    located: float,
) -> Finding[CurvePoint | None]:
    """Search the point between two points of a curve at which a function changes its sign.

    The method of false position with halved values (Illinois), or bisection where the function only
    has a sign. None if a point between them is not found.
    """
    low, high = function(one), function(other)
    bisects = abs(low) == abs(high) == 1.0
    nearest = one
    for number in range(MOST_TRIALS):
        length = float(np.linalg.norm(other.place - one.place))
        if length <= located:
            break
        share = 0.5 if bisects or number % 3 == 2 else low / (low - high)
        middle = yield from _between(curve, one, other, min(max(share, 1e-3), 1.0 - 1e-3))
        if middle is None:
            return nearest if length < 1e-7 else None
        nearest, value = middle, function(middle)
        if value == 0.0:
            break
        if (value > 0.0) == (low > 0.0):
            one, low = middle, value
            high /= 2.0
        else:
            other, high = middle, value
            low /= 2.0
    return nearest


def _between(
    curve: Curve, one: CurvePoint, other: CurvePoint, share: float
) -> Finding[CurvePoint | None]:
    """Search the point of a curve at a share of the chord between two points."""
    chord = other.place - one.place
    length = float(np.linalg.norm(chord))
    direction = chord / length
    normal = curve.plane(direction, one.tangent, other.tangent)
    by_share = one.by_share + share * (other.by_share - one.by_share)
    known = by_share if curve.own_maps and length <= SHORT else None
    guess = cubic(one, other, np.array([share]))[0]
    middle = yield from curve.correcting(guess, direction, normal, known)
    if middle is not None:
        return middle
    # Next to a grazing the curve may have a corner, which lines from both sides come near to.
    for side in (one, other):
        along = float((guess - side.place) @ normal) / float(side.tangent @ normal)
        line = side.place + along * side.tangent
        middle = yield from curve.correcting(line, direction, normal)
        if middle is not None:
            break
    return middle
