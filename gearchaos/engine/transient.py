"""A transient that is long enough for a tolerance: its remainder is part of a section's error."""

import math

import numpy as np
from gearchaos_kernels import Plan, integrate

from gearchaos.arrays import Integers
from gearchaos.dynamics.labelling import labels_of
from gearchaos.dynamics.remainders import remainders
from gearchaos.engine.claims import columns_of
from gearchaos.engine.lanes import Lanes
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.records.difference import bound

LONGEST_FACTOR = 16
"""Largest transient, as a multiple of the configured transient and record together."""

ROUNDS = 4
"""Largest number of trials: the approach to an orbit is geometric only in the end."""


def choose_transient(
    lanes: Lanes, recording: Plan, kept_points: int, tolerance: float, count: int
) -> tuple[int, float, str]:
    """Return a transient after which the kept section is close enough to the periodic orbits.

    Some lanes are integrated as in the sweep, and their sections are compared with their orbits.
    The transient is raised until 95 % of the periodic lanes are within half the tolerance.

    Parameters
    ----------
    lanes : Lanes
        Lanes of the sweep.
    recording : Plan
        Plan of the sweep with all section points for labels.
    kept_points : int
        Section points in the file.
    tolerance : float
        Largest error of the section.
    count : int
        Number of trial lanes, spread evenly over the sweep.

    Returns
    -------
    tuple of int, float and str
        Transient in mesh periods; distance from the orbits afterwards that 95 % of the periodic
        lanes do not exceed, 0 if none is periodic; a note, empty if nothing was raised.

    Raises
    ------
    ConfigurationError
        If the transient would exceed `LONGEST_FACTOR` times the configured length.
    """
    numbers, repeats = lanes.spread(count), lanes.repeats_after
    configured = transient = recording.transient_periods
    most = LONGEST_FACTOR * (configured + recording.recorded_periods)
    distances = []
    for _ in range(ROUNDS):
        plan = recording._replace(transient_periods=transient)
        distance, missing = _left(lanes, numbers, plan, kept_points, tolerance)
        distances.append(distance)
        if missing == 0.0:
            break
        if transient + missing > most:
            raise ConfigurationError(_out_of_reach(lanes, tolerance, distance, transient, missing))
        transient += repeats * math.ceil(missing / repeats)
    note = ""
    if transient > configured:
        note = _raised(configured, transient, tolerance, distances[0])
    return transient, distances[-1], note


def _left(
    lanes: Lanes, numbers: Integers, plan: Plan, kept_points: int, tolerance: float
) -> tuple[float, float]:
    """Return the distance of some lanes from their orbits, and the missing transient.

    95 % of the periodic lanes do not exceed either number. The second, in mesh periods, is 0 if the
    distance is within half the tolerance or is rounding error.
    """
    check()
    system = lanes.system_of(numbers)
    outcome = integrate(system, lanes.start_of(numbers), plan)
    labelled = labels_of(system, outcome, plan)
    points = -(-kept_points // system.repeats_after)
    kept = points, columns_of(system, lanes.config.outputs.section)
    section = outcome.every(system.repeats_after).section
    left = remainders(system, section, kept, labelled.labels.period, labelled.state, plan)
    distance = float(np.nan_to_num(bound(left.of_kept)))
    if distance <= tolerance / 2.0:
        return distance, 0.0
    # The rounding error does not decrease with time.
    far = left.of_kept > np.maximum(tolerance / 4.0, 8.0 * left.section_rounding)
    further = np.where(np.isfinite(left.of_kept), 0.0, np.nan)
    further[far] = np.log(4.0 * left.of_kept[far] / tolerance) / left.decay[far]
    return distance, bound(further)


def _raised(configured: int, transient: int, tolerance: float, distance: float) -> str:
    """Return the note about a transient that was raised."""
    return (
        f"integration.transient_periods raised from {configured} to {transient} for "
        f"integration.tolerance = {tolerance:g}: the section was up to {distance:.1e} away "
        "from the periodic orbits, which no number of steps changes"
    )


def _out_of_reach(
    lanes: Lanes, tolerance: float, distance: float, transient: int, missing: float
) -> str:
    """Return the message that no transient of valid length is enough."""
    return (
        f"{lanes.config.source}: integration.tolerance = {tolerance:g}: after "
        f"integration.transient_periods = {transient} the section is still {distance:.1e} away "
        "from the periodic orbits, which no number of steps changes; set "
        f"integration.transient_periods to {transient + math.ceil(missing)} or more, or a larger "
        "tolerance"
    )
