"""The largest exponent of the motion that lanes have come to: of its orbit where it is periodic."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan

from gearchaos.arrays import Codes, Counts, Floats
from gearchaos.dynamics.exponents import SMALLEST_RESOLVED
from gearchaos.dynamics.modes import memory
from gearchaos.dynamics.orbits import polish
from gearchaos.records.label import CHAOTIC_GROWTH
from gearchaos.records.lyapunov import largest_exponent

UNIFORM, MIXED, NOT_COMPARED = 0, 1, 2
RECORD_MEANINGS = ("uniform", "mixed", "not_told")  # Meanings of the values of ``record``.


class LargestExponents(NamedTuple):
    """Largest Lyapunov exponents per unit of tau, and what of their errors the record tells.

    ``values``, ``standard_errors`` (lanes,): the standard error is that of a finite record, and
    thus 0 where the exponent is that of an orbit; ``record`` (lanes,) of `RECORD_MEANINGS`: mixed where a
    lane is periodic in the end, but its record holds motion of another kind, and not told where
    there is no orbit to compare it with; ``of_orbit`` (lanes,
    states): all exponents of the orbit, the largest first, not a number where there is none and
    where rounding hides them.
    """

    values: Floats
    standard_errors: Floats
    record: Codes
    of_orbit: Floats


def largest_exponents(
    system: LaneSystem, outcome: Outcome, plan: Plan, period: Counts, state: Floats
) -> LargestExponents:
    """Tell the exponent of lanes from the multipliers of their orbits, or else from their records.

    A lane that is periodic and has its crossings resolved takes the exponent of the stable orbit
    next to its state (lanes, states): no finite record enters there, and a transient at its begin
    does not count. ``outcome``: with growth, integrated by ``plan``; ``period`` (lanes,) in
    excitation periods, 0 where a lane is not periodic.
    """
    values, errors = largest_exponent(outcome.growth, system.mesh_period, memory(system))
    record = np.full(period.shape, NOT_COMPARED, dtype=np.uint8)
    of_orbit = np.full((period.size, len(system.states)), np.nan)
    found = LargestExponents(values, errors, record, of_orbit)
    lanes = np.flatnonzero((period > 0) & np.isfinite(values))
    if not plan.resolved or not lanes.size:
        return found
    orbits = polish(system.of(lanes), state[lanes], period[lanes], plan)
    # A multiplier that is 0 but for underflow tells no exponent.
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
