"""What a search has found, in words: the best sets that differ, and what the targets determine."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from gearchaos.arrays import Floats
from gearchaos.configuration.tables import SWEEPABLE_GROUPS
from gearchaos.identification.loading import Problem
from gearchaos.identification.search import RUNGS, STEPS_ALONE, distinct
from gearchaos.identification.tried import Tried

ONE_UNIT = 1.0  # By how much the misfit grows where a parameter counts as moved too far.
NEAREST = 3  # Steps in each direction whose misfits tell how even the best set's surroundings are.

LABEL, COLUMN = 34, 12


class Reach(NamedTuple):
    """From where to where parameters can move before the fit is worse by one unit.

    ``alone`` (parameters, 2): one moved away from the centre of the last steps, the others held;
    ``among`` (parameters, 2): among all candidates that were tried; ``surroundings``: misfit of the
    sets next to that centre, the median.
    """

    alone: Floats
    among: Floats
    surroundings: float


def reach(tried: Tried) -> Reach:
    """Return how far each parameter can move.

    A label changes at once, and chaos is judged by a short record: the misfit is uneven on the
    smallest scale. So a parameter is too far where the median of three neighbouring steps exceeds
    that of the sets next to the best one, or the misfit of the best one if this is more, by one.
    """
    parameters = tried["values"].shape[1]
    alike = tried["values"][tried["misfit"] <= np.min(tried["misfit"]) + ONE_UNIT]
    among = np.stack([alike.min(axis=0), alike.max(axis=0)], axis=1)
    steps = np.flatnonzero(tried["run"] == STEPS_ALONE)[-1 - 2 * RUNGS * parameters :]
    misfit = tried["misfit"][steps[1:]].reshape(parameters, 2, RUNGS)
    surroundings = float(np.median(misfit[..., :NEAREST]))
    padded = np.pad(misfit, ((0, 0), (0, 0), (1, 1)), mode="edge")
    median = np.median(sliding_window_view(padded, 3, axis=2), axis=3)
    too_far = median > max(surroundings, tried["misfit"][steps[0]]) + ONE_UNIT
    # The last step before the first one that is too far; 0 is the centre.
    last = np.where(too_far.any(axis=2), np.argmax(too_far, axis=2), RUNGS)
    number = np.arange(parameters)[:, np.newaxis]
    row = np.where(last > 0, RUNGS * (2 * number + [0, 1]) + last, 0)
    alone = tried["values"][steps[row], number]
    return Reach(alone, among, surroundings)


def report(problem: Problem, tried: Tried, most: int = 4) -> Iterator[str]:
    """Word the best sets, what they come to, and how well the targets determine them."""
    free, apart = problem.targets.parameter, problem.targets.search.apart
    columns = zip(free, tried["values"].T, strict=True)
    points = np.stack([[one.share(v) for v in values.tolist()] for one, values in columns], axis=1)
    sets, keys = distinct(points, tried["misfit"], apart, most), [one.name for one in free]
    titles = [f"set {number}" for number in range(1, len(sets) + 1)]
    yield f"{len(tried)} candidates; the best sets that differ:"
    yield _row("", titles)
    yield _row("misfit", tried["misfit"][sets])
    for key, values in zip(keys, tried["values"][sets].T, strict=True):
        yield _row(key, values)
    yield ""
    yield _row("observed", ["wanted", "width", *titles])
    for one, row in zip(problem.observations, tried["computed"][sets].T, strict=True):
        yield _row(one.name, [one.wanted, one.width, *row])
    yield ""
    found = reach(tried)
    yield "how far each can move before the misfit grows by one, alone and with the others:"
    yield _row("", ["alone from", "to", "all from", "to"])
    for key, *ends in zip(keys, found.alone, found.among, strict=True):
        yield _row(key, np.ravel(ends))
    beside = "a thousandth of the bounds beside where the last steps began"
    yield f"({beside}: misfit {found.surroundings:.4g})"
    yield ""
    yield "set 1 in full, for a configuration:"
    for key, value in zip(keys, tried["values"][sets[0]].tolist(), strict=True):
        yield f"{'groups.' if key in SWEEPABLE_GROUPS else ''}{key} = {value!r}"


def _row(name: str, entries: Iterable[str | float]) -> str:
    cells = (
        f"{one:>{COLUMN}}" if isinstance(one, str) else f"{one:{COLUMN}.5g}" for one in entries
    )
    return f"{name:{LABEL}}{''.join(cells)}"
