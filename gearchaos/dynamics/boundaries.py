"""Boundaries over two parameters, followed by arclength, with their points of codimension 2.

The boundaries are folds, period doublings, Neimark-Sacker points and grazings of periodic orbits.
"""

from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Complex, Floats, Mask
from gearchaos.dynamics.arclength import CurvePoint
from gearchaos.dynamics.boundary_equations import PARAMETERS, Equations, OnBoundary, Reference
from gearchaos.records.boundary import (
    CORNER,
    CUSP,
    FLIP_NEIMARK_SACKER,
    FOLD_FLIP,
    FOLD_NEIMARK_SACKER,
    GRAZING_FLIP,
    GRAZING_FOLD,
    GRAZING_NEIMARK_SACKER,
    NO_EXTREME,
    NOT_STARTED,
    RESONANCES,
    STRONG_RESONANCE_11,
    STRONG_RESONANCE_12,
    WEAKER_RESONANCES,
)
from gearchaos.records.branch import (
    CLOSED_CURVE,
    EDGE,
    FOLD,
    GRAZING,
    HALVING,
    LOST,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    TOO_MANY,
)

FIRST_STEP, LONGEST, SHORTEST = 5e-3, 0.25, 1e-5
"""Lengths of steps along a boundary: states in their scales, parameters in shares of ranges."""

SMOOTH, TURN = 0.9, 0.3
"""Least cosine between tangents of successive points, and the angle in rad that steps aim at."""

ASIDE = 0.3
"""Largest share of a step by which a point may lie aside of its prediction."""

MOST_POINTS = 1000
"""Largest number of points computed along one direction of a boundary."""

LOCATED, MOST_TRIALS = 1e-10, 60
"""Length of the stretch in which a point of codimension 2 is located, and the most trials."""

SAME_CURVE = 2e-3
"""Largest distance of the first point from a boundary that closes on itself."""

NEAR, SAME_PLACE = 0.05, 1e-6
"""Distance from a boundary up to which a point is compared, and that of the same point."""

GRAZES = 1e-3
"""Distance of a gap from a flank, in half clearances, at which a boundary ends at a grazing."""

HALF_RETURN = 1e-2
"""Half-period return distance below which a boundary ends in orbits of half the period."""

TESTS = {
    FOLD: (CUSP, STRONG_RESONANCE_11, FOLD_FLIP, FOLD_NEIMARK_SACKER),
    PERIOD_DOUBLING: (STRONG_RESONANCE_12, FOLD_FLIP, FLIP_NEIMARK_SACKER),
    NEIMARK_SACKER: (*RESONANCES, *WEAKER_RESONANCES),
    GRAZING: (GRAZING_FOLD, GRAZING_FLIP, GRAZING_NEIMARK_SACKER),
}
"""Kinds of points of codimension 2 that are looked for on each kind of boundary."""

FLAT = 1e-3
"""Largest distance of a boundary from the line between two points, in shares of both ranges."""

STEEP = 0.2
"""Least component of a tangent by a parameter that stays fixed while a point is corrected."""

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

    def holds(self, start: OnBoundary) -> bool:
        """Return whether a point of the same kind, period and flank lies on the boundary."""
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
            found = self.equations.corrected(guess, direction, reference)
            if found is not None and np.linalg.norm(found.place - place) < SAME_PLACE:
                return True
        return False

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
            curve = _cubic(one, other, parts)
            distances = np.linalg.norm(curve - place, axis=1)
            at = int(np.argmin(distances))
            if distances[at] < best:
                tangent = one.tangent + parts[at] * (other.tangent - one.tangent)
                best, found = float(distances[at]), (curve[at], tangent, one.reference)
        if found is None:
            return None
        return found[0], found[1] / np.linalg.norm(found[1]), found[2]


def _cubic(one: OnBoundary, other: OnBoundary, share: Floats) -> Floats:
    """Return the cubic through two points and their tangents at shares of the way, (shares, n)."""
    length = np.linalg.norm(other.place - one.place)
    t = share[:, np.newaxis]
    return np.asarray(
        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * one.place
        + t**2 * (3.0 - 2.0 * t) * other.place
        + length * t * (1.0 - t) * ((1.0 - t) * one.tangent - t * other.tangent)
    )


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


def trace_boundary(equations: Equations, start: OnBoundary) -> TracedBoundary:
    """Follow a boundary from one of its points in both directions, within both ranges.

    Parameters
    ----------
    equations : Equations
        Its equations.
    start : OnBoundary
        One of its points.

    Returns
    -------
    TracedBoundary
        The boundary with its points of codimension 2.
    """
    ahead, last = _half(equations, start)
    behind, first = [start], last
    if last != CLOSED_CURVE:
        behind, first = _half(equations, _turned(start))
    points = [_turned(one) for one in behind[:0:-1]] + ahead
    joined, located = points[:1], []
    for one, other in pairwise(_flattened(equations, points)):
        for kind, point in _located_between(equations, one, other):
            located.append(Located(kind, len(joined), point))
            joined.append(point)
        joined.append(other)
    ends = [first, last]
    joined, located = _cut(joined, located, ends)
    places = np.array([one.place for one in joined])
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    positions = np.concatenate([[0.0], np.cumsum(lengths)])
    return TracedBoundary(equations, joined, places, positions, located, (ends[0], ends[1]))


