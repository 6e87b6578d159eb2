"""The search: random candidates, generations of CMA-ES, and steps around the best candidate.

A generator yields the candidates of a generation as points of the unit cube and receives their
misfits and residuals. Equal misfits lead to equal candidates, so that an interrupted search can be
resumed from the candidates in its file.
"""

import warnings
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.configuration.toml_text import toml_text
from gearchaos.engine.provenance import SOFTWARE
from gearchaos.errors import FileError
from gearchaos.identification.evaluation import evaluate_candidates
from gearchaos.identification.flat_directions import (
    ONE_UNIT,
    Proposals,
    directions_at,
    distinct,
    walks,
)
from gearchaos.identification.loading import Problem
from gearchaos.identification.observations import misfit
from gearchaos.identification.targets import Search
from gearchaos.identification.tried import Tried, fields_of
from gearchaos.interrupts import check

DRAWN = 0  # Run number of random candidates; runs of CMA-ES count from 1.
STEPS_ALONE = -1  # Run number of the steps away from the best candidate.
FIRST_SPREAD = 0.2  # Initial standard deviation of CMA-ES, as a share of the bounds.
RUNGS = 20  # Most steps away from the best candidate, per parameter and direction.
FEWEST_RUNGS = 4  # Fewest of these steps; with fewer the ranges of parameters are not reported.
STARTS = 4  # Random sets kept per run as starting points: early stops leave room for more runs.

MOST_CENTRES = 5
"""Most centres of these steps: they are repeated from a step that is better than the centre."""

LANES_AT_ONCE = 2**13  # Lanes per batch: enough for all threads, and little memory.


class Budget(NamedTuple):
    """Numbers of candidates for the parts of a search.

    ``bred``: candidates of CMA-ES; ``last``: candidates around the best set, for steps and walks;
    ``rungs``: steps per parameter and direction, 0 if the candidates are too few.
    """

    bred: int
    last: int
    rungs: int

    @property
    def looked(self) -> bool:
        """Whether the surroundings of the best set are explored."""
        return self.rungs > 0


