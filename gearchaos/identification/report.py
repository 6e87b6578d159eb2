"""What a search has found, in words: the best sets that differ, and what the targets determine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.configuration.sweep_values import SWEEPABLE_GROUPS
from gearchaos.identification.search import RUNGS, STEPS_ALONE, distinct
from gearchaos.identification.searching import Judge
from gearchaos.identification.tried import Tried

Floats = NDArray[np.float64]

ONE_UNIT = 1.0
"""By how much the misfit grows where a parameter counts as moved too far."""

LABEL = 34
COLUMN = 11


class Reach(NamedTuple):
    """How far a parameter can move before the fit is worse by one unit.

    ``alone_low``, ``alone_high``: moved alone from the best set, the others held; ``low``,
    ``high``: among all candidates that were tried, the others moved too. NaN where it was not
    looked at.
    """

    key: str
    best: float
    alone_low: float
    alone_high: float
    low: float
    high: float


def best_sets(judge: Judge, tried: Tried, most: int) -> list[int]:
    """Return the numbers of the best candidates that differ, the best one first."""
    columns = zip(judge.targets.parameter, tried.values.T, strict=True)
    points = np.stack([[one.share(v) for v in values.tolist()] for one, values in columns], axis=1)
    return distinct(points, tried.misfit, judge.targets.search.apart, most)


def reaches(judge: Judge, tried: Tried) -> list[Reach]:
    """Return how far each parameter can move; `steps_alone` were tried last."""
    best = int(np.argmin(tried.misfit))
    alike = tried.values[tried.misfit <= tried.misfit[best] + ONE_UNIT]
    alone = np.full((tried.values.shape[1], 2), np.nan)
    steps = np.flatnonzero(tried.run == STEPS_ALONE)[-1 - 2 * RUNGS * len(alone) :]
    if steps.size:
        centre, *others = steps
        limit = tried.misfit[centre] + ONE_UNIT
        worse = np.reshape(tried.misfit[others] > limit, (-1, 2, RUNGS))
        for number, ways in enumerate(worse):
            moved = np.reshape(tried.values[others, number], worse.shape)[number]
            for way, too_far in enumerate(ways):
                # The last step before the first one that is too far.
                last = int(np.argmax(too_far)) if too_far.any() else RUNGS
                alone[number, way] = np.append(tried.values[centre, number], moved[way])[last]
    return [
        Reach(
            one.name, float(tried.values[best, n]), *alone[n], alike[:, n].min(), alike[:, n].max()
        )
        for n, one in enumerate(judge.targets.parameter)
    ]


def report(judge: Judge, tried: Tried, most: int = 4) -> Iterator[str]:
    """Word the best sets, what they come to, and how well the targets determine them."""
    sets, keys = best_sets(judge, tried, most), [one.name for one in judge.targets.parameter]
    yield f"{len(tried)} candidates; the best sets that differ"
    yield ""
    yield from _table("misfit", [tried.misfit[sets]], ["misfit"])
    yield ""
    yield from _table("parameter", tried.values[sets].T, keys)
    yield ""
    head = f"{'observed':{LABEL}}{'wanted':>{COLUMN}}{'width':>{COLUMN}}"
    yield head + "".join(f"{f'set {n}':>{COLUMN}}" for n in range(1, len(sets) + 1))
    for one, row in zip(judge.observations, tried.computed[sets].T, strict=True):
        numbers = [one.wanted, one.width, *row]
        yield f"{one.name:{LABEL}}" + "".join(f"{number:{COLUMN}.5g}" for number in numbers)
    yield ""
    yield "how far each can move before the misfit grows by one:"
    yield "alone from set 1, and with the others among all that were tried"
    names = ("alone from", "to", "all from", "to")
    yield f"{'parameter':{LABEL}}" + "".join(f"{name:>{COLUMN}}" for name in ("set 1", *names))
    for reach in reaches(judge, tried):
        yield f"{reach.key:{LABEL}}" + "".join(f"{number:{COLUMN}.5g}" for number in reach[1:])
    yield ""
    yield "set 1 in full, for a configuration"
    for key, value in zip(keys, tried.values[sets[0]].tolist(), strict=True):
        yield f"{'groups.' if key in SWEEPABLE_GROUPS else ''}{key} = {value!r}"


def _table(first: str, rows: Sequence[Floats], names: Sequence[str]) -> Iterator[str]:
    yield f"{first:{LABEL}}" + "".join(
        f"{f'set {n}':>{COLUMN}}" for n in range(1, len(rows[0]) + 1)
    )
    for name, row in zip(names, rows, strict=True):
        yield f"{name:{LABEL}}" + "".join(f"{number:{COLUMN}.5g}" for number in row)
