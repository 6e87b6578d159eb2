"""Directions in which the misfit hardly changes: regressed from the candidates, then walked along.

Near the best candidate the residuals are approximated as linear in the parameters,
r = r_0 + J (u - u_0) with u in the unit cube. For a singular value s of J with right vector v the
misfit grows by one over a distance of 1 / s along v (Gauss-Newton: its Hessian is 2 J^T J). Labels
change abruptly and make J inaccurate. A walk therefore determines how far the fit holds.
"""

from collections.abc import Generator
from typing import NamedTuple, TypeAlias

import numpy as np

from gearchaos.arrays import Floats

Proposals: TypeAlias = Generator[tuple[int, Floats], Floats, None]
"""Yields the run number and the points of candidates that are computed together.

Receives one row per candidate: its misfit, then its residuals.
"""

ALONG = -2  # Run number of the walks along flat directions.

ONE_UNIT = 1.0  # Growth of the misfit beyond which a parameter has moved too far.

FLAT = 0.05
"""Least distance to one unit of misfit, in the unit cube, of a direction that is walked along."""

NEIGHBOURS = 10  # Regression uses this many candidates times the number of unknowns plus one.
APART = 0.02  # Least difference between them, as a share of the bounds, to avoid clusters.

FIRST_STEP, SMALLEST_STEP = 0.05, 0.01
SIDEWAYS = 0.3  # Spread of candidates across the direction, relative to the step.


class Directions(NamedTuple):
    """Directions in the unit cube, the flattest first.

    ``vectors`` (directions, parameters): unit vectors; ``ways`` (directions,): distance to one unit
    of misfit.
    """

    vectors: Floats
    ways: Floats

    @property
    def reach(self) -> Floats:
        """How far each parameter moves, the others refitted, until the misfit has grown by one.

        sqrt(diag((J^T J)^-1)), shape (parameters,), as shares of the bounds.
        """
        moved: Floats = np.linalg.norm(self.ways[:, np.newaxis] * self.vectors, axis=0)
        return moved


def directions_at(centre: Floats, points: Floats, answers: Floats) -> Directions:
    """Return directions away from a centre, the flattest first.

    ``points`` (candidates, parameters); ``answers`` (candidates, 1 + observations): misfits and
    residuals. The regression uses the best distinct candidates; a small misfit has a large weight.
    """
    near = distinct(points, answers[:, 0], APART, NEIGHBOURS * (1 + centre.size))
    weight = 1.0 / (1.0 + answers[near, :1] - np.min(answers[:, 0]))
    rows = np.column_stack([np.ones(len(near)), points[near] - centre])
    slopes = np.linalg.lstsq(weight * rows, weight * answers[near, 1:], rcond=None)[0][1:]
    vectors, sizes, _ = np.linalg.svd(slopes, full_matrices=True)
    # With fewer observations than unknowns, the remaining directions are free.
    steep = np.zeros(centre.size)
    steep[: sizes.size] = sizes
    return Directions(vectors.T[::-1], 1.0 / np.maximum(steep[::-1], 1e-3))


def distinct(points: Floats, misfits: Floats, apart: float, most: int) -> list[int]:
    """Return the numbers of the best distinct points, at most ``most``, the best one first.

    Two points are distinct if one of their coordinates differs by more than ``apart``.
    """
    found: list[int] = []
    for number in np.argsort(misfits, kind="stable").tolist():
        if len(found) == most:
            break
        far = np.max(np.abs(points[found] - points[number]), axis=1, initial=0.0) > apart
        if np.all(far):
            found.append(number)
    return found


def walks(
    centre: Floats, found: Directions, limit: float, budget: int, random: np.random.Generator
) -> Proposals:
    """Walk from a centre both ways along all flat directions, while the misfit is within a limit.

    All walks together use at most ``budget`` candidates.
    """
    left, flat = budget, np.flatnonzero(found.ways >= FLAT).tolist()
    for place, number in enumerate(flat):
        # Budget in proportion to the distance, which ends at the bounds.
        ways = np.minimum(1.0, found.ways[flat[place:]])
        own = int(left * ways[0] / ways.sum())
        there = _Walked(centre, found.vectors[number], 0)
        there = yield from _walk(there, number, found, limit, own // 2, random)
        # The walk back reverses the final direction; candidates it leaves continue the first walk.
        back = _Walked(centre, -there.ahead, there.used)
        back = yield from _walk(back, number, found, limit, own, random)
        there = there._replace(used=back.used)
        left -= (yield from _walk(there, number, found, limit, own, random)).used


class _Walked(NamedTuple):
    """Where a walk has arrived, its direction from there, and the number of candidates used."""

    at: Floats
    ahead: Floats
    used: int


def _walk(
    begin: _Walked,
    number: int,
    found: Directions,
    limit: float,
    budget: int,
    random: np.random.Generator,
) -> Generator[tuple[int, Floats], Floats, _Walked]:
    """Walk along direction ``number`` while the misfit is within the limit.

    A step is doubled after a success and halved after a failure; the direction turns towards the
    successful candidates. The walk ends when ``budget`` candidates have been used.
    """
    parameters, used = begin.at.size, begin.used
    population = 2 + parameters
    at, ahead, step = begin.at, begin.ahead, FIRST_STEP
    while used + population <= budget and step >= SMALLEST_STEP:
        # Small in steep directions: the misfit changes by less than one unit.
        spread = np.minimum(SIDEWAYS * step, 0.25 * found.ways)
        spread[number] = 0.0
        aside = random.standard_normal((population, parameters)) * spread
        aside[0] = 0.0
        points = np.clip(at + step * ahead + aside @ found.vectors, 0.0, 1.0)
        misfits = (yield ALONG, points)[:, 0]
        used += population
        best = points[np.argmin(misfits)]
        if np.min(misfits) > limit or np.linalg.norm(best - at) < 0.5 * step:
            step /= 2.0
            continue
        at, step = best, 2.0 * step
        stopped = (at == 0.0) & (ahead < 0.0) | (at == 1.0) & (ahead > 0.0)
        if np.linalg.norm(ahead[stopped]) > 0.5:
            break  # At a bound, the parameters can no longer move together.
        ahead = (at - begin.at) / np.linalg.norm(at - begin.at)
    return _Walked(at, ahead, used)
