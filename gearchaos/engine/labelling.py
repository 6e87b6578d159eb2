"""Labels of integrated lanes: what their records tell, and Newton's method where they settle."""

from __future__ import annotations

import numpy as np
from gearchaos_kernels import STATE_ROWS, Outcome, Plan, Status
from numpy.typing import NDArray

from gearchaos.dynamics.exponents import sum_of_exponents
from gearchaos.dynamics.orbits import polish
from gearchaos.engine.sweep_lanes import SweepLanes
from gearchaos.records.bands import dealt_parts_differ_by
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

Numbers = NDArray[np.intp]

LONGER = 4
"""How many times the record a lane that may be on a torus goes on, to be looked at once more."""

WHOLE = 0.25
"""Largest difference of the parts of a curve, see `dealt_parts_differ_by`."""


def labelling_plan(sweep: SweepLanes) -> Plan:
    """Return the plan of a sweep, with all states of enough mesh periods to label the motion."""
    enough = min(MOST_POINTS, sweep.plan.recorded_periods)
    return sweep.plan._replace(
        section_states=tuple(sweep.states),
        section_points=max(sweep.plan.section_points, enough),
    )


def labels_of(sweep: SweepLanes, lanes: Numbers, outcome: Outcome) -> Labels:
    """Label lanes that were integrated with `labelling_plan`.

    Parameters
    ----------
    sweep : SweepLanes
    lanes : ndarray of int, shape (lanes,)
        Their numbers in the sweep.
    outcome : Outcome
        Of these lanes.
    """
    record = _record(sweep, lanes, outcome)
    labels = label(record)
    _settle(sweep, lanes, outcome, labels, settling_periods(record, labels))
    rotating = np.flatnonzero((labels.motion == QUASI_PERIODIC) | may_rotate_slowly(record, labels))
    # In parts whose longer records take no more memory than those of all lanes.
    for part in np.array_split(rotating, LONGER):
        if part.size:
            labels.motion[part] = _second_look(sweep, lanes[part], outcome, part, labels)
    return labels


def _record(
    sweep: SweepLanes, lanes: Numbers, outcome: Outcome, most_points: int = MOST_POINTS
) -> Record:
    return Record(
        outcome.section[:, -most_points:],
        outcome.growth,
        outcome.status != Status.OK,
        _admits_tori(sweep, lanes),
    )


def _second_look(
    sweep: SweepLanes, lanes: Numbers, outcome: Outcome, part: Numbers, labels: Labels
) -> NDArray[np.uint8]:
    """Tell by a longer record, which begins where theirs ended, whether lanes are on a torus."""
    plan = labelling_plan(sweep)
    longer = plan._replace(
        transient_periods=0,
        recorded_periods=LONGER * plan.recorded_periods,
        section_points=LONGER * min(MOST_POINTS, plan.recorded_periods),
    )
    again = sweep.integrate(lanes, outcome.end_state[part], longer)
    found = label(_record(sweep, lanes, again, longer.section_points)).motion
    seen = (labels.motion[part] == QUASI_PERIODIC) | (found == QUASI_PERIODIC)
    contradicted = np.isin(found, (PERIODIC, CHAOTIC, DIVERGED))
    torus = seen & ~contradicted & (dealt_parts_differ_by(again.section) <= WHOLE)
    motion = np.where(torus, QUASI_PERIODIC, UNRESOLVED)
    motion[found == CHAOTIC] = CHAOTIC
    return motion.astype(np.uint8)


def _admits_tori(sweep: SweepLanes, lanes: Numbers) -> NDArray[np.bool_]:
    """Whether quasi-periodic motion can exist at all.

    With two states and damping the period map contracts every area by the same factor; a closed
    curve that it maps onto itself would enclose an area that stays the same.
    """
    if len(sweep.states) > 2:
        return np.ones(lanes.size, dtype=np.bool_)
    return sum_of_exponents(sweep.scene, sweep.model_of(lanes)) >= 0.0


def _settle(
    sweep: SweepLanes,
    lanes: Numbers,
    outcome: Outcome,
    labels: Labels,
    period: NDArray[np.int32],
) -> None:
    """Give the lanes that have come close to a stable orbit its period, in place."""
    columns = [STATE_ROWS[name] for name in sweep.states]
    searched = period > 0
    for n in range(1, int(period.max(initial=0)) + 1):
        tried = np.flatnonzero(searched & (period % n == 0))
        if not tried.size:
            continue
        orbits = polish(
            sweep.scene,
            sweep.model_of(lanes[tried]),
            *sweep.harmonics(),
            outcome.end_state[tried],
            np.full(tried.size, n, dtype=np.int32),
            sweep.plan.steps_per_period,
            rederived=sweep.config.formulation == "rederived",
        )
        apart = np.abs(orbits.points - outcome.end_state[tried])[:, columns]
        close = np.max(apart / coordinate_scale(outcome.section[tried]), axis=1) <= SETTLING
        settled = tried[close & orbits.stable]
        searched[settled] = False
        labels.motion[settled] = PERIODIC
        labels.period[settled] = n
        labels.return_distance[settled] = return_distances(outcome.section[settled])[:, n - 1]
