"""Points of boundaries over two parameters, followed from many starts side by side.

Every start is followed in both directions. Where two halves meet, they are parts of one boundary.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats, Mask
from gearchaos.dynamics.arclength import (
    cubic,
    extended,
    meets_half,
    passes_half,
    repeats_sooner,
    stalls,
)
from gearchaos.dynamics.boundary_equations import Equations, OnBoundary
from gearchaos.dynamics.boundary_passages import PARAMETERS, Following
from gearchaos.dynamics.corners import beyond_corner
from gearchaos.dynamics.side_by_side import together
from gearchaos.records.boundary import (
    CORNER,
    NO_EXTREME,
    SHORT_STEPS,
    STRONG_RESONANCE_11,
    STRONG_RESONANCE_12,
)
from gearchaos.records.branch import CLOSED_CURVE, EDGE, GRAZING, HALVING, LOST, TOO_MANY

START_STEP, SHORT_STEP, LONGEST, SHORTEST = 0.04, 5e-3, 0.25, 1e-7
"""Lengths of steps along a boundary: states in their scales, parameters in shares of ranges."""

SIDE_BY_SIDE, MOST_AHEAD = 16, 2
"""About how many points are searched side by side, and the most ahead of one point."""

SMOOTH, TURN = 0.9, 0.3
"""Least cosine between tangents of successive points, and the angle in rad that steps aim at."""

BEND = 0.07
"""Largest difference between the direction from one point to the next and their mean tangent.

On an arc both are equal. A step to another curve nearby, with about the same tangent, is refused.
"""

ASIDE = 0.3
"""Largest share of a step by which a point may lie aside of its prediction."""

MOST_POINTS = 1000
"""Largest number of points computed along one direction of a boundary."""

STALLED = (40, 1e-3)
"""Number of successive points of a boundary, and the distance that they must cover at least.

