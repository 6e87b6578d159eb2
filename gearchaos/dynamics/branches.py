"""Whole branches of periodic orbits over a parameter, stable and unstable, and special points.

A branch is one curve of orbits of one period (`arclength`). It is followed in both directions,
around its folds and through losses of stability, until it leaves the range, closes on itself, or
meets the orbit of half its period. Special points are then located on it (`branch_specials`).
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem

from gearchaos.arrays import Floats
from gearchaos.dynamics.arclength import (
    FIRST_STEP,
    SHORTER,
    SHORTEST_STEP,
    Curve,
    CurvePoint,
    along_the_way,
    cubic,
    extended,
    meets_half,
    passes_half,
    stalls,
)
from gearchaos.dynamics.branch_specials import LOCATED, specials_between, with_pairs_parted
from gearchaos.dynamics.corners import beyond_corner
from gearchaos.dynamics.curve_defects import Finding, defects_of
from gearchaos.dynamics.side_by_side import run, together
from gearchaos.records.branch import (
    BRANCH_POINT,
    CLOSED_CURVE,
    EDGE,
    FOLD,
    GROWS,
    HALVING,
    IN_ERRORS,
    LOST,
    TOO_MANY,
)

LONGEST = 0.1
"""Longest step along a branch."""

SMOOTH = 0.97
"""Least cosine between tangents of successive points: lines through them look smooth."""

MOST_POINTS = 12000
"""Largest number of points computed along one direction of a branch."""

RATIO = 1.6
"""Ratio of the distances at which points ahead are predicted."""

FALL = 2.5
"""The same where points were not found, such as next to a grazing: steps shrink by orders there."""

ASIDE, ASIDE_BY_ERRORS = 0.2, 0.5
"""Largest share of a step by which a point may lie aside of its prediction, on another branch.

The second is for methods with an error: where a multiplier is near +1, the small errors of
derivatives turn the tangent by much.
"""

LEAST_REACH = 1e-6
"""Distance from its prediction at which a point is accepted however short the step.

Where the parameter changes flow maps, the tangent of a curve has large errors within `ONE_SIDED`
of a grazing. Where the steps of a method with an error begin to see a contact, its curve jumps.
"""

CALM = 0.5
"""Largest change of the sum of multipliers in a step, relative to 1 and the sum."""

CAUTION = 0.8
"""Share of the allowed bend and of the allowed change of multipliers that a step aims at."""

BULGE = 0.1
"""Largest distance of a branch from the chord between two of its points, relative to its length.

The branch bends by less than `SMOOTH` between them.
"""

UNDECIDED = 5e-3
"""Distance up to which an orbit is taken as one of a branch if the point abreast is not found.

Next to a branch point the equations are nearly singular.
"""

SAME_PLACE = 1e-7
"""Largest distance between two corrections of one point of a branch."""

STALLED = (200, 1e-3)
"""Number of successive points of a curve, and the distance that they must cover at least.

Where errors of a method fold a curve at the size of its jumps, it leads nowhere.
"""

FARTHEST, HARDLY_MOVES = 100.0, 1e-4
"""Least state, and largest component of a tangent by the parameter, of a branch that grows.

Next to a resonance that nothing limits, states grow beyond all bounds at one parameter.
"""

SIDEWAYS = 2e-3
"""Distance at which a doubled branch is entered, in the scales of the states."""

BEGINNING = 1e-5, 1e-4
"""Distance of a multiplier from 1 at the beginning of a branch up to which it may be rounding.

The second one is for curves along which every point has flow maps of its own. Next to a grazing, a
doubled branch may really fold while its halves hardly differ: multipliers then pass 1 quickly.
"""

NEARLY_HALF = 1e-4, 3e-4
"""Difference of both halves of an orbit at which its curve ends in orbits of half the period.

The second one is for curves along which every point has flow maps of its own: their derivatives by
the parameter are less accurate.
"""

HALVED = 0.3
"""Share of its largest value to which the difference of both halves of an orbit shrinks at least.

