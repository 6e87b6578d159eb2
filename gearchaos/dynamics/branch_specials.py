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
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.arclength import Curve, CurvePoint, cubic, is_exact
from gearchaos.dynamics.curve_defects import Finding
from gearchaos.dynamics.near_grazings import TestFunction, near_grazings
from gearchaos.dynamics.pairs_parting import parting, partings, with_parted
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

MOST_GRAZINGS = 16
"""Largest number of changes of the impacts on one flank between two points."""

ROUNDED = 1e-8
"""Distance up to which two changes of the impacts are one grazing."""

ROUNDING_OF_TESTS = 1e-7
"""Size of a test function below which its sign is that of rounding.

Where a linear motion loses stability, orbits of a whole range of amplitudes exist at one value of
the parameter: along them a multiplier stays 1, and the parameter does not change.
"""

STRETCH, JUMPING = 1e-7, 1e-5
"""Lengths of a stretch without further points, in which a special point counts as located.

The second one is for RK4: its curve jumps where it begins to see a contact.
"""

MOST_TRIALS = 80
"""Largest number of points with which a special point is located."""


def with_pairs_parted(curve: Curve, points: list[CurvePoint]) -> Finding[list[CurvePoint]]:
    """Search points that part pairs of special points of one kind; return all points in order."""
    grazings = near_grazings(curve, points)

    def between(one: CurvePoint, other: CurvePoint, share: float) -> Finding[CurvePoint | None]:
        return _between(curve, one, other, share)

    searches = [
        one
        for test, values in _of_multipliers_along(points)
        for one in partings(points, values, test, between)
    ]
    searches += [
        (at, parting(points[at - 1 : at + 2], (0, 2), test, between)) for at, test in grazings.tests
    ]
    searches += [(at, between(points[at], points[at + 1], share)) for at, share in grazings.between]
    return (yield from with_parted(points, searches))


def _of_multipliers_along(points: Sequence[CurvePoint]) -> Iterator[tuple[TestFunction, Floats]]:
    """Yield the test functions of the multipliers, and their values at some points, (points,)."""
    functions = [_test_functions(one) for one in points]
    values = np.array([[*one.values()] for one in functions])
    for kind, of_kind in zip(functions[0], values.T, strict=True):

        def test(some: Sequence[CurvePoint], kind: str = kind) -> Floats:
            return np.array([_test_functions(one)[kind] for one in some])

        yield test, of_kind


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
    """Search kind, point and flank of the special points between two points, along the curve.

    A flank is that of a grazing, and otherwise -1. ``located``: length of the stretch of the curve
    in which a special point lies.
    """
    flanks = range(len(one.impacts))
    grazing = yield from together(
        [_grazings(curve, one, other, flank, located) for flank in flanks]
    )
    specials = [
        (GRAZING, point, flank)
        for flank, points in zip(flanks, grazing, strict=True)
        for point in points
    ]
    specials.sort(key=lambda special: _along(one, special[1], other))
    # Next to a grazing the multipliers change with the square root of the parameter: two points of
    # one kind may lie on both sides of it.
    sought = [
        (kind, _of_multipliers(curve, before, after, (kind, function), located))
        for before, after in pairwise(_parted(one, [point for _, point, _ in specials], other))
        for kind, function in _changes_of_sign(before, after)
    ]
    found = yield from together([search for _, search in sought])
    specials += [
        (kind, point, -1)
        for (kind, _), points in zip(sought, found, strict=True)
        for point in points
    ]
    return sorted(specials, key=lambda special: _along(one, special[1], other))


def _along(one: CurvePoint, point: CurvePoint, other: CurvePoint) -> float:
    """Return how far a point lies from one towards another point."""
    return float((point.place - one.place) @ (other.place - one.place))


def _parted(one: CurvePoint, between: Sequence[CurvePoint], other: CurvePoint) -> list[CurvePoint]:
    """Return two points with those between them, without any that coincide up to rounding."""
    parted = [one]
    for point in between:
        away = [np.linalg.norm(point.place - end.place) for end in (parted[-1], other)]
        if min(away) > ROUNDED:
            parted.append(point)
    return [*parted, other]


def _of_multipliers(
    curve: Curve, one: CurvePoint, other: CurvePoint, sought: "_Sought", located: float
) -> Finding[list[CurvePoint]]:
    """Search the special point between two at which a function of the multipliers is zero."""
    kind, function = sought
    point = yield from _located(curve, one, other, function, located)
    if point is None:
        return []
    nearest = point.nearest
    turns = kind != NEIMARK_SACKER or _has_pair_on_circle(nearest.multipliers)
    return [nearest] if turns else []


def _grazings(
    curve: Curve, one: CurvePoint, other: CurvePoint, flank: int, located: float
) -> Finding[list[CurvePoint]]:
    """Search the points between two at which impacts on a flank appear or vanish."""
    found: list[CurvePoint] = []
    for _ in range(MOST_GRAZINGS):
        if one.impacts[flank] == other.impacts[flank]:
            break
        before = one.impacts[flank]

        def changed(at: CurvePoint, before: int = before) -> float:
            return 1.0 if at.impacts[flank] == before else -1.0

        point = yield from _located(curve, one, other, changed, located)
        if point is None:
            break
        # Next to a grazing, rounding may begin and end contacts.
        if not found or np.linalg.norm(point.nearest.place - found[-1].place) > ROUNDED:
            found.append(point.nearest)
        one = point.beyond
    return found


_Sought = tuple[str, Callable[[CurvePoint], float]]
"""Kind of a special point, and the function that changes its sign there."""


class _Place(NamedTuple):
    """A located special point: the point nearest to it, and a point beyond."""

    nearest: CurvePoint
    beyond: CurvePoint


def _changes_of_sign(one: CurvePoint, other: CurvePoint) -> Iterator[_Sought]:
    """Yield the kinds of special points of the multipliers between two points."""
    before, after = _test_functions(one), _test_functions(other)
    for kind in before:
        if before[kind] * after[kind] >= 0.0:
            continue
        least = min(abs(before[kind]), abs(after[kind]))
        if kind in (FOLD, BRANCH_POINT) and least < ROUNDING_OF_TESTS:
            continue
        if kind == BRANCH_POINT and before[FOLD] * after[FOLD] < 0.0:
            # A multiplier passes +1 at every fold.
            continue

        def test_function(at: CurvePoint, kind: str = kind) -> float:
            return _test_functions(at)[kind]

        yield kind, test_function


def _has_pair_on_circle(multipliers: Complex) -> bool:
    """Whether the pair of multipliers whose product is nearest to 1 is complex, not real."""
    pairs = list(combinations(multipliers.tolist(), 2))
    nearest = min(pairs, key=lambda pair: abs(pair[0] * pair[1] - 1.0))
    return bool(nearest[0].imag != 0.0)


def _located(
    curve: Curve,
    one: CurvePoint,
    other: CurvePoint,
    function: Callable[[CurvePoint], float],
    located: float,
) -> Finding[_Place | None]:
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
            enough = STRETCH if is_exact(curve.plan) else JUMPING
            return _Place(nearest, other) if length < enough else None
        nearest, value = middle, function(middle)
        if value == 0.0:
            break
        if (value > 0.0) == (low > 0.0):
            one, low = middle, value
            high /= 2.0
        else:
            other, high = middle, value
            low /= 2.0
    return _Place(nearest, other)


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