Next to a grazing, steps may become so short that the boundary leads nowhere.
"""

SAME_CURVE, SAME_PLACE = 2e-3, 1e-6
"""Largest distance of halves that meet, relative to a step if that is longer, and of one start."""

GRAZES = 1e-3
"""Distance of a gap from a flank, in half clearances, at which a boundary ends at a grazing."""

HALF_RETURN = 1e-2
"""Half-period return distance below which a boundary ends in orbits of half the period."""

STEEP = 0.03
"""Least component of a tangent by a parameter that stays fixed while a point is corrected."""


class Path(NamedTuple):
    """Points of a boundary in the order of the curve, and why it ends at its first and its last."""

    points: list[OnBoundary]
    ends: tuple[str, str]


class _Half:
    """The points of a boundary on one side of a start.

    ``other``: the half on the other side; ``met``: the half that it has met; ``end``: why it ends.
    """

    def __init__(self, start: OnBoundary) -> None:
        self.points = [start]
        self.end = ""
        self.other: _Half = self
        self.met: _Half | None = None


def following(equations: Equations, starts: Sequence[OnBoundary]) -> Following[list[Path]]:
    """Follow boundaries from some of their points in both directions, within both ranges."""
    halves: list[_Half] = []
    for start in starts:
        if any(np.linalg.norm(one.points[0].place - start.place) < SAME_PLACE for one in halves):
            continue
        pair = _Half(start), _Half(_turned(start))
        pair[0].other, pair[1].other = pair[1], pair[0]
        halves += pair
    yield from together([_advance(equations, one, halves) for one in halves])
    return _paths(halves)


def _paths(halves: list[_Half]) -> list[Path]:
    """Join the halves that have met."""
    paths, joined = [], set[int]()
    for start in halves:
        if id(start) in joined:
            continue
        first = start
        while first.met is not None and first.met.other is not start:
            first = first.met.other
        closed = first.met is not None
        points: list[OnBoundary] = []
        half: _Half | None = first
        while half is not None and id(half) not in joined:
            joined.update((id(half), id(half.other)))
            points += [_turned(one) for one in half.points[:0:-1]] + half.other.points
            last, half = half.other, half.other.met
        ends = (CLOSED_CURVE, CLOSED_CURVE) if closed else (first.end, last.end)
        paths.append(Path(points + points[:1] if closed else points, ends))
    return paths


def _turned(point: OnBoundary) -> OnBoundary:
    """Return a point with the opposite tangent."""
    return point._replace(tangent=-point.tangent)


def _advance(equations: Equations, half: _Half, halves: list[_Half]) -> Following[None]:
    """Follow a half up to its end, or until it meets another one."""
    points, step, corner = half.points, START_STEP, 0
    while not half.end and half.met is None:
        going = sum(not one.end and one.met is None for one in halves)
        many = min(max(SIDE_BY_SIDE // going, 1), MOST_AHEAD)
        distances = step * np.arange(1.0, many + 1.0)
        trials, leaves = yield from _next(equations, points[corner:], distances)
        if half.met is not None:
            return
        before = len(points)
        for number, trial in enumerate(trials):
            at_edge = leaves and number == len(trials) - 1
            longer = _joined(equations, half, halves, trial, at_edge)
            if longer is None:
                break
            step = min(longer, LONGEST)
            if half.end or half.met is not None:
                return
        if not half.end and stalls(points, STALLED):
            half.end = HALVING if _nearly_half(points[-1]) else SHORT_STEPS
        elif len(points) == before:
            here, step = points[-1], step / 2.0
            if _nearly_half(here) and trials[0] is not None and meets_half(here, trials[0]):
                half.end = HALVING
            elif step < SHORTEST:
                beyond = yield from _beyond_corner(equations, here)
                if beyond is None:
                    half.end = _why_lost(equations, here)
                else:
                    corner, step = len(points), START_STEP
                    points.append(beyond)


def _joined(
    equations: Equations, half: _Half, halves: list[_Half], trial: OnBoundary | None, at_edge: bool
) -> float | None:
    """Join a point to a half unless another half is met before it; return the next step.

    None if the point does not continue the half.
    """
    points, here = half.points, half.points[-1]
    if trial is None or trial.tangent @ here.tangent < SMOOTH or passes_half(here, trial):
        return None
    if repeats_sooner(trial.section, equations.scale):
        return None
    length = float(np.linalg.norm(trial.place - here.place))
    if at_edge and length < SAME_PLACE:
        # A start at the edge is found again; the half on its other side must not meet it.
        half.end = EDGE
        return 0.0
    if _bends(here, trial):
        return None
    met = _met(here, trial, half, halves)
    if met is not None:
        half.met, met.met, met.end = met, half, ""
        return 0.0
    points.append(trial)
    half.end = EDGE if at_edge else _end_at(points)
    turn = float(np.arccos(min(float(trial.tangent @ here.tangent), 1.0)))
    return length * min(max(TURN / max(turn, 1e-9), 0.5), 2.0)


def _bends(here: OnBoundary, trial: OnBoundary) -> bool:
    """Whether two points are no neighbours on one smooth curve."""
    chord, mean = trial.place - here.place, trial.tangent + here.tangent
    lengths = np.linalg.norm(chord), np.linalg.norm(mean)
    if not min(lengths) > 0.0:
        return True
    return bool(np.linalg.norm(chord / lengths[0] - mean / lengths[1]) > BEND)


def _nearly_half(here: OnBoundary) -> bool:
    """Whether an orbit nearly coincides with one of half the period."""
    return bool(here.halfway.size and np.max(np.abs(here.halfway)) < HALF_RETURN)


def _end_at(points: list[OnBoundary]) -> str:
    """Return why a half ends at its last point, empty if it continues."""
    if len(points) > 2 and all(abs(one.reference.cosine) > 1.0 + 1e-9 for one in points[-2:]):
        # The curve continues as one of neutral saddles, which is no boundary.
        onward = points[-1].reference.cosine > 0.0
        return STRONG_RESONANCE_11 if onward else STRONG_RESONANCE_12
    return TOO_MANY if len(points) >= MOST_POINTS else ""


def _met(here: OnBoundary, trial: OnBoundary, half: _Half, halves: list[_Half]) -> _Half | None:
    """Return the half whose last point lies between two points and that comes from ahead."""
    chord = trial.place - here.place
    square = float(chord @ chord)
    others = [one for one in halves if one is not half and one.met is None]
    if not others or square == 0.0:
        return None
    away = np.array([one.points[-1].place for one in others]) - here.place
    facing = np.array([one.points[-1].tangent for one in others]) @ trial.tangent <= -SMOOTH
    along = away @ chord / square
    aside = np.linalg.norm(away - along[:, np.newaxis] * chord, axis=1)
    (near,) = np.nonzero(
        facing & (along > 0.0) & (along <= 1.0) & (aside <= ASIDE * np.sqrt(square))
    )
    for at in near[np.argsort(along[near], kind="stable")].tolist():
        ahead: _Half = others[at]
        target = ahead.points[-1].place
        curve = cubic(here, trial, np.linspace(0.0, 1.0, 101))
        if np.min(np.linalg.norm(curve - target, axis=1)) < SAME_CURVE + 0.02 * np.sqrt(square):
            return ahead
    return None


def _beyond_corner(equations: Equations, here: OnBoundary) -> Following[OnBoundary | None]:
    """Search a point beyond a corner of the boundary."""

    def correcting(guess: Floats, normal: Floats, reach: float) -> Following[OnBoundary | None]:
        return equations.correcting(guess, normal, here.reference, reach=reach)

    steps = equations.plan.steps_per_period
    return (yield from beyond_corner(here, correcting, equations.system_at, steps))


def _why_lost(equations: Equations, here: OnBoundary) -> str:
    """Return why no further point is found."""
    if _nearly_half(here):
        return HALVING
    if equations.kind == GRAZING:
        return NO_EXTREME
    # The test function has no derivative where a further flank grazes.
    return CORNER if equations.nearest_flank(here.place) < GRAZES else LOST


def _next(
    equations: Equations, points: list[OnBoundary], distances: Floats
) -> Following[tuple[list[OnBoundary | None], bool]]:
    """Search the next points of a boundary, and whether the last of them lies at an edge.

    ``distances``: those at which points are predicted. A point is None if it is not found near its
    prediction.
    """
    here, leaves = points[-1], False
    searches: list[Following[OnBoundary | None]] = []
    gaps = np.diff(distances, prepend=0.0)
    for guess, tangent, gap, step in zip(
        *extended(points[-2:], distances), gaps.tolist(), distances.tolist(), strict=True
    ):
        guess, direction = among_columns(equations, guess, tangent, 0.5 * gap)
        outside = _outside(guess)
        leaves = bool(outside.any())
        if leaves:
            searches.append(_at_edge(equations, here, guess, step, outside))
            break
        reach = ASIDE * gap
        searches.append(equations.correcting(guess, direction, here.reference, reach=reach))
    trials = yield from together(searches)
    for number, trial in enumerate(trials[: len(trials) - leaves]):
        if trial is not None and _outside(trial.place).any():
            outside, step = _outside(trial.place), float(distances[number])
            edge = yield from _at_edge(equations, here, trial.place, step, outside)
            return [*trials[:number], edge], True
    return trials, leaves


def _outside(place: Floats) -> Mask:
    """Return which components of a place (states + 2,) lie outside the ranges."""
    outside = (place < 0.0) | (place > 1.0)
    outside[:-PARAMETERS] = False
    return np.asarray(outside)


def fixed_direction(equations: Equations, tangent: Floats) -> Floats:
    """Return the direction normal to which a point is corrected.

    Where flow maps depend on one of the parameters, this parameter stays fixed if the curve is not
    nearly normal to it: each further value would need maps of its own.
    """
    direction, number = tangent, equations.fixed
    if number >= 0 and abs(tangent[number - PARAMETERS]) > STEEP:
        direction = np.zeros_like(tangent)
        direction[number - PARAMETERS] = np.sign(tangent[number - PARAMETERS])
    return direction


def among_columns(
    equations: Equations, guess: Floats, tangent: Floats, reach: float
) -> tuple[Floats, Floats]:
    """Return a guess that may lie up to ``reach`` along the tangent, and how it is corrected.

    Where a parameter stays fixed, it takes a value with few binary digits. Many points then have
    the same value, and share their flow maps.
    """
    direction, number = fixed_direction(equations, tangent), equations.fixed - PARAMETERS
    if direction is tangent:
        return guess, direction
    grid = 2.0 ** np.floor(np.log2(reach * abs(tangent[number])))
    moved = round(float(guess[number]) / grid) * grid - guess[number]
    guess = guess + moved / tangent[number] * tangent
    guess[number] = round(float(guess[number]) / grid) * grid
    return guess, direction


def _at_edge(
    equations: Equations, here: OnBoundary, beyond: Floats, step: float, outside: Mask
) -> Following[OnBoundary | None]:
    """Search the point at the edge of the range between a point and a place beyond."""
    chord = beyond - here.place
    edges = (beyond > 0.5).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(outside, (edges - here.place) / chord, np.inf)
    number = int(np.argmin(reach))
    guess = here.place + min(max(float(reach[number]), 0.0), 1.0) * chord
    guess[number] = edges[number]
    direction = np.zeros_like(guess)
    direction[number] = np.sign(chord[number]) or 1.0
    trial = yield from equations.correcting(guess, direction, here.reference)
    if trial is None or np.linalg.norm(trial.place - here.place) > 2.0 * step:
        return None
    if np.any((trial.shares < -1e-12) | (trial.shares > 1.0 + 1e-12)):
        return None
    onward = np.sign(trial.tangent @ here.tangent) or 1.0
    return trial._replace(tangent=onward * trial.tangent)
