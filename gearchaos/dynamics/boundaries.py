"""Boundaries over two parameters, followed by arclength, with their points of codimension 2.

The boundaries are folds, period doublings, Neimark-Sacker points and grazings of periodic orbits.
"""

from collections.abc import Sequence
from functools import partial
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.arclength import CurvePoint, cubic
from gearchaos.dynamics.boundary_equations import Equations, OnBoundary
from gearchaos.dynamics.boundary_following import (
    SHORT_STEP,
    Path,
    among_columns,
    fixed_direction,
    following,
)
from gearchaos.dynamics.boundary_passages import PARAMETERS, Following
from gearchaos.dynamics.boundary_tests import Reference
from gearchaos.dynamics.branch_specials import ROUNDING_OF_TESTS
from gearchaos.dynamics.pairs_parting import partings, with_parted
from gearchaos.dynamics.side_by_side import together
from gearchaos.records.boundary import (
    CUSP,
    FLIP_NEIMARK_SACKER,
    FOLD_FLIP,
    FOLD_NEIMARK_SACKER,
    GRAZING_FLIP,
    GRAZING_FOLD,
    GRAZING_NEIMARK_SACKER,
    NOT_STARTED,
    RESONANCES,
    STRONG_RESONANCE_11,
    STRONG_RESONANCE_12,
    WEAKER_RESONANCES,
)
from gearchaos.records.branch import FOLD, GRAZING, NEIMARK_SACKER, PERIOD_DOUBLING

LOCATED, MOST_TRIALS = 1e-10, 60
"""Length of the stretch in which a point of codimension 2 is located, and the most trials."""

NEAR, SAME_PLACE, SAME_POINT = 0.05, 1e-6, 1e-5
"""Distance from a boundary up to which a point is compared, and that of the same point.

The last one is that of boundaries of one point, which is located less accurately.
"""

TESTS = {
    FOLD: (CUSP, STRONG_RESONANCE_11, FOLD_FLIP, FOLD_NEIMARK_SACKER),
    PERIOD_DOUBLING: (STRONG_RESONANCE_12, FOLD_FLIP, FLIP_NEIMARK_SACKER),
    NEIMARK_SACKER: (*RESONANCES, *WEAKER_RESONANCES),
    GRAZING: (GRAZING_FOLD, GRAZING_FLIP, GRAZING_NEIMARK_SACKER),
}
"""Kinds of points of codimension 2 that are looked for on each kind of boundary."""

FLAT = 1e-3
"""Largest distance of a boundary from the line between two points, in shares of both ranges."""

JUMP = 0.1
"""Share of the values at both ends that a test may have where it changes its sign."""

SETTLED = 2e-10
"""Distance of two successive trials below which the next one would change less than `LOCATED`."""

_WITH_PAIR = (FOLD_NEIMARK_SACKER, FLIP_NEIMARK_SACKER, GRAZING_NEIMARK_SACKER)


class Located(NamedTuple):
    """A point of codimension 2: its kind, its number among the points, and the point."""

    kind: str
    number: int
    point: OnBoundary