def _flattened(equations: Equations, points: list[OnBoundary]) -> list[OnBoundary]:
    """Add points where lines between successive ones would lie beside the curve."""
    waiting, found = points[:0:-1], points[:1]
    while waiting:
        one, other = found[-1], waiting[-1]
        chord = other.place - one.place
        length = float(np.linalg.norm(chord))
        middle = _cubic(one, other, np.array([0.5]))[0]
        aside = np.linalg.norm((middle - (one.place + other.place) / 2.0)[-PARAMETERS:])
        if aside > FLAT and length > FIRST_STEP:
            direction = _fixed(equations, chord / length)
            between = equations.corrected(middle, direction, one.reference)
            if between is not None and np.linalg.norm(between.place - middle) < length / 2.0:
                onward = np.sign(between.tangent @ chord) or 1.0
                waiting.append(between._replace(tangent=onward * between.tangent))
                continue
        found.append(waiting.pop())
    return found


def _turned(point: OnBoundary) -> OnBoundary:
    """Return a point with the opposite tangent."""
    return point._replace(tangent=-point.tangent)


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


def _half(equations: Equations, start: OnBoundary) -> tuple[list[OnBoundary], str]:
    """Follow a boundary in the direction of a tangent; return its points and why it ends."""
    points, step, bend = [start], FIRST_STEP, np.zeros_like(start.place)
    while len(points) < MOST_POINTS:
        here = points[-1]
        trial, leaves = _next(equations, here, step, bend)
        if trial is None or trial.tangent @ here.tangent < SMOOTH:
            step /= 2.0
            if step < SHORTEST:
                return points, _why_lost(equations, here)
            continue
        if here.halfway.size and here.halfway @ trial.halfway <= 0.0:
            if np.max(np.abs(here.halfway)) < HALF_RETURN:
                return points, HALVING
            step /= 2.0
            continue
        length = float(np.linalg.norm(trial.place - here.place))
        points += [trial] if length > 0.0 else []
        if leaves:
            return points, EDGE
        if _ends_in_resonance(points):
            # The curve continues as one of neutral saddles, which is no boundary.
            onward = trial.reference.cosine > 0.0
            return points, STRONG_RESONANCE_11 if onward else STRONG_RESONANCE_12
        bend = (trial.tangent - here.tangent) / length
        if len(points) > 3 and _meets(here, trial, start):
            return [*points[:-1], start._replace(tangent=trial.tangent)], CLOSED_CURVE
        turn = float(np.arccos(min(float(trial.tangent @ here.tangent), 1.0)))
        step = min(length * min(max(TURN / max(turn, 1e-9), 0.5), 2.0), LONGEST)
    return points, TOO_MANY


def _why_lost(equations: Equations, here: OnBoundary) -> str:
    """Return why no further point is found."""
    if here.halfway.size and np.max(np.abs(here.halfway)) < HALF_RETURN:
        return HALVING
    if equations.kind == GRAZING:
        return NO_EXTREME
    # The test function has no derivative where a further flank grazes.
    return CORNER if equations.nearest_flank(here.place) < GRAZES else LOST


def _ends_in_resonance(points: list[OnBoundary]) -> bool:
    """Whether the pair of a Neimark-Sacker curve has been real at the last two points."""
    return len(points) > 2 and all(abs(one.reference.cosine) > 1.0 + 1e-9 for one in points[-2:])


def _next(
    equations: Equations, here: OnBoundary, step: float, bend: Floats
) -> tuple[OnBoundary | None, bool]:
    """Return the next point of a boundary, or None, and whether it lies at an edge."""
    guess = here.place + step * here.tangent + 0.5 * step**2 * bend
    outside = (guess < 0.0) | (guess > 1.0)
    outside[:-PARAMETERS] = False
    if not outside.any():
        trial = equations.corrected(guess, _fixed(equations, here.tangent), here.reference)
        if trial is None or np.linalg.norm(trial.place - guess) > ASIDE * step:
            return None, False
        if np.all((trial.shares >= 0.0) & (trial.shares <= 1.0)):
            return trial, False
        outside = (trial.place < 0.0) | (trial.place > 1.0)
        outside[:-PARAMETERS] = False
        guess = trial.place
    return _at_edge(equations, here, guess, step, outside), True


