"""Labels of integrated lanes, from their records and from Newton's method where they settle."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan, Status, integrate

from gearchaos.arrays import Counts, Floats, Integers, Mask
from gearchaos.dynamics.exponents import period_jacobian, sum_of_exponents
from gearchaos.dynamics.orbits import polish
from gearchaos.records import label
from gearchaos.records.bands import band_count, subsequence_spread
from gearchaos.records.period import coordinate_scale, return_distances

LONGER_RECORDS = (4, 16)
"""Lengths of the longer records of doubtful lanes, as multiples of the record."""

LONGER_RECORD_BYTES = 2**25
"""Memory that longer records may always take: lanes side by side are faster."""

WHOLE = 0.25
"""Largest difference between the subsequences of a curve, see `subsequence_spread`."""


MARGIN = 1e-9
"""Distance between a multiplier and the unit circle that rounding does not explain."""


class Labelled(NamedTuple):
    """Labels of lanes and the states at which they were found.

    Attributes
    ----------
    labels : Labels
        The labels.
    state : array, shape (lanes, states)
        State at the end of the record from which each label was taken.
    """

    labels: label.Labels
    state: Floats


def labels_of(system: LaneSystem, outcome: Outcome, plan: Plan) -> Labelled:
    """Label lanes by their records.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    outcome : Outcome
        Outcome of their integration, with `MOST_LABEL_POINTS` section points per lane or, in a
        shorter record, all of them.
    plan : Plan
        Plan of that integration, over whole excitation periods.

    Returns
    -------
    Labelled
        Labels and states. Lanes that are `doubtful` are labelled by a longer record that begins at
        the end of theirs. If they are still unresolved, an even longer record follows.
    """
    repeats = system.repeats_after
    outcome = outcome.every(repeats)
    labels = _label_record(system, outcome, plan, label.MOST_LABEL_POINTS)
    lanes = np.flatnonzero(label.doubtful(outcome.growth, labels))
    state, tangent = outcome.end_state.copy(), outcome.end_tangent.copy()
    ended = plan.first_period + plan.transient_periods + plan.recorded_periods
    for longer in LONGER_RECORDS:
        points = longer * min(label.MOST_LABEL_POINTS * repeats, plan.recorded_periods)
        lengths = plan.steps_per_period, 0, longer * plan.recorded_periods, points
        further = Plan(*lengths, plan.tangent, plan.resolved, method=plan.method)
        further = further._replace(first_period=ended)
        ended += further.recorded_periods
        # In portions, so that longer records take no more memory than the records of all lanes.
        record = 8 * (further.section_points * state.shape[1] + further.recorded_periods)
        size = max(1, system.lanes // longer, LONGER_RECORD_BYTES // record)
        for first in range(0, lanes.size, size):
            some = lanes[first : first + size]
            part = system.of(some)
            again = integrate(part, state[some], further, tangent_start=tangent[some])
            again = again.every(repeats)
            state[some], tangent[some] = again.end_state, again.end_tangent
            found = _label_longer_record(part, again, further)
            labels.motion[some], labels.period[some] = found.motion, found.period
            labels.bands[some] = found.bands
            _measure_return(labels, outcome.section, some[found.period > 0])
        sound = np.isfinite(state[lanes]).all(axis=1)
        lanes = lanes[sound & (labels.motion[lanes] == label.UNRESOLVED)]
    # A lane that is too fast for the steps has an unknown motion; it need not diverge.
    labels.motion[outcome.status == Status.TOO_FAST] = label.UNRESOLVED
    return Labelled(labels, state)


def _label_record(
    system: LaneSystem, outcome: Outcome, plan: Plan, most_points: int
) -> label.Labels:
    """Return the labels from one record, with the last ``most_points`` section points."""
    section, diverged = outcome.section[:, -most_points:], outcome.status != Status.OK
    record = label.Record(section, outcome.growth, diverged, admits_tori(system))
    labels = label.label(record)
    if not system.clearance and system.control is None:
        _label_linear(system, plan, labels)
    _settle(system, outcome, plan, labels, label.settling_periods(record, labels))
    lanes = np.flatnonzero(np.isin(labels.motion, (label.CHAOTIC, label.QUASI_PERIODIC)))
    labels.bands[lanes] = band_count(section[lanes])
    return labels


def _label_longer_record(system: LaneSystem, outcome: Outcome, plan: Plan) -> label.Labels:
    """Return the labels from a longer record; a torus that may be a cascade is unresolved."""
    labels = _label_record(system, outcome, plan, plan.section_points)
    tori = np.flatnonzero(labels.motion == label.QUASI_PERIODIC)
    hopping = tori[subsequence_spread(outcome.section[tori]) > WHOLE]
    # A lane that diverges only here has not diverged in the record that is kept.
    refused = np.concatenate([hopping, np.flatnonzero(labels.motion == label.DIVERGED)])
    labels.motion[refused], labels.bands[refused] = label.UNRESOLVED, 0
    return labels


def _label_linear(system: LaneSystem, plan: Plan, labels: label.Labels) -> None:
    """Label unbounded growth from the multipliers, in place: a linear system is never chaotic."""
    once = plan._replace(recorded_periods=system.repeats_after)
    jacobian = period_jacobian(system, np.zeros((system.lanes, len(system.states))), once)
    size = np.max(np.abs(np.linalg.eigvals(np.nan_to_num(jacobian))), axis=1)
    grows = size > 1.0 + MARGIN
    labels.motion[grows] = label.GROWS
    labels.period[grows] = 0
    # Without damping, a forced oscillation lies on a torus.
    settles = (labels.motion == label.QUASI_PERIODIC) & (size < 1.0 - MARGIN)
    labels.motion[settles | (labels.motion == label.CHAOTIC) & ~grows] = label.UNRESOLVED


def _measure_return(labels: label.Labels, section: Floats, lanes: Integers) -> None:
    """Store the return distances after the own period of some lanes, in place."""
    distances = return_distances(section[lanes])
    labels.return_distance[lanes] = distances[np.arange(lanes.size), labels.period[lanes] - 1]


def admits_tori(system: LaneSystem) -> Mask:
    """Whether quasi-periodic motion can exist, (lanes,).

    With two states and damping, the period map contracts every area by the same factor. The area
    enclosed by an invariant closed curve would stay the same, so that there is no such curve. Nor
    is there one if a damper acts in contact only: some areas shrink, and none grows. A controller
    changes the factor.
    """
    if len(system.states) > 2 or system.control is not None:
        return np.ones(system.lanes, dtype=np.bool_)
    return sum_of_exponents(system, np.ones((system.lanes, system.elements))) >= 0.0


def _settle(
    system: LaneSystem, outcome: Outcome, plan: Plan, labels: label.Labels, period: Counts
) -> None:
    """Label lanes next to a stable orbit as periodic, in place; ``period`` (lanes,): to try."""
    searched = period > 0
    for n in range(1, int(period.max(initial=0)) + 1):
        tried = np.flatnonzero(searched & (period % n == 0))
        if not tried.size:
            continue
        end = outcome.end_state[tried]
        periods = np.full(tried.size, n, dtype=np.int32)
        orbits = polish(system.of(tried), end, periods, plan)
        apart = np.abs(orbits.points - end) / coordinate_scale(outcome.section[tried])
        settled = tried[(np.max(apart, axis=1) <= label.SETTLING) & orbits.stable]
        searched[settled] = False
        labels.motion[settled] = label.PERIODIC
        labels.period[settled] = n
        _measure_return(labels, outcome.section, settled)