class TracedBoundary(NamedTuple):
    """A boundary that has been followed.

    Attributes
    ----------
    equations : Equations
        Its equations.
    points : list of OnBoundary
        Its points in the order of the curve, those of codimension 2 among them.
    places : array, shape (points, states + 2)
        Their places.
    positions : array, shape (points,)
        Arclength of each point.
    located : list of Located
        Its points of codimension 2.
    ends : tuple of str
        Why it ends at its first and at its last point.
    """

    equations: Equations
    points: list[OnBoundary]
    places: Floats
    positions: Floats
    located: list[Located]
    ends: tuple[str, str]

    @property
    def period(self) -> int:
        """Period of the orbits in excitation periods."""
        return self.equations.periods

    @property
    def shares(self) -> Floats:
        """Shares of both ranges at its points, (points, 2)."""
        return self.places[:, -PARAMETERS:]

    def holding(self, start: OnBoundary) -> Following[bool]:
        """Search whether a point of the same kind, period and flank lies on the boundary."""
        if self.is_at(start.place):
            return True
        states = self.equations.scale.size
        for state in start.section / self.equations.scale:
            place = np.append(state, start.place[states:])
            near = self._nearest(place)
            if near is None:
                continue
            guess, direction, reference = near
            guess = guess - ((guess - place) @ direction) * direction
            if np.linalg.norm(guess - place) < SAME_PLACE:
                return True
            found = yield from self.equations.correcting(guess, direction, reference)
            if found is not None and np.linalg.norm(found.place - place) < SAME_PLACE:
                return True
        return False

    def is_at(self, place: Floats) -> bool:
        """Whether the boundary has one point only, an orbit through a place (states + 2,)."""
        if len(self.points) > 1:
            return False
        states, (one,) = self.equations.scale.size, self.points
        away = one.section / self.equations.scale - place[:states]
        beside = np.linalg.norm(one.shares - place[states:])
        return bool(np.hypot(np.linalg.norm(away, axis=1), beside).min() < SAME_POINT)

    def passes(self, place: Floats) -> bool:
        """Whether the boundary comes closer to a place (states + 2,) than `NEAR`."""
        return self._nearest(place) is not None

    def _nearest(self, place: Floats) -> tuple[Floats, Floats, Reference] | None:
        """Return the place of the boundary next to another one, its tangent and its reference.

        Between two points, the boundary is the cubic through both and their tangents. None if it
        lies further away than `NEAR`.
        """
        best, found = NEAR, None
        for one, other in pairwise(self.points):
            chord = other.place - one.place
            length = float(np.linalg.norm(chord))
            share = float((place - one.place) @ chord) / length**2 if length else 0.0
            aside = np.linalg.norm(place - one.place - min(max(share, 0.0), 1.0) * chord)
            if aside > NEAR + 0.3 * length:
                continue
            parts = np.clip(share + np.linspace(-0.2, 0.2, 41), 0.0, 1.0)
            curve = cubic(one, other, parts)
            distances = np.linalg.norm(curve - place, axis=1)
            at = int(np.argmin(distances))
            if distances[at] < best:
                tangent = one.tangent + parts[at] * (other.tangent - one.tangent)
                best, found = float(distances[at]), (curve[at], tangent, one.reference)
        if found is None:
            return None
        return found[0], found[1] / np.linalg.norm(found[1]), found[2]


def unstarted(equations: Equations, place: Floats, special: CurvePoint) -> TracedBoundary:
    """Return the boundary of one point, a special point from which none could be followed.

    ``place``: shape (states + 2,).
    """
    states = equations.scale.size
    slopes = np.full((states, PARAMETERS), np.nan)
    one = OnBoundary(
        place,
        np.zeros_like(place),
        special.multipliers,
        special.section,
        np.zeros(0),
        slopes,
        Reference(),
    )
    ends = (NOT_STARTED, NOT_STARTED)
    return TracedBoundary(equations, [one], place[np.newaxis], np.zeros(1), [], ends)


def tracing(equations: Equations, starts: Sequence[OnBoundary]) -> Following[list[TracedBoundary]]:
    """Follow the boundaries of one kind through some of their points, within both ranges.

    Parameters
    ----------
    equations : Equations
        Their equations.
    starts : sequence of OnBoundary
        Points of them.

    Returns
    -------
    list of TracedBoundary
        The boundaries with their points of codimension 2. Those of several starts are one.
    """
    paths = yield from following(equations, starts)
    return (yield from together([completed(equations, one) for one in paths]))


def completed(equations: Equations, path: Path) -> Following[TracedBoundary]:
    """Add the points between the points of a path that are of codimension 2, or make it smooth."""
    points = yield from _flattened(equations, path.points)
    points = yield from _with_pairs_parted(equations, _aligned(points))
    between = yield from together(
        [_located_between(equations, one, other) for one, other in pairwise(points)]
    )
    joined, located = points[:1], []
    for other, some in zip(points[1:], between, strict=True):
        for kind, point in some:
            located.append(Located(kind, len(joined), point))
            joined.append(point)
        joined.append(other)
    ends = [*path.ends]
    joined, located = _cut(joined, located, ends)
    places = np.array([one.place for one in joined])
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    positions = np.concatenate([[0.0], np.cumsum(lengths)])
    return TracedBoundary(equations, joined, places, positions, located, (ends[0], ends[1]))


def _flattened(equations: Equations, points: list[OnBoundary]) -> Following[list[OnBoundary]]:
    """Add points where lines between successive ones would lie beside the curve."""
    added = yield from together(
        [_points_between(equations, one, other) for one, other in pairwise(points)]
    )
    return points[:1] + [
        point for other, some in zip(points[1:], added, strict=True) for point in (*some, other)
    ]


def _points_between(
    equations: Equations, one: OnBoundary, other: OnBoundary
) -> Following[list[OnBoundary]]:
    """Search the points between two that a smooth curve needs."""
    chord = other.place - one.place
    length = float(np.linalg.norm(chord))
    middle = cubic(one, other, np.array([0.5]))[0]
    aside = np.linalg.norm((middle - (one.place + other.place) / 2.0)[-PARAMETERS:])
    if not (aside > FLAT and length > SHORT_STEP):
        return []
    guess, direction = among_columns(equations, middle, chord / length, 0.2 * length)
    between = yield from _found_between(equations, (one, other), guess, direction)
    if between is None:
        return []
    before, after = yield from together(
        [_points_between(equations, *ends) for ends in ((one, between), (between, other))]
    )
    return [*before, between, *after]


