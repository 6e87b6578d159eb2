"""The report of a search: the best distinct sets, and how well the targets determine them."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from gearchaos.arrays import Floats
from gearchaos.identification.flat_directions import ONE_UNIT, directions_at, distinct
from gearchaos.identification.loading import Problem
from gearchaos.identification.search import STEPS_ALONE, answers_of, budget_of
from gearchaos.identification.tried import Tried
from gearchaos.models.gear_pair.group_table import SWEEPABLE_GROUPS
from gearchaos.progress import count_of

NEAREST = 3  # Nearest steps in each direction; their median misfit is that of the surroundings.

UNDETERMINED = 0.5
"""Share of its bounds over which a parameter may move and still counts as determined."""

FLAT_EXTENT = 0.1
"""Least extent, in the unit cube, of a flat direction that is reported."""

LABEL, COLUMN = 34, 12


class Reach(NamedTuple):
    """Ranges of the parameters over which the misfit grows by less than one unit.

    ``alone`` (parameters, 2): one parameter moves from the centre of the last steps, the others are
    fixed; ``among`` (parameters, 2): range among all computed candidates; ``surroundings``: median
    misfit of the sets next to that centre.
    """

    alone: Floats
    among: Floats
    surroundings: float


def reach(tried: Tried, rungs: int) -> Reach:
    """Return how far each parameter can move.

    ``rungs``: steps per parameter and direction at the end of the search; with 0, ``alone`` is NaN.

    Labels change abruptly and chaos is judged from a short record, so that the misfit is not smooth
    on a small scale. The limit is therefore where the median of three neighbouring steps exceeds a
    reference by one, interpolated between two steps. The reference is the median misfit of the sets
    next to the centre or the misfit of the centre, whichever is larger.
    """
    parameters = tried["values"].shape[1]
    alike = tried["values"][tried["misfit"] <= np.min(tried["misfit"]) + ONE_UNIT]
    among = np.stack([alike.min(axis=0), alike.max(axis=0)], axis=1)
    if rungs == 0:
        return Reach(np.full((parameters, 2), np.nan), among, np.nan)
    steps = np.flatnonzero(tried["run"] == STEPS_ALONE)[-1 - 2 * rungs * parameters :]
    misfit = tried["misfit"][steps[1:]].reshape(parameters, 2, rungs)
    surroundings = float(np.median(misfit[..., :NEAREST]))
    padded = np.pad(misfit, ((0, 0), (0, 0), (1, 1)), mode="edge")
    median = np.median(sliding_window_view(padded, 3, axis=2), axis=3)
    reference = max(surroundings, float(tried["misfit"][steps[0]]))
    values = tried["values"][steps]
    alone = np.empty((parameters, 2))
    for number, side in np.ndindex(alone.shape):
        first = 1 + rungs * (2 * number + side)
        along = np.append(values[0, number], values[first : first + rungs, number])
        above = np.append(reference, median[number, side]) - (reference + ONE_UNIT)
        alone[number, side] = _first_zero(along, above)
    return Reach(alone, among, surroundings)


def _first_zero(along: Floats, above: Floats) -> float:
    """Return where a function of some values along a line first passes zero, or the last value.

    ``above``: the function, negative at the first value.
    """
    if not np.any(above > 0.0):
        return float(along[-1])
    beyond = int(np.argmax(above > 0.0))
    some = slice(beyond - 1, beyond + 1)
    return float(np.interp(0.0, above[some], along[some]))


def report(problem: Problem, tried: Tried, most: int = 4) -> Iterator[str]:
    """Word the best sets, their computed observations, and how well the targets determine them.

    Parameters
    ----------
    problem : Problem
        The search problem.
    tried : Tried
        All candidates of the search.
    most : int
        Most sets to report.

    Yields
    ------
    str
        Lines of text.
    """
    free, apart = problem.targets.parameter, problem.targets.search.apart
    points = _points(problem, tried["values"])
    sets, keys = distinct(points, tried["misfit"], apart, most), [one.name for one in free]
    titles = [f"set {number}" for number in range(1, len(sets) + 1)]
    yield _counted(len(problem.observations), len(keys))
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
    yield from _moved(problem, tried, points, keys)
    yield ""
    yield "set 1 in full, for a configuration:"
    for key, value in zip(keys, tried["values"][sets[0]].tolist(), strict=True):
        yield f"{'groups.' if key in SWEEPABLE_GROUPS else ''}{key} = {value!r}"


def _counted(observations: int, unknowns: int) -> str:
    """Word the numbers of observations and of unknowns."""
    text = ", ".join([count_of(observations, "observation"), count_of(unknowns, "unknown")])
    if observations < unknowns:
        free = unknowns - observations
        text += f": at least {free} combination{'s' if free > 1 else ''} of them not determined"
    return text


def _moved(problem: Problem, tried: Tried, points: Floats, keys: list[str]) -> Iterator[str]:
    """Word how far the parameters can move, alone and together."""
    rungs = budget_of(problem.targets.search, len(keys)).rungs
    found = reach(tried, rungs)
    yield "how far each can move before the misfit grows by one, alone and with the others:"
    yield _row("", ["alone from", "to", "all from", "to"])
    low, high = _points(problem, found.among.T)
    answers = answers_of(problem, tried)
    near = directions_at(points[np.argmin(answers[:, 0])], points, answers)
    # The larger of the range of fitting sets and the range predicted by the residuals.
    wide_ones = np.maximum(high - low, np.minimum(1.0, 2.0 * near.reach))
    for key, wide, *row in zip(keys, wide_ones, found.alone, found.among, strict=True):
        yield _row(key, np.ravel(row)) + ("  not determined" if wide >= UNDETERMINED else "")
    if rungs == 0:
        yield (
            "(too few candidates to move the best set: these ranges hold what happened to be "
            "tried, and the true ones are wider; raise search.candidates)"
        )
        return
    beside = "a thousandth of the bounds beside where the last steps began"
    yield f"({beside}: misfit {found.surroundings:.4g})"
    alike = points[tried["misfit"] <= np.min(tried["misfit"]) + ONE_UNIT]
    for extent, direction in flat_directions(alike):
        # Relative to the parameter that moves most.
        parts = zip(keys, direction / np.max(np.abs(direction)), strict=True)
        together = ", ".join(f"{key} {part:+.2f}" for key, part in parts if abs(part) >= 0.05)
        yield f"flat over {extent:.2f} of the bounds: {together}"


def flat_directions(alike: Floats) -> list[tuple[float, Floats]]:
    """Return extent and direction of the sets that fit equally well, the longest first.

    ``alike`` (sets, parameters): points of the unit cube. The directions (parameters,) are their
    principal components.
    """
    around = alike - alike.mean(axis=0)
    vectors = np.linalg.svd(around, full_matrices=False)[2]
    extents = np.ptp(around @ vectors.T, axis=0)
    found = zip(extents.tolist(), vectors, strict=True)
    signed = ((extent, v * np.sign(v[np.argmax(np.abs(v))])) for extent, v in found)
    return [one for one in signed if one[0] >= FLAT_EXTENT]


def _points(problem: Problem, values: Floats) -> Floats:
    """Return sets of parameters as points of the unit cube."""
    columns = zip(problem.targets.parameter, values.T, strict=True)
    return np.stack([[one.share(v) for v in column.tolist()] for one, column in columns], axis=1)


def _row(name: str, entries: Iterable[str | float]) -> str:
    cells = (f"{one:>{COLUMN}}" if isinstance(one, str) else _number(one) for one in entries)
    return f"{name:{LABEL}}{''.join(cells)}"


def _number(value: float) -> str:
    """Word a number in a column; a dash where there is none."""
    return f"{'-':>{COLUMN}}" if np.isnan(value) else f"{value:{COLUMN}.5g}"
