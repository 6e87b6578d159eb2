"""Labels of integrated lanes: what their records tell, and Newton's method where they settle."""

from __future__ import annotations

import numpy as np
from gearchaos_kernels import Outcome, Plan, Status, System, integrate
from numpy.typing import NDArray

from gearchaos.dynamics.exponents import sum_of_exponents
from gearchaos.dynamics.orbits import polish
from gearchaos.records.bands import subsequence_spread
from gearchaos.records.label import (
    CHAOTIC,
    DIVERGED,
    MOST_POINTS,
    PERIODIC,
    QUASI_PERIODIC,
    SETTLING,
    UNRESOLVED,
    Labels,
    Record,
    label,
    may_rotate_slowly,
    settling_periods,
)
from gearchaos.records.period import coordinate_scale, return_distances

LONGER = 4
"""How many times the record a lane that may be on a torus goes on, to be looked at once more."""

WHOLE = 0.25
"""Largest difference of the subsequences of a curve, see `subsequence_spread`."""


def labels_of(system: System, outcome: Outcome, plan: Plan) -> Labels:
    """Label lanes by their record, which should hold `MOST_POINTS` section points or all there are.

    ``plan`` is that by which they were integrated.
    """
    record = _record(system, outcome, MOST_POINTS)
    labels = label(record)
    _settle(system, outcome, plan, labels, settling_periods(record, labels))
    rotating = np.flatnonzero((labels.motion == QUASI_PERIODIC) | may_rotate_slowly(record, labels))
    # In portions whose longer records take no more memory than those of all lanes.
    for lanes in np.array_split(rotating, LONGER):
        if lanes.size:
            start = outcome.end_state[lanes]
            again = _second_look(system.of(lanes), start, plan, labels.motion[lanes])
            labels.motion[lanes] = again
    return labels


def _record(system: System, outcome: Outcome, most_points: int) -> Record:
    return Record(
        outcome.section[:, -most_points:],
        outcome.growth,
        outcome.status != Status.OK,
        _admits_tori(system),
    )


def _second_look(
    system: System, start: NDArray[np.float64], plan: Plan, motion: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Tell by a longer record, which begins where theirs ended, whether lanes are on a torus."""
    longer = plan._replace(
        transient_periods=0,
        recorded_periods=LONGER * plan.recorded_periods,
        section_points=LONGER * min(MOST_POINTS, plan.recorded_periods),
    )
    again = integrate(system, start, longer)
    found = label(_record(system, again, longer.section_points)).motion
    seen = (motion == QUASI_PERIODIC) | (found == QUASI_PERIODIC)
    contradicted = np.isin(found, (PERIODIC, CHAOTIC, DIVERGED))
    torus = seen & ~contradicted & (subsequence_spread(again.section) <= WHOLE)
    told = np.where(torus, QUASI_PERIODIC, UNRESOLVED)
    told[found == CHAOTIC] = CHAOTIC
    return told.astype(np.uint8)


def _admits_tori(system: System) -> NDArray[np.bool_]:
    """Whether quasi-periodic motion can exist at all.

    With two states and damping the period map contracts every area by the same factor; a closed
    curve that it maps onto itself would enclose an area that stays the same.
    """
    if len(system.states) > 2:
        return np.ones(system.lanes, dtype=np.bool_)
    return sum_of_exponents(system) >= 0.0


def _settle(
    system: System, outcome: Outcome, plan: Plan, labels: Labels, period: NDArray[np.int32]
) -> None:
    """Give the lanes that have come close to a stable orbit its period, in place."""
    searched = period > 0
    for n in range(1, int(period.max(initial=0)) + 1):
        tried = np.flatnonzero(searched & (period % n == 0))
        if not tried.size:
            continue
        end = outcome.end_state[tried]
        periods = np.full(tried.size, n, dtype=np.int32)
        orbits = polish(system.of(tried), end, periods, plan.steps_per_period, plan.method)
        apart = np.abs(orbits.points - end) / coordinate_scale(outcome.section[tried])
        settled = tried[(np.max(apart, axis=1) <= SETTLING) & orbits.stable]
        searched[settled] = False
        labels.motion[settled] = PERIODIC
        labels.period[settled] = n
        labels.return_distance[settled] = return_distances(outcome.section[settled])[:, n - 1]