def _found_between(
    equations: Equations, ends: tuple[OnBoundary, OnBoundary], guess: Floats, direction: Floats
) -> Following[OnBoundary | None]:
    """Search the point between two that lies next to a guess, as `Equations.correcting`."""
    one, other = ends
    chord = other.place - one.place
    found = yield from equations.correcting(guess, direction, one.reference)
    if found is None or np.linalg.norm(found.place - guess) >= np.linalg.norm(chord) / 2.0:
        return None
    onward = np.sign(found.tangent @ chord) or 1.0
    return found._replace(tangent=onward * found.tangent)


def _aligned(points: list[OnBoundary]) -> list[OnBoundary]:
    """Return points with null vectors that do not change their direction along the curve."""
    found = points[:1]
    for point in points[1:]:
        left, right = (
            one * (np.sign(one @ before) or 1.0) if one.size == before.size else one
            for one, before in zip(point.reference[:2], found[-1].reference[:2], strict=True)
        )
        found.append(point._replace(reference=point.reference._replace(left=left, right=right)))
    return found


def _with_pairs_parted(
    equations: Equations, points: list[OnBoundary]
) -> Following[list[OnBoundary]]:
    """Search points that part pairs of points of codimension 2; return all points in order."""
    tests = [_tests(equations.kind, one) for one in points]

    def between(one: OnBoundary, other: OnBoundary, share: float) -> Following[OnBoundary | None]:
        chord = other.place - one.place
        direction = fixed_direction(equations, chord / np.linalg.norm(chord))
        guess = cubic(one, other, np.array([share]))[0]
        return _found_between(equations, (one, other), guess, direction)

    searches = []
    for name in TESTS[equations.kind]:
        test, values = partial(_test, equations.kind, name), np.array([one[name] for one in tests])
        searches += partings(points, values, test, between)
    return (yield from with_parted(points, searches))


