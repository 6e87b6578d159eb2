"""Directions in which the fit hardly changes: found from what was tried, and walked along.

Near the best candidate the residuals are taken as linear in the parameters, r = r_0 + J (u - u_0)
with u in the unit cube. A singular value s of J with its right vector v says that the misfit grows
by one after a way of 1 / s along v (Gauss and Newton approximate its Hessian by 2 J^T J). Labels
change at once and make J uneven, so that the walk itself decides how far the fit holds.
"""

from collections.abc import Generator
from typing import NamedTuple, TypeAlias

import numpy as np

from gearchaos.arrays import Floats

Proposals: TypeAlias = Generator[tuple[int, Floats], Floats, None]
"""Candidates that are tried together: the number of their run, and their points.

Sent back are a row for each: its misfit, and its residuals.
"""

ALONG = -2  # Number of the run of the walks along flat directions.

ONE_UNIT = 1.0  # By how much the misfit grows where a parameter counts as moved too far.

FLAT = 0.05
"""Way in the unit cube to one more unit of misfit from which on a direction is walked along."""

NEIGHBOURS = 10  # Candidates for each unknown, and one more, from which residuals are regressed.
APART = 0.02  # They differ by so much, as a share of the bounds: those of a cluster tell nothing.

FIRST_STEP, SMALLEST_STEP = 0.05, 0.01
SIDEWAYS = 0.3  # Spread of the candidates of a step across its direction, as a share of the step.


class Directions(NamedTuple):
    """Unit vectors in the unit cube (directions, parameters), and the way to one unit of misfit."""

    vectors: Floats
    ways: Floats

    @property
    def reach(self) -> Floats:
        """How far each parameter moves before the misfit has grown by one, the others fitted to it.

        That is sqrt(diag((J^T J)^-1)), (parameters,), as shares of the bounds.
        """
        moved: Floats = np.linalg.norm(self.ways[:, np.newaxis] * self.vectors, axis=0)
        return moved


def directions_at(centre: Floats, points: Floats, answers: Floats) -> Directions:
    """Return directions away from a centre, the flattest first.

    ``points`` (candidates, parameters), ``answers`` (candidates, 1 + observations): misfits and
    residuals. The best candidates that differ count, those of smaller misfit more.
    """
    near = distinct(points, answers[:, 0], APART, NEIGHBOURS * (1 + centre.size))
    weight = 1.0 / (1.0 + answers[near, :1] - np.min(answers[:, 0]))
    rows = np.column_stack([np.ones(len(near)), points[near] - centre])
    slopes = np.linalg.lstsq(weight * rows, weight * answers[near, 1:], rcond=None)[0][1:]
    vectors, sizes, _ = np.linalg.svd(slopes, full_matrices=True)
    # What has fewer observations than unknowns leaves some directions free.
    steep = np.zeros(centre.size)
    steep[: sizes.size] = sizes
    return Directions(vectors.T[::-1], 1.0 / np.maximum(steep[::-1], 1e-3))


def distinct(points: Floats, misfits: Floats, apart: float, most: int) -> list[int]:
    """Return the numbers of the best points that differ from each other, the best one first.

    Two points differ where one of their coordinates does by more than ``apart``.
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
    """Walk from a centre along all flat directions, both ways, while the misfit is within a limit.

    The candidates of all of them are ``budget`` at most.
    """
    left, flat = budget, np.flatnonzero(found.ways >= FLAT).tolist()
    for place, number in enumerate(flat):
        # A longer way has more steps; beyond the bounds there is none.
        ways = np.minimum(1.0, found.ways[flat[place:]])
        own = int(left * ways[0] / ways.sum())
        there = _Walked(centre, found.vectors[number], 0)
        there = yield from _walk(there, number, found, limit, own // 2, random)
        # The way back leads where this one has come to lead, and what it leaves is for going on.
        back = _Walked(centre, -there.ahead, there.used)
        back = yield from _walk(back, number, found, limit, own, random)
        there = there._replace(used=back.used)
        left -= (yield from _walk(there, number, found, limit, own, random)).used


class _Walked(NamedTuple):
    """Where a walk has come to, where it leads from there, and how many candidates it has used."""

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
    """Walk on along the direction of a number while the misfit is within the limit.

    A step is doubled where the fit has held and halved where it has not, and the direction turns to
    where it has held. Ends where so many candidates have been used.
    """
    parameters, used = begin.at.size, begin.used
    population = 2 + parameters
    at, ahead, step = begin.at, begin.ahead, FIRST_STEP
    while used + population <= budget and step >= SMALLEST_STEP:
        # Steep directions are left by less than a unit of misfit.
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
            break  # At a bound, what moved together can no longer do so.
        ahead = (at - begin.at) / np.linalg.norm(at - begin.at)
    return _Walked(at, ahead, used)