Else a curve that is lost has not come near to the orbit of half its period.
"""

AMPLITUDES = SIDEWAYS * np.array(
    [1.0, -1.0, 0.3, -0.3, 0.1, 0.03, 0.01, -0.01, 5e-3, -5e-3, 2e-3, 1e-3]
)
"""Distances at which a doubled branch is searched, one after the other.

Doubled branches of very unstable orbits bend so sharply that only short distances lead to them.
"""


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

    def holds(self, share: float, section: Floats, tolerance: float) -> Finding[bool]:
        """Search whether an orbit lies on the branch, whichever of its points the branch has.

        Parameters
        ----------
        share : float
            Share of the way at which the orbit lies.
        section : array, shape (period, states)
            All section points of the orbit.
        tolerance : float
            Largest distance, in the scales of the states.
        """
        for point in section / self.curve.scale:
            target = np.append(point, share)
            for at, distance in self._near(target, tolerance):
                if distance > tolerance:
                    # Between two of its points, the branch is not straight.
                    one, other = self.places[at : at + 2]
                    direction = (other - one) / np.linalg.norm(other - one)
                    found = yield from _abreast(self.curve, one, direction, target)
                    if found is not None:
                        distance = float(np.max(np.abs(found.place - target)))
                    elif distance <= UNDECIDED:
                        return True
                if distance <= tolerance:
                    return True
        return False

    def _near(self, target: Floats, tolerance: float) -> list[tuple[int, float]]:
        """Return the chords near which a place (states + 1,) may lie on the branch, nearest first.

        A chord has the number of its first point, and its distance from the place.
        """
        chords = np.diff(self.places, axis=0)
        squares = np.sum(chords**2, axis=1)
        from_first = target - self.places[:-1]
        along = np.sum(from_first * chords, axis=1)
        # A special point may coincide with a point of the branch.
        share = np.divide(along, squares, out=np.zeros_like(along), where=squares > 0.0)
        aside = from_first - np.clip(share, 0.0, 1.0)[:, np.newaxis] * chords
        distances = np.max(np.abs(aside), axis=1)
        (near,) = np.nonzero((distances <= tolerance + BULGE * np.sqrt(squares)) & (squares > 0.0))
        near = near[np.argsort(distances[near], kind="stable")]
        return [*zip(near.tolist(), distances[near].tolist(), strict=True)]


def _abreast(
    curve: Curve, guess: Floats, direction: Floats, target: Floats
) -> Finding[CurvePoint | None]:
    """Search the point of a curve in a plane through a target.

    ``guess``: a place (states + 1,) next to the curve, which is moved along a ``direction`` of
    length 1 into the plane.
    """
    normal = curve.plane(direction)
    guess = guess + float((target - guess) @ normal) / float(direction @ normal) * direction
    return (yield from curve.correcting(guess, direction, normal))


def trace(curve: Curve, start: CurvePoint, located: float = LOCATED) -> TracedBranch:
    """Return the branch of `tracing`."""
    return run(tracing(curve, start, located), defects_of)


def tracing(curve: Curve, start: CurvePoint, located: float = LOCATED) -> Finding[TracedBranch]:
    """Follow a branch from one of its points in both directions side by side.

    Parameters
    ----------
    curve : Curve
        The curve of the branch.
    start : CurvePoint
        A point of the curve within the range.
    located : float
        Length of the stretch of the branch in which a special point lies.

    Returns
    -------
    TracedBranch
        The branch with its special points.
    """
    starts = [start, start._replace(tangent=-start.tangent)]
    (ahead, last), (behind, first) = yield from together([_half(curve, one) for one in starts])
    # One direction is enough for a closed curve, where the other may have been lost or have passed
    # its beginning.
    if last == CLOSED_CURVE and (first != CLOSED_CURVE or len(ahead) <= len(behind)):
        behind, first = [start], last
    elif first == CLOSED_CURVE:
        ahead, last = [start], first
    points = [one._replace(tangent=-one.tangent) for one in behind[:0:-1]] + ahead
    return (yield from _with_specials(curve, points, (first, last), located))


def _with_specials(
    curve: Curve, points: list[CurvePoint], ends: tuple[str, str], located: float
) -> Finding[TracedBranch]:
    """Return the branch through points, with its special points located and among its points."""
    points = yield from with_pairs_parted(curve, points)
    located_between = yield from together(
        [specials_between(curve, one, other, located) for one, other in pairwise(points)]
    )
    for at in _beginnings(curve, points, ends):
        located_between[at] = [
            one for one in located_between[at] if one[0] not in (FOLD, BRANCH_POINT)
        ]
    found: list[tuple[int, tuple[str, CurvePoint, int]]] = []
    joined = points[:1]
    for other, between in zip(points[1:], located_between, strict=True):
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


def _beginnings(curve: Curve, points: Sequence[CurvePoint], ends: tuple[str, str]) -> set[int]:
    """Return the stretches next to an orbit of half the period in which folds may be errors.

    A branch turns back where it begins at a period doubling: rounding, or the errors of a method,
    then decide on which side a multiplier of 1 lies.
    """
    found = {
        at
        for at, stretch in enumerate(pairwise(points))
        if any(_begins(curve, one) for one in stretch)
    }
    if not curve.exact and len(points) > 1:
        lasting = zip((0, len(points) - 2), ends, strict=True)
        found |= {at for at, reason in lasting if reason == HALVING}
    return found


def _begins(curve: Curve, point: CurvePoint) -> bool:
    """Whether an orbit is that of half the period, up to what rounding makes of a multiplier."""
    from_one = float(np.min(np.abs(point.multipliers - 1.0)))
    return point.half_return < NEARLY_HALF[0] and from_one < BEGINNING[curve.own_maps]


def doubled_start(curve: Curve, doubling: CurvePoint) -> Finding[CurvePoint | None]:
    """Search the first point of the branch of twice the period that begins at a period doubling.

    The state moves along the eigenvector of the multiplier -1, by one of `AMPLITUDES`.

    Parameters
    ----------
    curve : Curve
        The curve with the period doubling.
    doubling : CurvePoint
        The period doubling.

    Returns
    -------
    CurvePoint or None
        The point of ``curve.doubled()``; None if it is not found.
    """
    values, vectors = np.linalg.eig((yield from curve.jacobian(doubling.place)))
    vector = vectors[:, np.argmin(np.abs(values + 1.0))].real
    direction = np.append(vector, 0.0) / np.linalg.norm(vector)
    # The plane does not meet the branch of the orbits themselves.
    normal = direction - (direction @ doubling.tangent) * doubling.tangent
    normal /= np.linalg.norm(normal)
    for amplitude in AMPLITUDES:
        guess = doubling.place + amplitude * direction
        start = yield from curve.doubled().correcting(guess, direction, normal)
        if start is not None and start.half_return >= SHORTER:
            return start
    return None


def _half(curve: Curve, start: CurvePoint) -> Finding[tuple[list[CurvePoint], str]]:
    """Follow a branch in the direction of a point's tangent; return its points and why it ends."""
    points, distances = [start], _distances(FIRST_STEP, curve.ahead)
    if (start.share <= 0.0 and not start.onward) or (start.share >= 1.0 and start.onward):
        return points, EDGE
    corner = 0
    near = NEARLY_HALF[curve.own_maps] if curve.exact else SIDEWAYS
    while len(points) < MOST_POINTS:
        here = points[-1]
        trials, leaves = yield from _next(curve, points[corner:][-2:], distances)
        taken = 0
        while (further := _joinable(points[-1], trials[taken:])) is not None:
            here, last, taken = points[-1], further[-1], taken + len(further)
            met = (yield from _met(curve, here, last, start)) if len(points) > 2 else None
            if met is not None:
                return [*points, *_before(met, further), met], CLOSED_CURVE
            points += further
        if (taken or corner) and stalls(points, STALLED):
            return points, _end_of(curve, points)
        if taken and _grows(points[-1]):
            return points, GROWS
        if leaves and taken == len(trials):
            return points, EDGE
        first = trials[0]
        if taken:
            # Far beyond the first that fails, hardly any is found.
            distances = _distances(_after(here, points[-1]), min(taken + 3, curve.ahead))
            continue
        if here.half_return < near and first is not None and meets_half(here, first):
            return points, HALVING
        longer = 0.5 if first is None else _boldness(here, first)
        distances = _shorter(float(distances[0]) * min(max(longer, 0.25), 0.8), curve.ahead)
        if distances[0] < SHORTEST_STEP:
            beyond = yield from _beyond_corner(curve, here)
            if beyond is None:
                return points, _end_of(curve, points)
            corner = len(points)
            points.append(beyond)
            distances = _distances(FIRST_STEP, curve.ahead)
    return points, TOO_MANY


