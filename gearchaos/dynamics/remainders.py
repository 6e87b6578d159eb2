"""The distance between a section and its periodic orbit that remains after the transient.

Halving the step does not show this distance, because it is the same on both grids. The orbit itself
comes from Newton's method, see `orbits.polish`.
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
    """Distances of periodic lanes from their orbits, and the rounding errors of the orbits.

    Attributes
    ----------
    distance : array, shape (lanes,)
        Largest distance between section and stable orbit over the last period of the orbit.
    of_kept : array, shape (lanes,)
        Largest distance over all kept points.
    decay : array, shape (lanes,)
        Decay rate of these distances per mesh period.
    section_rounding, exponent_rounding : array, shape (lanes,)
        Errors of the section and of the exponents of the orbit from rounding alone. All arrays are
        NaN where no stable orbit was found.
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
    """Measure the distance between the sections of periodic lanes and their orbits.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    section : array, shape (lanes, points, states)
        Section once per excitation period, all states.
    kept : tuple of int and ints
        Number of section points in the file, counted from the end, and columns of the compared
        states.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where a lane is not periodic.
    state : array, shape (lanes, states)
        State next to the orbit, from `labels_of`.
    plan : Plan
        Method and steps per period.

    Returns
    -------
    Remainders
        Distances and rounding errors; NaN where a lane is not periodic.
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
    once = plan.over(period * system.repeats_after)
    points = orbits.points
    # Newton's method stops at a small distance; one more step reduces it to rounding.
    left = integrate(system, points, once).end_state - points
    points = points + np.einsum("lij,lj->li", _resolvent(orbits.monodromy), left)
    return integrate(system, points, once).every(system.repeats_after).section


def _decay_and_rounding(
    system: LaneSystem, orbits: Orbits, orbit: Floats, plan: Plan
) -> tuple[Floats, Floats, Floats]:
    """Return the decay towards orbits, and the rounding errors of sections and exponents, (lanes,).

    Each of the N steps of a period has a rounding error of about eps relative to the motion x. With
    J the monodromy matrix, the errors add up to N eps |x| |(1 - J)^-1| on the orbit. The largest
    multiplier mu has an error of about N eps |J|, and the exponent an error of N eps |J| / |mu|
    over the period. An exact method computes in smaller steps, so that N is at least the stability
    limit of the default method. ``orbit`` (lanes, points, states): section over one period.
    """
    periods = orbit.shape[1] * system.repeats_after
    largest = np.abs(orbits.multipliers[:, 0])
    steps = np.maximum(plan.steps_per_period, fewest_stable_steps(system))
    rounding, size = EPSILON * periods * steps, np.max(np.abs(orbit), axis=(1, 2))
    of_section = rounding * size * _norm(_resolvent(orbits.monodromy))
    # A multiplier that underflows to 0 has no logarithm.
    share = _norm(orbits.monodromy) / np.maximum(largest, np.finfo(np.float64).tiny)
    of_exponent = rounding * share / (periods * system.mesh_period)
    decay = -np.log(np.maximum(largest, np.finfo(np.float64).tiny)) / periods
    return decay, of_section, of_exponent


def _resolvent(monodromy: Floats) -> Floats:
    """Return (1 - J)^-1 of stable orbits (lanes, states, states): orbit error per map error."""
    identity: Floats = np.eye(monodromy.shape[-1])
    return np.linalg.inv(identity - monodromy).astype(np.float64, copy=False)


def _norm(matrices: Floats) -> Floats:
    """Return the largest row sum of magnitudes of every matrix, shape (lanes,)."""
    norm: Floats = np.max(np.sum(np.abs(matrices), axis=2), axis=1)
    return norm


def _distance(section: Floats, orbit: Floats) -> Floats:
    """Return the largest distance between the points of a section and of the orbit, (lanes,).

    The phase of the orbit at the end of the section is the phase with the smallest distance.
    """
    period, points = orbit.shape[1], section.shape[1]
    ends: Integers = np.arange(points) - points
    phases = (section - orbit[:, (ends + shift) % period] for shift in range(period))
    distance: Floats = np.min([np.max(np.abs(apart), axis=(1, 2)) for apart in phases], axis=0)
    return distance
