"""Gaps of the elements along a motion: at every step, and as polynomials within a step.

A gap over a step is the polynomial with which the method itself looks for crossings: the cubic
through value and rate at both ends for RK4, and the exact series for flow maps and Taylor series. A
motion therefore grazes a flank where the method begins to find a contact.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.batch import scene_of
from gearchaos_kernels.compilation import evaluator
from gearchaos_kernels.contact.branches import flank_at
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.evaluation import WITHOUT_LOOP, after_step
from gearchaos_kernels.memory.block_memory import aligned_memory, fill, fill_lane, state_of
from gearchaos_kernels.memory.rows import STATE, rows
from gearchaos_kernels.methods.registry import METHODS
from gearchaos_kernels.models.interfaces import (
    begin_period,
    forcing_at,
    from_kept,
    gaps_at,
    grid_at,
    half_clearances,
    point_at,
)
from gearchaos_kernels.models.lane_system import LaneSystem
from gearchaos_kernels.plan import Floats, Plan
from gearchaos_kernels.scene import provider_of


class Gaps(NamedTuple):
    """Gaps of all elements along a motion.

    Attributes
    ----------
    value, rate : array, shape (lanes, samples, elements)
        The gaps in the units of the equations, and their rates per step.
    flank : array of int, shape (lanes, samples, elements)
        0 without contact, 1 on the driving flank, 2 on the back flank.
    half_clearance : array, shape (lanes, elements)
        Where the driving flank is; the back flank is at its negative.
    """

    value: Floats
    rate: Floats
    flank: NDArray[np.uint8]
    half_clearance: Floats


def gaps_along(system: LaneSystem, states: Floats, steps_per_period: int) -> Gaps:
    """Return the gaps along a motion that begins at mesh phase 0.

    Parameters
    ----------
    system : LaneSystem
        The equations of motion of every lane.
    states : array, shape (lanes, samples, states)
        States in the units of the equations, one step apart.
    steps_per_period : int
        Samples per mesh period.

    Returns
    -------
    Gaps
        The gaps at all samples.

    Examples
    --------
    ::

        outcome = integrate(system, start, Plan(200, 100, 10, 1, history_periods=2))
        closest = gaps_along(system, outcome.history, 200).value.max(axis=1)
    """
    step = system.mesh_period / steps_per_period
    known = system.known_gaps(states, steps_per_period)
    if known is not None:
        of_matrices = Gaps(*known)
        return of_matrices._replace(rate=of_matrices.rate * step[:, np.newaxis, np.newaxis])
    scene = scene_of(system, WITHOUT_LOOP)
    lanes, samples, _ = states.shape
    elements = provider_of(scene.model).elements(scene.model)
    found = Gaps(
        np.zeros((lanes, samples, elements)),
        np.zeros((lanes, samples, elements)),
        np.zeros((lanes, samples, elements), dtype=np.uint8),
        np.zeros((lanes, elements)),
    )
    tables = system.tables(steps_per_period)
    given = np.ascontiguousarray(states, dtype=np.float64)
    _follow_gaps(
        system.coefficients(step),
        system.scales(step),
        tables,
        steps_per_period,
        given,
        found,
        scene,
    )
    return found


@evaluator
def _follow_gaps(coefficients, scales, tables, steps, states, found, scene):
    """Write the gaps at every sample, lane by lane."""
    memory = aligned_memory(rows(scene).total)
    for index in range(states.shape[0]):
        lane = fill_lane(memory, 0, coefficients[index], scene)
        clearances = half_clearances(lane, scene)
        for sample in range(states.shape[1]):
            fill(memory, STATE, 0, scales[index], states[index, sample])
            kept = state_of(memory, 0, scene)
            row = 2 * (sample % steps)
            if row == 0:
                begin_period(memory, 0, index, sample // steps, tables, scene)
            if scene.switches is not None:
                if sample > 0:
                    lane = after_step(memory, (sample - 1) % steps, scene)
            point = point_at(memory, 0, grid_at(tables, row, scene), scene)
            forcing = forcing_at(lane, point, scene)
            gaps = gaps_at(from_kept(kept, forcing, scene), lane, forcing, scene)
            for element in range(len(gaps)):
                half_clearance = 0.0 if scene.clearance is None else clearances[element]
                found.half_clearance[index, element] = half_clearance
                found.value[index, sample, element] = gaps[element].value
                found.rate[index, sample, element] = gaps[element].closing
                found.flank[index, sample, element] = flank_at(
                    gaps[element].value, half_clearance, kinds(scene)[element]
                )


def steps_taken(system: LaneSystem, plan: Plan) -> int:
    """Return the most steps per period that the method takes for any lane of a system.

    Parameters
    ----------
    system : LaneSystem
        The lanes.
    plan : Plan
        How they are integrated.

    Returns
    -------
    int
        Those of the plan, or a multiple where flow maps need shorter steps.

    Examples
    --------
    ::

        plan = plan._replace(steps_per_period=steps_taken(system, plan))
    """
    most = plan.steps_per_period
    recorded = np.full(system.lanes, plan.recorded_periods, dtype=np.intp)
    for share in METHODS[plan.method].prepare(system, plan, scene_of(system, plan), recorded):
        most = max(most, int(share.steps[share.order].max(initial=0)))
    return most


def gap_polynomials(
    system: LaneSystem, plan: Plan, states: Floats, gaps: Gaps, at: tuple[NDArray[Any], int]
) -> Floats:
    """Return the gap of an element over one step of each lane, as a polynomial.

    Parameters
    ----------
    system : LaneSystem
        The equations of motion of every lane.
    plan : Plan
        Its method takes exactly the steps of the plan, see `steps_taken`.
    states : array, shape (lanes, samples, states)
        States at every step, from mesh phase 0.
    gaps : Gaps
        The gaps of these states.
    at : (array of int, int)
        Number of the sample with which the step of each lane begins, shape (lanes,), and the
        element.

    Returns
    -------
    array, shape (lanes, terms)
        Factors of the powers of s, which runs from -1 to 1 over the step. The gap continues along
        the contact branches with which the step begins.

    Examples
    --------
    ::

        gaps = gaps_along(system, outcome.history, plan.steps_per_period)
        terms = gap_polynomials(system, plan, outcome.history, gaps, (np.array([7]), 0))
    """
    samples, element = at
    lanes = np.arange(samples.size)
    exact = METHODS[plan.method].gap_terms
    if exact is not None:
        flanks = gaps.flank[lanes, samples]
        terms = exact(system, plan, scene_of(system, plan), states[lanes, samples], flanks, at)
        # The constant part of a gap is not in the maps.
        begin = terms @ (-1.0) ** np.arange(terms.shape[1])
        terms[:, 0] += gaps.value[lanes, samples, element] - begin
        return np.asarray(terms)
    before, after = (gaps.value[lanes, samples + n, element] for n in (0, 1))
    # Rates per s: a step has length 2.
    slope, end = (0.5 * gaps.rate[lanes, samples + n, element] for n in (0, 1))
    rise, mean = 0.5 * (after - before), 0.5 * (after + before)
    bend, twist = 0.25 * (end - slope), 0.25 * (slope + end) - 0.5 * rise
    return np.stack([mean - bend, rise - twist, bend, twist], axis=1)