def _beyond_corner(curve: Curve, here: CurvePoint) -> Finding[CurvePoint | None]:
    """Search a point beyond a corner of the curve."""

    def correcting(guess: Floats, normal: Floats, reach: float) -> Finding[CurvePoint | None]:
        return curve.correcting(guess, normal, reach=reach)

    def systems_at(shares: Floats) -> LaneSystem:
        return curve.systems_at(np.full(len(shares), curve.number), shares[:, 0])

    return (yield from beyond_corner(here, correcting, systems_at, curve.plan.steps_per_period))


def _end_of(curve: Curve, points: Sequence[CurvePoint]) -> str:
    """Return why a curve ends that is not found beyond its last point.

    Errors of a method bend or hide the last part of a curve that has nearly reached the orbit of
    half its period.
    """
    apart = [one.half_return for one in points]
    if apart[-1] < min(SIDEWAYS, HALVED * max(apart)):
        return HALVING
    return LOST if curve.exact else IN_ERRORS


def _grows(point: CurvePoint) -> bool:
    """Whether orbits grow beyond all others while the parameter hardly changes."""
    largest = float(np.max(np.abs(point.place[:-1])))
    return largest > FARTHEST and abs(float(point.tangent[-1])) < HARDLY_MOVES


def _distances(step: float, many: int) -> Floats:
    """Return the distances, (many,), at which points ahead are predicted: about a step, and more.

    The shortest is tried with the others, because a step may turn out to be too long.
    """
    first = -(many // 3)
    distances = step * RATIO ** np.arange(first, first + many)
    gaps = np.diff(distances, prepend=0.0)
    return np.asarray(np.cumsum(np.minimum(gaps, LONGEST)))


def _shorter(step: float, many: int) -> Floats:
    """Return the distances, (many,), that are tried after one was too long: a step, and less."""
    return np.asarray(step * FALL ** -np.arange(many - 1.0, -1.0, -1.0))


def _joinable(here: CurvePoint, trials: Sequence[CurvePoint | None]) -> list[CurvePoint] | None:
    """Return the next points of a curve that a point may be joined to, or None."""
    found: list[CurvePoint] = []
    for trial in trials:
        if trial is None or not _succeeds(here, trial) or passes_half(here, trial):
            break
        found.append(trial)
    return found or None


def _after(here: CurvePoint, trial: CurvePoint) -> float:
    """Return the next step after the one from a point to another."""
    length = float(np.linalg.norm(trial.place - here.place))
    longer = min(_boldness(here, trial), 2.0)
    return min(max(longer * length, min(length, FIRST_STEP)), LONGEST)


def _next(
    curve: Curve, last: Sequence[CurvePoint], distances: Floats
) -> Finding[tuple[list[CurvePoint | None], bool]]:
    """Search the next points of a curve, and whether the last of them is the end of the range.

    ``distances``: those at which points are predicted. A point is None if it is not found near its
    prediction.
    """
    here = last[-1]
    guesses, directions = extended(last, distances)
    inside = (guesses[:, -1] >= 0.0) & (guesses[:, -1] <= 1.0)
    within = distances.size if inside.all() else int(np.argmin(inside))
    aside = ASIDE if curve.exact else ASIDE_BY_ERRORS
    reaches = np.maximum(aside * np.diff(distances, prepend=0.0), LEAST_REACH)
    searches = [
        curve.correcting(guess, direction, curve.plane(here.tangent, direction), reach=reach)
        for guess, direction, reach in zip(
            guesses[:within], directions[:within], reaches[:within], strict=True
        )
    ]
    leaves = within < distances.size
    if leaves:
        searches.append(_at_edge(curve, here, guesses[within], distances[within]))
    trials = yield from together(searches)
    outside = [one is not None and not 0.0 <= one.share <= 1.0 for one in trials]
    if not any(outside):
        return trials, leaves
    number = outside.index(True)
    beyond = trials[number]
    assert beyond is not None
    edge = yield from _at_edge(curve, here, beyond.place, distances[number])
    return [*trials[:number], edge], True


def _at_edge(
    curve: Curve, here: CurvePoint, beyond: Floats, step: float
) -> Finding[CurvePoint | None]:
    """Search the point at the edge of the range between a point and a place beyond."""
    edge = float(beyond[-1] > 0.5)
    reach = (edge - here.share) / here.tangent[-1] if here.tangent[-1] else np.inf
    guess = here.place + min(max(reach, 0.0), step) * here.tangent
    guess[-1] = edge
    trial = yield from curve.correcting(guess, along_the_way(guess.size - 1))
    if trial is None or np.linalg.norm(trial.place - here.place) > 2.0 * step:
        return None
    # The tangent of a point at the edge has the direction of the parameter.
    onward = np.sign(trial.tangent @ here.tangent) or 1.0
    return trial._replace(tangent=onward * trial.tangent)


def _succeeds(here: CurvePoint, trial: CurvePoint) -> bool:
    """Whether a point may be the next one: the curve is straight, the multipliers change little."""
    length = np.linalg.norm(trial.place - here.place)
    if not 0.0 < length <= 2.0 * LONGEST or trial.tangent @ here.tangent < SMOOTH:
        return False
    return bool(_change(here, trial) <= CALM or length <= FIRST_STEP)


def _change(here: CurvePoint, trial: CurvePoint) -> float:
    """Return the change of the sum of multipliers between two points, relative to 1 and the sum."""
    before, after = (float(np.sum(one.multipliers).real) for one in (here, trial))
    return abs(after - before) / (1.0 + abs(before))


def _boldness(here: CurvePoint, trial: CurvePoint) -> float:
    """Return how many times longer a step may be than the one from a point to another.

    The angle between the tangents and the change of the multipliers grow with the step.
    """
    angle = np.arccos(np.clip(trial.tangent @ here.tangent, -1.0, 1.0))
    used = max(angle / np.arccos(SMOOTH), _change(here, trial) / CALM)
    return float(CAUTION / used) if used > 0.0 else np.inf


def _before(end: CurvePoint, points: Sequence[CurvePoint]) -> list[CurvePoint]:
    """Return the points of a curve that lie before one near them."""
    return [one for one in points if (end.place - one.place) @ end.tangent > SAME_PLACE]


def _met(
    curve: Curve, here: CurvePoint, trial: CurvePoint, start: CurvePoint
) -> Finding[CurvePoint | None]:
    """Search the first orbit of a branch between two others, in their direction; None without it.

    A curve of a longer period may come back to this orbit at another of its section points.
    """
    if trial.tangent[-1] * start.tangent[-1] <= 0.0:
        return None
    chord = trial.place - here.place
    length = float(np.linalg.norm(chord))
    for point in start.section / curve.scale:
        target = np.append(point, start.share)
        along = float((target - here.place) @ chord) / length
        aside = np.linalg.norm(target - here.place - along / length * chord)
        if 0.0 <= along <= length and aside <= BULGE * length:
            (guess,) = cubic(here, trial, np.array([along / length]))
            found = yield from _abreast(curve, guess, chord / length, target)
            if found is not None and np.max(np.abs(found.place - target)) < SAME_PLACE:
                return found
    return None
