"""Which candidates are tried: drawn ones, CMA-ES from the best of them, and steps from the best.

The candidates of a generation are yielded as points of the unit cube, and their misfits sent back:
the same misfits lead to the same candidates, which is how a search that was stopped goes on.
"""

from __future__ import annotations

import warnings
from collections.abc import Generator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gearchaos.identification.targets import Search

Floats = NDArray[np.float64]

DRAWN = 0
"""Number of the run to which drawn candidates belong; those of CMA-ES count from 1."""

STEPS_ALONE = -1
"""Number of the run of the steps away from the best candidate."""

FIRST_SPREAD = 0.2
"""Standard deviation with which CMA-ES begins, as a share of the bounds."""

RUNGS = 20
"""Steps away from the best candidate, for each parameter and direction."""

STARTS = 4
"""Drawn sets kept for each run to begin from: runs that end early are followed by more."""

MOST_CENTRES = 5
"""Where one of those steps is better than the best candidate, they begin again from it."""


class Generation(NamedTuple):
    """Candidates that are tried together: the number of their run, and their points."""

    run: int
    points: Floats


Proposals: TypeAlias = Generator[Generation, Floats, None]


def proposals(search: Search, parameters: int) -> Proposals:
    """Yield one generation after the other; their misfits are to be sent back.

    All of them together are ``search.candidates`` at most, and `steps_alone` after these.
    """
    random = np.random.default_rng(search.seed)
    drawn = random.random((search.drawn, parameters))
    misfits = yield Generation(DRAWN, drawn)
    best, least = drawn[np.argmin(misfits)], float(np.min(misfits))
    starts = distinct(drawn, misfits, search.apart, most=STARTS * search.runs)
    left, run = search.candidates - search.drawn, 0
    while left >= search.population:
        begin = drawn[starts[run % len(starts)]]
        strategy = _strategy(begin, search.population, random)
        # A run that comes to its end early leaves the rest to those after it.
        share = max(search.population, left // max(1, search.runs - run))
        run += 1
        while min(left, share) >= search.population and not strategy.stop():
            asked = strategy.ask()
            points = np.clip(np.array(asked), 0.0, 1.0)
            misfits = yield Generation(run, points)
            strategy.tell(asked, misfits.tolist())
            left, share = left - search.population, share - search.population
            if np.min(misfits) < least:
                best, least = points[np.argmin(misfits)], float(np.min(misfits))
    for _ in range(MOST_CENTRES):
        points = steps_alone(best)
        misfits = yield Generation(STEPS_ALONE, points)
        if np.min(misfits) >= least:
            break
        best, least = points[np.argmin(misfits)], float(np.min(misfits))


def steps_alone(centre: Floats) -> Floats:
    """Return points away from a centre, one parameter at a time.

    First the centre, then for each parameter the steps down and those up, smallest first, from a
    thousandth of the bounds to all of them; at a bound they stay there.
    """
    steps = 2.0 ** -np.linspace(10.0, 0.0, RUNGS)
    points = np.tile(centre, (centre.size, 2, RUNGS, 1))
    for number in range(centre.size):
        points[number, :, :, number] += np.outer([-1.0, 1.0], steps)
    rows = np.concatenate([centre[np.newaxis], points.reshape(-1, centre.size)])
    clipped: Floats = np.clip(rows, 0.0, 1.0)
    return clipped


def distinct(points: Floats, misfits: Floats, apart: float, most: int) -> list[int]:
    """Return the numbers of the best points that differ from each other, the best one first.

    Two points differ where one of their coordinates does by more than ``apart``.
    """
    found: list[int] = []
    for number in np.argsort(misfits, kind="stable").tolist():
        far = np.max(np.abs(points[found] - points[number]), axis=1, initial=0.0) > apart
        if np.all(far):
            found.append(number)
            if len(found) == most:
                break
    return found


def _strategy(begin: Floats, population: int, random: np.random.Generator) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import cma

        return cma.CMAEvolutionStrategy(
            begin,
            FIRST_SPREAD,
            {
                "bounds": [0.0, 1.0],
                "popsize": population,
                # A generator of its own instead of the seed of all of NumPy.
                "randn": lambda *shape: random.standard_normal(shape),
                "seed": np.nan,
                "verbose": -9,
            },
        )
