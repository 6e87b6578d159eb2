"""Whole branches of periodic orbits over a parameter, stable and unstable, and special points.

A branch is one curve of orbits of one period (`arclength`). It is followed in both directions,
around its folds and through losses of stability, until it leaves the range, closes on itself, or
meets the orbit of half its period. Where a test function changes its sign between two points of a
branch, there is a special point between them, which is then located on the curve:

- fold: the parameter turns back;
- branch point: a real multiplier passes +1 without a fold;
- period doubling: a real multiplier passes -1;
- Neimark-Sacker: a complex pair passes the unit circle;
- grazing: an element begins or ceases to meet a flank.
"""

from collections.abc import Callable
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.arclength import (
    FIRST_STEP,
    SHORTEST_STEP,
    STRAIGHT,
    Curve,
    CurvePoint,
    along_the_way,
)
from gearchaos.records.branch import (
    BRANCH_POINT,
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

LONGEST = 0.1
"""Longest step along a branch."""

SMOOTH = 0.97
"""Least cosine between tangents of successive points: lines through them look smooth."""

MOST_POINTS = 4000
"""Largest number of points computed along one direction of a branch."""

LOCATED = 1e-11
"""Largest length of the stretch of a curve in which a special point lies."""

MOST_TRIALS = 80
"""Largest number of points with which a special point is located."""

ASIDE = 0.1
"""Largest share of a step by which a point may lie aside of its prediction, on another branch."""

CALM = 0.5
"""Largest change of the sum of multipliers in a step, relative to 1 and the sum."""

NEIGHBOURING = 0.2
"""Distance from a branch below which an orbit is compared with the branch more closely."""

MARGIN = 1e-4
"""Share of the way by which an orbit may lie outside a stretch of a branch, next to a fold."""

UNDECIDED = 5e-3
"""Distance up to which an orbit is taken as one of a branch if none is found at its share.

Next to a fold or a period doubling the equations are nearly singular.
"""

SAME_PLACE = 1e-7
"""Largest distance between two corrections of one point of a branch."""

SIDEWAYS = 2e-3
"""Distance at which a doubled branch is entered, in the scales of the states."""


class Special(NamedTuple):
    """A special point of a branch.

    Attributes
    ----------
    kind : str
        One of `SPECIAL_KINDS`.
    point : CurvePoint
        The point of the curve.
    flank : int
        For a grazing, number of the flank in ``CurvePoint.impacts``; otherwise -1.
    position : float
        Arclength at which it lies on the branch.
    """

    kind: str
    point: CurvePoint
    flank: int
    position: float


class TracedBranch(NamedTuple):
    """A branch of periodic orbits.

    Attributes
    ----------
    curve : Curve
        The curve on which it lies.
    points : list of CurvePoint
        Its points in the order of the curve.
    places : array, shape (points, states + 1)
        Their places, one row each.
    positions : array, shape (points,)
        Arclength of each point.
    specials : list of Special
        Its special points in the order of the curve.
    ends : tuple of str
        Why it ends at its first and at its last point.
    """

    curve: Curve
    points: list[CurvePoint]
    places: Floats
    positions: Floats
    specials: list[Special]
    ends: tuple[str, str]

    @property
    def period(self) -> int:
        """Period in excitation periods."""
        return self.curve.periods

    def holds(self, share: float, section: Floats, tolerance: float) -> bool:
        """Return whether an orbit lies on the branch, whichever of its points the branch has.

        Parameters
        ----------
        share : float
            Share of the way at which the orbit lies.
        section : array, shape (period, states)
            All section points of the orbit.
        tolerance : float
            Largest distance, in the scales of the states.
        """
        shares = self.places[:, -1]
        one, other = shares[:-1], shares[1:]
        low, high = np.minimum(one, other) - MARGIN, np.maximum(one, other) + MARGIN
        (across,) = np.nonzero((low <= share) & (share <= high))
        run = other[across] - one[across]
        part = np.divide(share - one[across], run, out=np.zeros(across.size), where=run != 0.0)
        part = np.clip(part, 0.0, 1.0)
        between = self.places[across] + part[:, np.newaxis] * np.diff(self.places, axis=0)[across]
        scaled = section / self.curve.scale
        for guess in between:
            distance = _distance(scaled, guess)
            if tolerance < distance <= NEIGHBOURING:
                # Between two of its points, the branch is not straight.
                guess[-1] = share
                found = self.curve.corrected(guess, along_the_way(guess.size - 1))
                if found is not None:
                    distance = _distance(scaled, found.place)
                elif distance <= UNDECIDED:
                    return True
            if distance <= tolerance:
                return True
        return False


def _distance(section: Floats, place: Floats) -> float:
    """Return the distance of a place (states + 1,) from the nearest point of a scaled section."""
    return float(np.min(np.max(np.abs(section - place[:-1]), axis=1)))


def trace(
    curve: Curve, start: CurvePoint, one_way: bool = False, located: float = LOCATED
) -> TracedBranch:
    """Follow a branch from one of its points in both directions.

    Parameters
    ----------
    curve : Curve
        The curve of the branch.
    start : CurvePoint
        A point of the curve within the range.
    one_way : bool
        Whether the branch begins at this point, and is followed along its tangent only.
    located : float
        Length of the stretch of the branch in which a special point lies.

    Returns
    -------
    TracedBranch
        The branch with its special points.
    """
    ahead, last = _half(curve, start)
    behind, first = [start], "" if not one_way else HALVING
    if not one_way and last != CLOSED_CURVE:
        behind, first = _half(curve, start._replace(tangent=-start.tangent))
    points = [one._replace(tangent=-one.tangent) for one in behind[:0:-1]] + ahead
    ends = (last, last) if last == CLOSED_CURVE else (first, last)
    return _with_specials(curve, points, ends, located)


def _with_specials(
    curve: Curve, points: list[CurvePoint], ends: tuple[str, str], located: float
) -> TracedBranch:
    """Return the branch through points, with its special points located and among its points."""
    found: list[tuple[int, tuple[str, CurvePoint, int]]] = []
    joined = points[:1]
    for one, other in pairwise(points):
        chord = other.place - one.place
        between = _specials_between(curve, one, other, located)
        between.sort(key=lambda special: float((special[1].place - one.place) @ chord))
        for special in between:
            found.append((len(joined), special))
            joined.append(special[1])
        joined.append(other)
    places = np.array([one.place for one in joined])
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    positions = np.concatenate([[0.0], np.cumsum(lengths)])
    specials = [
        Special(kind, point, flank, float(positions[at])) for at, (kind, point, flank) in found
    ]
    return TracedBranch(curve, joined, places, positions, specials, ends)


def doubled_start(curve: Curve, doubling: CurvePoint) -> CurvePoint | None:
    """Return the first point of the branch of twice the period that begins at a period doubling.

    The state moves along the eigenvector of the multiplier -1, by `SIDEWAYS`.

    Parameters
    ----------
    curve : Curve
        The curve with the period doubling.
    doubling : CurvePoint
        The period doubling.

    Returns
    -------
    CurvePoint or None
        The point of ``curve.doubled()``, with the tangent away from the doubling; None if it is not
        found.
    """
    values, vectors = np.linalg.eig(curve.jacobian(doubling.place))
    vector = vectors[:, np.argmin(np.abs(values + 1.0))].real
    direction = np.append(vector, 0.0) / np.linalg.norm(vector)
    return curve.doubled().corrected(doubling.place + SIDEWAYS * direction, direction)


def _half(curve: Curve, start: CurvePoint) -> tuple[list[CurvePoint], str]:
    """Follow a branch in the direction of a point's tangent; return its points and why it ends."""
    points, step, bend = [start], FIRST_STEP, np.zeros_like(start.place)
    while len(points) < MOST_POINTS:
        here = points[-1]
        trial, leaves = _next(curve, here, step, bend)
        if trial is None or not _succeeds(here, trial, step):
            step /= 2.0
            if step < SHORTEST_STEP:
                return points, LOST
            continue
        if _passes_half(here, trial):
            if here.half_return < SIDEWAYS:
                return points, HALVING
            step /= 2.0
            continue
        length = np.linalg.norm(trial.place - here.place)
        points += [trial] if length > 0.0 else []
        if leaves:
            return points, EDGE
        bend = (trial.tangent - here.tangent) / length
        if len(points) > 3 and _meets(curve, here, trial, start):
            return points, CLOSED_CURVE
        step = min(2.0 * step, LONGEST)
    return points, TOO_MANY


def _next(
    curve: Curve, here: CurvePoint, step: float, bend: Floats
) -> tuple[CurvePoint | None, bool]:
    """Return the next point of a curve, or None, and whether it is the edge of the range.

    ``bend`` (states + 1,): derivative of the tangent by the arclength.
    """
    guess = here.place + step * here.tangent + 0.5 * step**2 * bend
    if 0.0 <= guess[-1] <= 1.0:
        trial = curve.corrected(guess, here.tangent)
        if trial is None or np.linalg.norm(trial.place - guess) > ASIDE * step:
            return None, False
        if 0.0 <= trial.share <= 1.0:
            return trial, False
    edge = float(guess[-1] > 0.5)
    reach = (edge - here.share) / here.tangent[-1] if here.tangent[-1] else np.inf
    guess = here.place + min(max(reach, 0.0), step) * here.tangent
    guess[-1] = edge
    trial = curve.corrected(guess, along_the_way(guess.size - 1))
    if trial is None or np.linalg.norm(trial.place - here.place) > 2.0 * step:
        return None, True
    # The tangent of a point at the edge has the direction of the parameter.
    onward = np.sign(trial.tangent @ here.tangent) or 1.0
    return trial._replace(tangent=onward * trial.tangent), True


def _succeeds(here: CurvePoint, trial: CurvePoint, step: float) -> bool:
    """Whether a point may be the next one: the curve is straight, the multipliers change little."""
    before, after = (float(np.sum(one.multipliers).real) for one in (here, trial))
    calm = abs(after - before) <= CALM * (1.0 + abs(before))
    return bool(trial.tangent @ here.tangent >= SMOOTH and (calm or step <= FIRST_STEP))


def _passes_half(here: CurvePoint, trial: CurvePoint) -> bool:
    """Whether the orbit of half the period lies between two points: beyond it, phases swap."""
    return bool(here.halfway.size and here.halfway @ trial.halfway <= 0.0)


def _meets(curve: Curve, here: CurvePoint, trial: CurvePoint, start: CurvePoint) -> bool:
    """Whether the first point of a branch lies between two successive ones, in its direction."""
    chord, away = trial.place - here.place, start.place - here.place
    share = float(away @ chord) / float(chord @ chord)
    aside = np.linalg.norm(away - share * chord)
    if not 0.0 <= share <= 1.0 or aside > NEIGHBOURING or trial.tangent @ start.tangent < STRAIGHT:
        return False
    guess = here.place + share * chord
    guess = guess - ((guess - start.place) @ start.tangent) * start.tangent
    found = curve.corrected(guess, start.tangent)
    return found is not None and bool(np.max(np.abs(found.place - start.place)) < SAME_PLACE)


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


def _specials_between(
    curve: Curve, one: CurvePoint, other: CurvePoint, located: float
) -> list[tuple[str, CurvePoint, int]]:
    """Return kind, point and flank of the special points between two points of a curve."""
    before, after = _test_functions(one), _test_functions(other)
    found = []
    for kind in before:
        if before[kind] * after[kind] >= 0.0:
            continue
        if kind == BRANCH_POINT and before[FOLD] * after[FOLD] < 0.0:
            # A multiplier passes +1 at every fold.
            continue

        def test_function(at: CurvePoint, kind: str = kind) -> float:
            return _test_functions(at)[kind]

        point = _located(curve, one, other, test_function, located)
        if point is not None and (kind != NEIMARK_SACKER or _has_pair_on_circle(point.multipliers)):
            found.append((kind, point, -1))
    found += [(GRAZING, *graze) for graze in _grazings(curve, one, other, located)]
    return found


def _has_pair_on_circle(multipliers: Complex) -> bool:
    """Whether the pair of multipliers whose product is nearest to 1 is complex, not real."""
    pairs = list(combinations(multipliers.tolist(), 2))
    nearest = min(pairs, key=lambda pair: abs(pair[0] * pair[1] - 1.0))
    return bool(nearest[0].imag != 0.0)


def _grazings(
    curve: Curve, one: CurvePoint, other: CurvePoint, located: float
) -> list[tuple[CurvePoint, int]]:
    """Return the points between two points at which impacts appear or vanish, with their flanks."""
    found: list[tuple[CurvePoint, int]] = []
    for flank, (before, after) in enumerate(zip(one.impacts, other.impacts, strict=True)):
        if before == after:
            continue

        def changed(at: CurvePoint, flank: int = flank, before: int = before) -> float:
            return 1.0 if at.impacts[flank] == before else -1.0

        point = _located(curve, one, other, changed, located)
        if point is not None:
            found.append((point, flank))
    return found


def _located(
    curve: Curve,
    one: CurvePoint,
    other: CurvePoint,
    function: Callable[[CurvePoint], float],
    located: float,
) -> CurvePoint | None:
    """Return the point between two points of a curve at which a function changes its sign.

    The method of false position with halved values (Illinois), or bisection where the function only
    has a sign. None if a point between them is not found.
    """
    low, high = function(one), function(other)
    nearest = one
    for number in range(MOST_TRIALS):
        chord = other.place - one.place
        length = float(np.linalg.norm(chord))
        if length <= located:
            break
        share = 0.5 if number % 3 == 2 or abs(low) == abs(high) else low / (low - high)
        share = min(max(share, 1e-3), 1.0 - 1e-3)
        middle = curve.corrected(one.place + share * chord, chord / length)
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
