"""Evaluate the equations of motion on given states: Jacobian, and forces along a motion.

Both use the same compiled formulas as the methods of integration.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.batch import scene_of
from gearchaos_kernels.compilation import evaluator, scalar
from gearchaos_kernels.contact.branches import flank_at
from gearchaos_kernels.contact.elements import Push, pushes_of, tangent_pushes
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.memory.block_memory import (
    aligned_memory,
    fill,
    fill_lane,
    numbers_of_elements,
    read_lane,
    state_of,
    take,
    write_state,
)
from gearchaos_kernels.memory.rows import STATE, State, rows
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.models.interfaces import (
    accelerations,
    begin_period,
    elements_at,
    forcing_at,
    from_kept,
    gaps_at,
    grid_at,
    half_clearances,
    kept_accelerations,
    next_switch,
    observed_at,
    point_at,
    switch,
    unforced,
)
from gearchaos_kernels.models.lane_system import LaneSystem
from gearchaos_kernels.plan import Floats, Plan
from gearchaos_kernels.scene import Scene, provider_of

WITHOUT_LOOP = Plan(1, 0, 0, 0, resolved=False)
"""The plan of a scene without a loop: no resolved crossings, no tangent vector, no recorders."""


class Motion(NamedTuple):
    """Forces, contact and accelerations along a motion, in the units of the equations.

    Attributes
    ----------
    forces : array, shape (lanes, samples, elements)
        Forces of the elements.
    contact : array of int, shape (lanes, samples, elements)
        0 without contact, 1 on the driving flank, 2 on the back flank. An element without clearance
        is always in contact, and the sign of its gap decides the flank.
    accelerations : array, shape (lanes, samples, coordinates)
        Second derivatives of the coordinates of the scene, by tau.
    observed : array, shape (lanes, samples, signals)
        The observed signals of the model.
    """

    forces: Floats
    contact: NDArray[np.uint8]
    accelerations: Floats
    observed: Floats


def jacobian(system: LaneSystem, stiffnesses: Floats) -> Floats:
    """Return the Jacobian of the equations of motion on one contact branch.

    Parameters
    ----------
    system : LaneSystem
        The equations of motion of every lane.
    stiffnesses : array, shape (lanes, elements)
        Stiffness of each element relative to its mean; 0 without contact.

    Returns
    -------
    array, shape (lanes, states, states)
        d(x')/dx per unit of tau, in the units of the equations.

    Notes
    -----
    On a contact branch the equations x' = f(x, tau) are linear in x, so the Jacobian is exact. Its
    columns come from the variational equation, applied to unit vectors.

    Examples
    --------
    Natural frequencies per unit of tau, with every element in contact at mean stiffness::

        in_contact = np.ones((system.lanes, system.elements))
        frequencies = np.abs(np.linalg.eigvals(jacobian(system, in_contact)).imag)
    """
    slopes = np.ascontiguousarray(stiffnesses, dtype=np.float64)
    known = system.branch_jacobian(slopes)
    if known is not None:
        return known
    per_tau = np.ones(system.lanes)
    scales = system.scales(per_tau)
    result = np.empty((*scales.shape, scales.shape[1]))
    # Without excitation: it is no part of the linearisation and would only be compiled in vain.
    linear = system.linearised()
    scene = scene_of(linear, WITHOUT_LOOP)
    _differentiate(linear.coefficients(per_tau), scales, slopes, result, scene)
    return result


@evaluator
def _differentiate(coefficients, scales, slopes, result, scene):
    """Apply the variational equation to the unit vector of every state, lane by lane."""
    memory = aligned_memory(rows(scene).total)
    for index in range(scales.shape[0]):
        scale = scales[index]
        lane = fill_lane(memory, 0, coefficients[index], scene)
        elements = elements_at(lane, unforced(lane, scene), scene)
        shares = numbers_of_elements(slopes[index], 0, scene)
        held = each(push_of_share, elements, shares, kinds(scene))
        for column in range(scale.shape[0]):
            unit = np.zeros(scale.shape[0])
            unit[column] = 1.0
            fill(memory, STATE, 0, scale, unit)
            tangent = state_of(memory, 0, scene)
            pushes = tangent_pushes(tangent, lane, held, scene)
            change = accelerations(tangent, pushes, unforced(lane, scene), lane, scene)
            write_state(memory, STATE, 0, State(tangent.rate, change), scene)
            take(memory, STATE, 0, scale, result[index, :, column])


@scalar
def push_of_share(element, share, kind):
    """Return a push whose slope is a share of the mean stiffness of an element."""
    damped = share != 0.0 or not kind.damped_in_contact
    return Push(0.0, element.stiffness * share, element.damping if damped else 0.0)


def evaluate(
    system: LaneSystem, states: Floats, steps_per_period: int, first_period: int = 0
) -> Motion:
    """Return forces, contact, accelerations and observed signals along a motion.

    Parameters
    ----------
    system : LaneSystem
        The equations of motion of every lane.
    states : array, shape (lanes, samples, states)
        States in the units of the equations. Samples are one step apart; the first one is at mesh
        phase 0.
    steps_per_period : int
        Samples per mesh period.
    first_period : int, optional
        Number of mesh periods before the first sample.

    Returns
    -------
    Motion
        In the units of the equations.

    Examples
    --------
    ::

        outcome = integrate(system, start, Plan(200, 100, 10, 1, history_periods=2))
        largest_forces = evaluate(system, outcome.history, 200).forces.max(axis=1)
    """
    known = system.known_motion(states, steps_per_period)
    if known is not None:
        return Motion(*known)
    step = system.mesh_period / steps_per_period
    scene = scene_of(system, WITHOUT_LOOP)
    motion = _zero_motion(states, scene)
    _follow(
        system.coefficients(step),
        system.scales(step),
        system.tables(steps_per_period),
        steps_per_period,
        first_period,
        np.ascontiguousarray(states, dtype=np.float64),
        motion,
        scene,
    )
    steps = step[:, np.newaxis, np.newaxis]
    # Scaled forces are per step squared, and changes of rates per step.
    return motion._replace(
        forces=motion.forces / steps**2, accelerations=motion.accelerations / steps
    )


def _zero_motion(states: Floats, scene: Scene) -> Motion:
    """Return a motion of zeros for states of shape (lanes, samples, states)."""
    lanes, samples, count = states.shape
    model = provider_of(scene.model)
    elements = model.elements(scene.model)
    return Motion(
        np.zeros((lanes, samples, elements)),
        np.zeros((lanes, samples, elements), dtype=np.uint8),
        np.zeros((lanes, samples, count // 2)),
        np.zeros((lanes, samples, len(model.observed))),
    )


@scalar
def after_step(memory, number, scene):
    """Switch the lane of slot 0 as often as it does in a step; return its coefficients."""
    lane = read_lane(memory, 0, scene)
    done = float(number)
    while done < next_switch(lane, scene) <= number + 1.0:
        done = next_switch(lane, scene)
        switch(memory, 0, lane, scene)
        lane = read_lane(memory, 0, scene)
    return lane


@evaluator
def _follow(coefficients, scales, tables, steps, first_period, states, motion, scene):
    """Evaluate the equations at every sample, lane by lane, and write a `Motion` per step."""
    memory = aligned_memory(rows(scene).total)
    change = np.empty(scales.shape[1])
    for index in range(states.shape[0]):
        lane = fill_lane(memory, 0, coefficients[index], scene)
        clearances = half_clearances(lane, scene)
        for sample in range(states.shape[1]):
            fill(memory, STATE, 0, scales[index], states[index, sample])
            kept = state_of(memory, 0, scene)
            row = 2 * (sample % steps)
            if row == 0:
                begin_period(memory, 0, index, first_period + sample // steps, tables, scene)
            if scene.switches is not None:
                if sample > 0:
                    lane = after_step(memory, (sample - 1) % steps, scene)
            point = point_at(memory, 0, grid_at(tables, row, scene), scene)
            forcing = forcing_at(lane, point, scene)
            state = from_kept(kept, forcing, scene)
            gaps = gaps_at(state, lane, forcing, scene)
            pushes = pushes_of(gaps, elements_at(lane, forcing, scene), None, scene)
            for element in range(len(gaps)):
                motion.forces[index, sample, element] = pushes[element].force
                half_clearance = 0.0 if scene.clearance is None else clearances[element]
                motion.contact[index, sample, element] = flank_at(
                    gaps[element].value, half_clearance, kinds(scene)[element]
                )
            signals = observed_at(state, lane, point, scene)
            for number in range(len(signals)):
                motion.observed[index, sample, number] = signals[number]
            acceleration = accelerations(state, pushes, forcing, lane, scene)
            acceleration = kept_accelerations(acceleration, lane, point, scene)
            write_state(memory, STATE, 0, State(state.rate, acceleration), scene)
            take(memory, STATE, 0, scales[index], change)
            motion.accelerations[index, sample] = change[1::2]