def budget_of(search: Search, parameters: int) -> Budget:
    """Divide the candidates of a search over its parts.

    Up to a third of the candidates that are not random is kept for the surroundings of the best
    set: two fifths of it for steps of single parameters, the rest for walks along flat directions.
    """
    others = search.candidates - search.drawn
    last = min(others // 3, 2 * MOST_CENTRES * (1 + 2 * RUNGS * parameters))
    rungs = min(RUNGS, (2 * last // 5 - 1) // (2 * parameters))
    if rungs < FEWEST_RUNGS:
        return Budget(others, 0, 0)
    return Budget(others - last, last, rungs)


def judge(problem: Problem, run: int, parameters: dict[str, Floats]) -> Tried:
    """Compute candidates and their misfits; ``parameters`` are (candidates,) by key."""
    ends = [end for one in problem.targets.increment for end in (one.from_, one.to)]
    accelerated = np.isin(problem.values, ends)
    records = evaluate_candidates(problem.config, problem.values, parameters, accelerated)
    computed, residuals = [], []
    for one in problem.observations:
        places = np.searchsorted(problem.values, one.values)
        computed.append(one.computed(records.at(places)))
        residuals.append(one.residual(computed[-1]))
    diverged = ~np.all(records.sound, axis=1)
    runs, misfits = np.full(diverged.size, run), misfit(np.stack(residuals, axis=1))
    rows = np.column_stack([runs, *parameters.values(), *computed, misfits, diverged])
    return rows.view(fields_of(problem))[:, 0]


def decisive_facts(problem: Problem) -> dict[str, Any]:
    """Return all facts that determine the candidates of a search and their results.

    Returns
    -------
    dict of str to Any
        Versions of the software, and targets and configuration as TOML.
    """
    tables = {"targets": problem.targets.tables(), "of": problem.config.tables()}
    text = toml_text({"cma_version": version("cma"), **tables})
    return {**SOFTWARE._asdict(), "configuration": text}


def search(problem: Problem, known: Tried, source: str) -> Iterator[Tried]:
    """Yield all candidates of a search, one batch at a time.

    Parameters
    ----------
    problem : Problem
        The search problem.
    known : Tried
        Candidates of an interrupted part of the search, which are not computed again.
    source : str
        The file of these candidates, for messages.

    Yields
    ------
    Tried
        The candidates of a batch.

    Raises
    ------
    FileError
        If ``known`` are not the first candidates of this search.
    """
    targets, done = problem.targets, 0
    at_once = max(1, LANES_AT_ONCE // problem.values.size)
    asking = proposals(targets.search, len(targets.parameter))
    run, points = next(asking)
    while True:
        answers = []
        for first in range(0, len(points), at_once):
            check()
            parameters = targets.values(points[first : first + at_once])
            found = known[done : done + len(points[first : first + at_once])]
            if done < len(known):
                _require_these(parameters, found, source)
            else:
                found = judge(problem, run, parameters)
            done += len(found)
            answers.append(answers_of(problem, found))
            yield found
        try:
            run, points = asking.send(np.concatenate(answers))
        except StopIteration:
            return


def answers_of(problem: Problem, tried: Tried) -> Floats:
    """Return misfits and residuals of candidates, (candidates, 1 + observations)."""
    columns = zip(problem.observations, tried["computed"].T, strict=True)
    return np.column_stack([tried["misfit"], *(one.residual(values) for one, values in columns)])


def proposals(search: Search, parameters: int) -> Proposals:
    """Yield generations, at most ``search.candidates`` in total; receive misfits and residuals."""
    random, part = np.random.default_rng(search.seed), budget_of(search, parameters)
    points, answers = np.empty((0, parameters)), []
    bred = _bred(search, parameters, part.bred, random)
    asked = next(bred)
    while True:
        answers.append((yield asked))
        points = np.concatenate([points, asked[1]])
        try:
            asked = bred.send(answers[-1])
        except StopIteration:
            break
    if part.looked:
        yield from _surroundings(points, np.concatenate(answers), part, random)


def _bred(search: Search, parameters: int, left: int, random: np.random.Generator) -> Proposals:
    """Yield the random candidates, then generations of CMA-ES with ``left`` candidates at most."""
    drawn = random.random((search.drawn, parameters))
    misfits = (yield DRAWN, drawn)[:, 0]
    starts = distinct(drawn, misfits, search.apart, most=STARTS * search.runs)
    run = 0
    while left >= search.population:
        begin = drawn[starts[run % len(starts)]]
        strategy = _strategy(begin, search.population, random)
        # A run that stops early leaves its remaining candidates to later runs.
        share = max(search.population, left // max(1, search.runs - run))
        run += 1
        while min(left, share) >= search.population and not strategy.stop():
            asked = strategy.ask()
            points = np.clip(np.array(asked), 0.0, 1.0)
            misfits = (yield run, points)[:, 0]
            strategy.tell(asked, misfits.tolist())
            left, share = left - search.population, share - search.population


def _surroundings(
    points: Floats, answers: Floats, part: Budget, random: np.random.Generator
) -> Proposals:
    """Yield steps away from the best candidate, then walks along its flat directions."""
    best, least = points[np.argmin(answers[:, 0])], float(np.min(answers[:, 0]))
    left, again = part.last, 2 * part.last // 5
    for _ in range(MOST_CENTRES):
        steps = steps_alone(best, part.rungs)
        if again < len(steps):
            break
        found = yield STEPS_ALONE, steps
        left, again = left - len(steps), again - len(steps)
        points, answers = np.concatenate([points, steps]), np.concatenate([answers, found])
        if np.min(found[:, 0]) >= least:
            break
        best, least = steps[np.argmin(found[:, 0])], float(np.min(found[:, 0]))
    flat = directions_at(best, points, answers)
    yield from walks(best, flat, least + ONE_UNIT, left, random)


def steps_alone(centre: Floats, rungs: int) -> Floats:
    """Return points that differ from a centre in one parameter, (points, parameters).

    First the centre, then for each parameter the steps down and the steps up, smallest first, from
    a thousandth of the bounds to all of them, clipped at the bounds.
    """
    steps = 2.0 ** -np.linspace(10.0, 0.0, rungs)
    points = np.tile(centre, (centre.size, 2, rungs, 1))
    for number in range(centre.size):
        points[number, :, :, number] += np.outer([-1.0, 1.0], steps)
    rows = np.concatenate([centre[np.newaxis], points.reshape(-1, centre.size)])
    clipped: Floats = np.clip(rows, 0.0, 1.0)
    return clipped


def _require_these(parameters: dict[str, Floats], known: Tried, source: str) -> None:
    if not np.array_equal(np.stack(list(parameters.values()), axis=1), known["values"]):
        raise FileError(
            f"{source}: its candidates are not those of this search here, which can differ between "
            "machines; finish it where it began, or begin anew with --overwrite"
        )


def _strategy(begin: Floats, population: int, random: np.random.Generator) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import cma

        options = {
            "bounds": [0.0, 1.0],
            "popsize": population,
            # An own generator: the default would set NumPy's global seed.
            "randn": lambda *shape: random.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
        }
        if begin.size == 1:
            # With one parameter, the package fails where it limits the spread.
            options["maxstd"] = np.inf
        return cma.CMAEvolutionStrategy(begin, FIRST_SPREAD, options)
