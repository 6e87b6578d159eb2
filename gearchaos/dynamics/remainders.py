"""What the transient has left of the distance between a section and its periodic orbit.

Half the step does not show it: both grids are as far away. The orbit itself is known from Newton's
method, see `orbits.polish`.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Plan, integrate

from gearchaos.arrays import Counts, Floats, Integers
from gearchaos.dynamics.orbits import Orbits, polish
from gearchaos.dynamics.stability import fewest_stable_steps

EPSILON = float(np.finfo(np.float64).eps)


class Remainders(NamedTuple):
    """How far periodic lanes are from their orbits, and what rounding makes of them.

    ``distance`` (lanes,): largest distance of the section from the stable orbit over the last
    period of the orbit; ``of_kept`` (lanes,): the same over all kept points; ``decay`` (lanes,):
    rate at which they fall, per mesh period; ``section_rounding`` and ``exponent_rounding``
    (lanes,): errors of the section and of the exponents of the orbit by rounding alone. All are not
    a number where no stable orbit was found.
    """

    distance: Floats
    of_kept: Floats
    decay: Floats
    section_rounding: Floats
    exponent_rounding: Floats


def remainders(
    system: LaneSystem,
    section: Floats,
    kept: tuple[int, Sequence[int]],
    period: Counts,
    state: Floats,
    plan: Plan,
) -> Remainders:
    """Measure how far the sections of periodic lanes are from the orbits that they approach.

    Parameters
    ----------
    system : LaneSystem
        Lanes of the kernels.
    section : array, shape (lanes, points, states)
        Points of the section once an excitation period, all states.
    kept : tuple of an int and ints
        How many of these points the file keeps, the last ones, and which states are compared.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where a lane is not periodic.
    state : array, shape (lanes, states)
        State next to the orbit, as the look that labelled the lane left it.
    plan : Plan
        Of it only method and steps per period count.

    Returns
    -------
    Remainders
        Distances and floors; not a number where a lane is not periodic.
    """
    found = Remainders(*np.full((len(Remainders._fields), period.size), np.nan))
    points, columns = kept
    lanes = np.flatnonzero((period > 0) & np.isfinite(state).all(axis=1))
    if not lanes.size:
        return found
    orbits = polish(system.of(lanes), state[lanes], period[lanes], plan)
    for n in np.unique(period[lanes[orbits.stable]]).tolist():
        some = np.flatnonzero(orbits.stable & (period[lanes] == n))
        chosen = lanes[some]
        fields: Any = (field[some] for field in orbits)
        part = Orbits(*fields)
        orbit = _orbit_section(system.of(chosen), part, n, plan)
        compared, own = section[chosen][..., columns], orbit[..., columns]
        found.distance[chosen] = _distance(compared[:, -n:], own)
        found.of_kept[chosen] = _distance(compared[:, -max(n, points) :], own)
        own_floors = _decay_and_rounding(system.of(chosen), part, orbit, plan)
        for array, values in zip(found[2:], own_floors, strict=True):
            array[chosen] = values
    return found


def _orbit_section(system: LaneSystem, orbits: Orbits, period: int, plan: Plan) -> Floats:
    """Return the section of orbits over one period, shape (lanes, period, states)."""
    whole = period * system.repeats_after
    once = Plan(plan.steps_per_period, 0, whole, whole, tangent=True, method=plan.method)
    points = orbits.points
    # Newton's method stopped at a small distance; a last step takes it to rounding.
    left = integrate(system, points, once).end_state - points
    points = points + np.einsum("lij,lj->li", _resolvent(orbits.monodromy), left)
    return integrate(system, points, once).every(system.repeats_after).section


def _decay_and_rounding(
    system: LaneSystem, orbits: Orbits, orbit: Floats, plan: Plan
) -> tuple[Floats, Floats, Floats]:
    """Return the decay to orbits, and what rounding makes of their sections and exponents.

    Each of the N steps of a period rounds by about eps in parts of the motion x. With J the
    monodromy matrix, such errors add up to N eps |x| |(1 - J)^-1| on the orbit. Its largest
    multiplier mu has an error of about N eps |J|, and the exponent one of N eps |J| / |mu| over the
    period. Flow maps are divided, so that N is at least the fewest stable steps of RK4. ``orbit``
    (lanes, points, states): the section over one period.
    """
    periods = orbit.shape[1] * system.repeats_after
    largest = np.abs(orbits.multipliers[:, 0])
    steps = np.maximum(plan.steps_per_period, fewest_stable_steps(system))
    rounding, size = EPSILON * periods * steps, np.max(np.abs(orbit), axis=(1, 2))
    of_section = rounding * size * _norm(_resolvent(orbits.monodromy))
    # A multiplier that is 0 but for underflow gives no exponent.
    share = _norm(orbits.monodromy) / np.maximum(largest, np.finfo(np.float64).tiny)
    of_exponent = rounding * share / (periods * system.mesh_period)
    decay = -np.log(np.maximum(largest, np.finfo(np.float64).tiny)) / periods
    return decay, of_section, of_exponent


def _resolvent(monodromy: Floats) -> Floats:
    """Return (1 - J)^-1 of stable orbits, by which an error of the map moves the orbit."""
    identity: Floats = np.eye(monodromy.shape[-1])
    return np.linalg.inv(identity - monodromy).astype(np.float64, copy=False)


def _norm(matrices: Floats) -> Floats:
    """Return the largest sum of a row's magnitudes of every matrix, shape (lanes,)."""
    norm: Floats = np.max(np.sum(np.abs(matrices), axis=2), axis=1)
    return norm


def _distance(section: Floats, orbit: Floats) -> Floats:
    """Return the largest distance of the points of a section from those of the orbit.

    The phase at which the section ends is that with the smallest distance.
    """
    period, points = orbit.shape[1], section.shape[1]
    ends: Integers = np.arange(points) - points
    phases = (section - orbit[:, (ends + shift) % period] for shift in range(period))
    distance: Floats = np.min([np.max(np.abs(apart), axis=(1, 2)) for apart in phases], axis=0)
    return distance