def _fixed(equations: Equations, tangent: Floats) -> Floats:
    """Return the direction normal to which a point is corrected.

    Where flow maps depend on one of the parameters, this parameter stays fixed if the curve is not
    nearly normal to it: each further value would need maps of its own.
    """
    direction, number = tangent, equations.fixed
    if number >= 0 and abs(tangent[number - PARAMETERS]) > STEEP:
        direction = np.zeros_like(tangent)
        direction[number - PARAMETERS] = np.sign(tangent[number - PARAMETERS])
    return direction


def _at_edge(
    equations: Equations, here: OnBoundary, beyond: Floats, step: float, outside: Mask
) -> OnBoundary | None:
    """Return the point at the edge of the range between a point and a place beyond."""
    chord = beyond - here.place
    edges = (beyond > 0.5).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(outside, (edges - here.place) / chord, np.inf)
    number = int(np.argmin(reach))
    guess = here.place + min(max(float(reach[number]), 0.0), 1.0) * chord
    guess[number] = edges[number]
    direction = np.zeros_like(guess)
    direction[number] = np.sign(chord[number]) or 1.0
    trial = equations.corrected(guess, direction, here.reference)
    if trial is None or np.linalg.norm(trial.place - here.place) > 2.0 * step:
        return None
    if np.any((trial.shares < -1e-12) | (trial.shares > 1.0 + 1e-12)):
        return None
    onward = np.sign(trial.tangent @ here.tangent) or 1.0
    return trial._replace(tangent=onward * trial.tangent)


def _meets(here: OnBoundary, trial: OnBoundary, start: OnBoundary) -> bool:
    """Whether the first point lies between two successive ones, in its direction."""
    chord, away = trial.place - here.place, start.place - here.place
    share = float(away @ chord) / float(chord @ chord)
    if not 0.0 <= share <= 1.0 or trial.tangent @ start.tangent < SMOOTH:
        return False
    near = _cubic(here, trial, np.linspace(0.0, 1.0, 101))
    return bool(np.min(np.linalg.norm(near - start.place, axis=1)) < SAME_CURVE)


def _tests(kind: str, point: OnBoundary, of: OnBoundary) -> dict[str, float]:
    """Return the functions that change their sign at points of codimension 2 of each kind.

    ``kind``: that of the boundary; ``of``: the point whose null vectors give the directions.
    """
    multipliers, found = point.multipliers, {}
    cosine = point.reference.cosine
    for name in TESTS[kind]:
        if name in (CUSP, STRONG_RESONANCE_11, STRONG_RESONANCE_12) and kind != NEIMARK_SACKER:
            found[name] = _null_test(name, point, of)
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


def _null_test(name: str, point: OnBoundary, of: OnBoundary) -> float:
    """Return the test of a cusp or of a double multiplier, from the null vectors."""
    left = point.reference.left * (np.sign(point.reference.left @ of.reference.left) or 1.0)
    if name == CUSP:
        # Both parameters move along the direction that the left null vector leaves.
        across = left @ point.slopes
        return float(point.tangent[-1] * across[0] - point.tangent[-2] * across[1])
    right = point.reference.right * (np.sign(point.reference.right @ of.reference.right) or 1.0)
    return float(left @ right)


def _located_between(
    equations: Equations, one: OnBoundary, other: OnBoundary
) -> list[tuple[str, OnBoundary]]:
    """Return kind and point of the points of codimension 2 between two points, in order."""
    before, after = (_tests(equations.kind, at, one) for at in (one, other))
    found = []
    for name, value in before.items():
        if value * after[name] >= 0.0:
            continue
        point = _located(equations, one, other, name)
        if point is None or (
            name in _WITH_PAIR and not _has_complex_pair(_others(equations.kind, point.multipliers))
        ):
            continue
        found.append((name, point))
    chord = other.place - one.place
    found.sort(key=lambda item: float((item[1].place - one.place) @ chord))
    return found


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
) -> OnBoundary | None:
    """Return the point between two points at which a test changes its sign (Illinois method)."""
    begin: OnBoundary = one
    nearest: OnBoundary | None = None
    low, high = (_tests(equations.kind, at, begin)[name] for at in (one, other))
    for number in range(MOST_TRIALS):
        chord = other.place - one.place
        length = float(np.linalg.norm(chord))
        if length <= LOCATED:
            break
        share = 0.5 if number % 4 == 3 else low / (low - high)
        share = min(max(share, 1e-3), 1.0 - 1e-3)
        middle = equations.corrected(one.place + share * chord, chord / length, one.reference)
        if middle is None:
            break
        nearest, value = middle, _tests(equations.kind, middle, begin)[name]
        if value == 0.0:
            break
        if (value > 0.0) == (low > 0.0):
            one, low, high = middle, value, high / 2.0
        else:
            other, high, low = middle, value, low / 2.0
    return nearest
