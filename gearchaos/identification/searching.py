"""The search itself: candidates are proposed, computed, judged and kept, and it may be stopped."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.configuration.toml_text import toml_text
from gearchaos.engine.provenance import SOFTWARE
from gearchaos.errors import FileError
from gearchaos.identification.evaluation import coordinates_of, evaluate
from gearchaos.identification.loading import Problem
from gearchaos.identification.observations import misfit, observations_of
from gearchaos.identification.search import Generation, proposals
from gearchaos.identification.tried import MEANINGS, Tried, joined
from gearchaos.interrupts import check

Floats = NDArray[np.float64]

SECONDS_BETWEEN_SNAPSHOTS = 20.0
LANES_AT_ONCE = 2**13
"""Lanes of one batch: enough for all threads, and little memory."""

Keep = Callable[[Tried], None]


class Judge:
    """Computes candidates and compares them with the observations of a problem.

    Attributes
    ----------
    observations : list of Observation
    values : ndarray, shape (values,)
        All values of the swept parameter at which something is looked at, ascending.
    """

    def __init__(self, problem: Problem) -> None:
        self.targets, self._config = problem.targets, problem.config
        self.observations = observations_of(self.targets, coordinates_of(self._config))
        self.values = np.unique(np.concatenate([one.values for one in self.observations]))
        self._places = [np.searchsorted(self.values, one.values) for one in self.observations]
        self._accelerated = np.zeros(self.values.size, dtype=np.bool_)
        for one, places in zip(self.observations, self._places, strict=True):
            self._accelerated[places] |= one.accelerated

    @property
    def at_once(self) -> int:
        """Candidates of one batch."""
        return max(1, LANES_AT_ONCE // self.values.size)

    def judge(self, generation: Generation) -> Tried:
        """Compute candidates."""
        return self.judge_values(generation.run, self.targets.values(generation.points))

    def judge_values(self, run: int, parameters: dict[str, Floats]) -> Tried:
        """Compute candidates given by their parameters, each of shape (candidates,)."""
        records = evaluate(self._config, self.values, parameters, self._accelerated)
        seen = zip(self.observations, self._places, strict=True)
        computed = np.stack([one.computed(records.at(places)) for one, places in seen], axis=1)
        sound = np.all(records.sound, axis=1)
        return Tried(
            np.full(sound.size, run, dtype=np.int32),
            np.stack(list(parameters.values()), axis=1),
            computed,
            misfit(self.residuals(computed)),
            np.where(sound, MEANINGS.index("complete"), MEANINGS.index("diverged")).astype(
                np.uint8
            ),
        )

    def residuals(self, computed: Floats) -> Floats:
        """Return by how many widths computed numbers (candidates, observations) are off."""
        rows = zip(self.observations, computed.T, strict=True)
        return np.stack([one.residual(row) for one, row in rows], axis=1)


def decisive_facts(problem: Problem) -> dict[str, Any]:
    """Return what decides which candidates are tried and what they come to."""
    tables = {
        "cma_version": version("cma"),
        "targets": problem.targets.model_dump(exclude_none=True),
        "of": problem.config.tables(),
    }
    return {**SOFTWARE._asdict(), "configuration": toml_text(tables)}


def search(
    judge: Judge,
    known: Tried | None,
    keep: Keep,
    advance: Callable[[int], None],
    source: str,
) -> Tried:
    """Try all candidates of a search and return them.

    ``known`` are those of an earlier part of it, from the file ``source``, which are not computed
    again; ``keep`` is called with all there are from time to time, and where the search is
    interrupted, as soon as they are more than the known ones; ``advance`` with every number of
    candidates done.

    Raises
    ------
    FileError
        If the known candidates are not the first ones of this search.
    """
    parts: list[Tried] = []
    done, before, spoke = 0, 0 if known is None else len(known), time.monotonic()
    asking = proposals(judge.targets.search, len(judge.targets.parameter))
    generation = next(asking)
    try:
        while True:
            misfits = []
            for first in range(0, len(generation.points), judge.at_once):
                check()
                piece = generation._replace(points=generation.points[first:][: judge.at_once])
                if known is not None and done < before:
                    found = _again(piece, known.part(done, done + len(piece.points)), judge, source)
                else:
                    found = judge.judge(piece)
                    advance(len(found))
                parts.append(found)
                done += len(found)
                misfits.append(found.misfit)
                if done > before and time.monotonic() - spoke > SECONDS_BETWEEN_SNAPSHOTS:
                    spoke = time.monotonic()
                    parts = [joined(parts)]
                    keep(parts[0])
            generation = asking.send(np.concatenate(misfits))
    except StopIteration:
        return joined(parts)
    except KeyboardInterrupt:
        if done > before:
            keep(joined(parts))
        raise


def _again(piece: Generation, known: Tried, judge: Judge, source: str) -> Tried:
    values = np.stack(list(judge.targets.values(piece.points).values()), axis=1)
    if not np.array_equal(values, known.values):
        raise FileError(
            f"{source}: its candidates are not those of this search here, which can differ between "
            "machines; finish it where it began, or begin anew with --overwrite"
        )
    return known
