"""The largest exponent of every lane: of its orbit where the lane is periodic, or of its record."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan
from gearchaos_kernels.recorders.frame import SMALLEST_RESOLVED

from gearchaos.arrays import Codes, Counts, Floats
from gearchaos.dynamics.modes import memory
from gearchaos.dynamics.orbits import polish
from gearchaos.records.label import CHAOTIC_GROWTH
from gearchaos.records.lyapunov import largest_exponent

UNIFORM, MIXED, NOT_COMPARED = 0, 1, 2
RECORD_MEANINGS = ("uniform", "mixed", "unknown")
"""Meanings of the values of ``record``."""


class LargestExponents(NamedTuple):
    """Largest Lyapunov exponents of lanes, per unit of tau.

    Attributes
    ----------
    values, standard_errors : array, shape (lanes,)
        Exponents and the standard errors that follow from the finite record; the error is 0 where
        the exponent is that of an orbit.
    record : array of int, shape (lanes,)
        See `RECORD_MEANINGS`: mixed where the lane is periodic in the end but its record contains
        another motion. The last value means that there is no orbit to compare the record with.
    of_orbit : array, shape (lanes, states)
        All exponents of the orbit, largest first; NaN without an orbit, and where rounding hides
        them.
    """

    values: Floats
    standard_errors: Floats
    record: Codes
    of_orbit: Floats


def largest_exponents(
    system: LaneSystem, outcome: Outcome, plan: Plan, period: Counts, state: Floats
) -> LargestExponents:
    """Return the largest exponents of lanes, from their orbits or else from their records.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    outcome : Outcome
        Outcome with the growth of a tangent vector.
    plan : Plan
        Plan of that integration.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where a lane is not periodic.
    state : array, shape (lanes, states)
        State next to the orbit.

    Returns
    -------
    LargestExponents
        A periodic lane whose crossings are resolved has the exponent of its stable orbit. Neither
        the length of the record nor a transient at its beginning affects this value.
    """
    values, errors = largest_exponent(outcome.growth, system.mesh_period, memory(system))
    record = np.full(period.shape, NOT_COMPARED, dtype=np.uint8)
    of_orbit = np.full((period.size, len(system.states)), np.nan)
    found = LargestExponents(values, errors, record, of_orbit)
    lanes = np.flatnonzero((period > 0) & np.isfinite(values))
    if not plan.resolved or not lanes.size:
        return found
    orbits = polish(system.of(lanes), state[lanes], period[lanes], plan)
    # A multiplier that underflows to 0 has no logarithm.
    usable = orbits.stable & (np.abs(orbits.multipliers[:, 0]) > 0.0)
    lanes, size = lanes[usable], np.abs(orbits.multipliers[usable])
    duration = period[lanes] * system.excitation_period[lanes]
    resolved = size > SMALLEST_RESOLVED * size[:, :1]
    size = np.where(resolved, size, np.nan)
    of_orbit[lanes] = np.log(size) / duration[:, np.newaxis]
    over_record = outcome.growth.shape[1] * system.mesh_period[lanes]
    mixed = np.abs(values[lanes] - of_orbit[lanes, 0]) * over_record > CHAOTIC_GROWTH
    record[lanes] = np.where(mixed, MIXED, UNIFORM)
    values[lanes], errors[lanes] = of_orbit[lanes, 0], 0.0
    return found