def _cut(
    points: list[OnBoundary], located: list[Located], ends: list[str]
) -> tuple[list[OnBoundary], list[Located]]:
    """Cut a Neimark-Sacker curve at the resonances beyond which its pair is real.

    The reason of an end is replaced by the resonance.
    """
    angles = [abs(one.reference.cosine) for one in points]
    ending = [one for one in located if one.kind in RESONANCES]
    if not ending or points[0].reference.left.size:
        return points, located
    inside = [at for at, angle in enumerate(angles) if angle < 1.0 - 1e-9]
    middle = inside[len(inside) // 2] if inside else 0
    low = max((one.number for one in ending if one.number <= middle), default=None)
    high = min((one.number for one in ending if one.number > middle), default=None)
    for end, number in ((0, low), (1, high)):
        if number is not None:
            ends[end] = next(one.kind for one in ending if one.number == number)
    first, last = low or 0, len(points) - 1 if high is None else high
    kept = [
        one._replace(number=one.number - first) for one in located if first <= one.number <= last
    ]
    return points[first : last + 1], kept


def _test(kind: str, name: str, points: Sequence[OnBoundary]) -> Floats:
    """Return one of the functions of `_tests` at some points, (points,)."""
    return np.array([_tests(kind, one)[name] for one in points])


def _tests(kind: str, point: OnBoundary) -> dict[str, float]:
    """Return the functions that change their sign at points of codimension 2 of each kind.

    ``kind``: that of the boundary.
    """
    multipliers, found = point.multipliers, {}
    left, right = point.reference.left, point.reference.right
    cosine = point.reference.cosine
    for name in TESTS[kind]:
        if name == CUSP:
            # Both parameters move along the direction that the left null vector leaves.
            across = left @ point.slopes
            found[name] = float(point.tangent[-1] * across[0] - point.tangent[-2] * across[1])
        elif name in (STRONG_RESONANCE_11, STRONG_RESONANCE_12) and kind != NEIMARK_SACKER:
            found[name] = float(left @ right)
        elif name in RESONANCES or name in WEAKER_RESONANCES:
            found[name] = cosine - {**RESONANCES, **WEAKER_RESONANCES}[name]
        elif name in _WITH_PAIR:
            others = _others(kind, multipliers)
            pairs = [one * other - 1.0 for one, other in combinations(others, 2)]
            found[name] = float(np.prod(pairs).real) if pairs else 1.0
        else:
            sign = 1.0 if name == GRAZING_FLIP or (name, kind) == (FOLD_FLIP, FOLD) else -1.0
            found[name] = float(np.prod(multipliers + sign).real)
    return found


def _located_between(
    equations: Equations, one: OnBoundary, other: OnBoundary
) -> Following[list[tuple[str, OnBoundary]]]:
    """Search kind and point of the points of codimension 2 between two points, in order."""
    before, after = (_tests(equations.kind, at) for at in (one, other))
    names = [
        name
        for name, value in before.items()
        if value * after[name] < 0.0 and not (name == GRAZING_FOLD and _stays(one, other))
    ]
    points = yield from together([_located(equations, one, other, name) for name in names])
    found = []
    for name, point in zip(names, points, strict=True):
        if point is None or (
            name in _WITH_PAIR and not _has_complex_pair(_others(equations.kind, point.multipliers))
        ):
            continue
        if name == CUSP and not _turns_back(one, point, other):
            continue
        found.append((name, point))
    chord = other.place - one.place
    found.sort(key=lambda item: float((item[1].place - one.place) @ chord))
    return found


def _stays(one: OnBoundary, other: OnBoundary) -> bool:
    """Whether a multiplier stays 1 from one point to another, so that its sign is rounding."""
    nearest = [float(np.min(np.abs(at.multipliers - 1.0))) for at in (one, other)]
    return min(nearest) < ROUNDING_OF_TESTS


def _turns_back(one: OnBoundary, cusp: OnBoundary, other: OnBoundary) -> bool:
    """Whether both parameters turn back at a point between two others, as at a cusp."""
    return bool((cusp.shares - one.shares) @ (other.shares - cusp.shares) < 0.0)


def _others(kind: str, multipliers: Complex) -> Complex:
    """Return the multipliers besides the one that is 1 at a fold, or -1 at a period doubling."""
    critical = {FOLD: 1.0, PERIOD_DOUBLING: -1.0}.get(kind)
    if critical is None:
        return multipliers
    return np.delete(multipliers, np.argmin(np.abs(multipliers - critical)))


def _has_complex_pair(multipliers: Complex) -> bool:
    """Whether the pair of multipliers whose product is nearest to 1 is complex."""
    pairs = list(combinations(multipliers.tolist(), 2))
    nearest = min(pairs, key=lambda pair: abs(pair[0] * pair[1] - 1.0))
    return bool(nearest[0].imag != 0.0)


def _located(
    equations: Equations, one: OnBoundary, other: OnBoundary, name: str
) -> Following[OnBoundary | None]:
    """Search the point between two points at which a test changes its sign (Chandrupatla 1997)."""
    chord = other.place - one.place
    length = float(np.linalg.norm(chord))
    direction = fixed_direction(equations, chord / length)
    nearest: OnBoundary | None = None
    low, high = _test(equations.kind, name, (one, other))
    newest, opposite, share = (1.0, high), (0.0, low), low / (low - high)
    for _ in range(MOST_TRIALS):
        least = min(0.1, LOCATED / length)
        guess = cubic(one, other, np.array([min(max(share, least), 1.0 - least)]))[0]
        middle = yield from equations.correcting(guess, direction, one.reference, LOCATED)
        if middle is None:
            # Next to a double multiplier rounding leaves longer steps.
            middle = yield from equations.correcting(guess, direction, one.reference)
        if middle is None:
            break
        moved = np.inf if nearest is None else np.linalg.norm(middle.place - nearest.place)
        nearest, value = middle, float(_test(equations.kind, name, (middle,))[0])
        before = newest
        if (value > 0.0) == (newest[1] > 0.0):
            newest = share, value
        else:
            before, newest, opposite = opposite, (share, value), newest
        width = abs(newest[0] - opposite[0]) * length
        if value == 0.0 or moved <= SETTLED or width <= LOCATED:
            break
        share = _between(newest, opposite, before)
    # Where the test jumps, such as at a grazing, it is not zero.
    return nearest if abs(newest[1]) <= JUMP * max(abs(low), abs(high)) else None


def _between(
    newest: tuple[float, float], opposite: tuple[float, float], before: tuple[float, float]
) -> float:
    """Return where a function may be zero between two of three places, each with its value.

    Inverse quadratic interpolation where it is safe, else the middle.
    """
    (a, at_a), (b, at_b), (c, at_c) = newest, opposite, before
    part = 0.5
    if c not in (a, b) and at_a != at_c and at_b != at_c:
        along, ratio = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
        if ratio**2 < along and (1.0 - ratio) ** 2 < 1.0 - along:
            part = at_a / (at_b - at_a) * at_c / (at_b - at_c)
            part += (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
    return a + min(max(part, 0.0), 1.0) * (b - a)
