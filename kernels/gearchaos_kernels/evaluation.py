"""Eq. 13 evaluated on given states: its Jacobian on contact branches, and the forces of a motion.

Both call the formulas that the Runge-Kutta steps call.
"""

import numpy as np

from gearchaos_kernels import rows
from gearchaos_kernels.block_memory import (
    aligned_memory,
    fill,
    fill_lane,
    flags,
    read_state,
    take,
    write_state,
)
from gearchaos_kernels.coefficients import lane_coefficients, state_scales
from gearchaos_kernels.compilation import evaluator
from gearchaos_kernels.contact import flank_at
from gearchaos_kernels.equations import (
    accelerations,
    from_rest,
    gaps_at,
    mesh_forces,
    tangent_forces,
)
from gearchaos_kernels.forcing import forcing_at, pitch_error_at
from gearchaos_kernels.rows import ANYWHERE, Directions, State
from gearchaos_kernels.system import Effects, Floats, MeshMotion, Plan, System
from gearchaos_kernels.teeth import engage, last_pair, point_on_grid, tables_of

_ALONE = Plan(1, 0, 0, 0, resolved=False)
"""No loop: nothing is split and no tangent vector carried along."""


def jacobian(system: System, tangential: Floats, axial: Floats) -> Floats:
    """Return the Jacobian of eq. 13 per unit of tau, shape (lanes, states, states).

    On one contact branch of either direction: ``tangential``, ``axial`` (lanes,) are kappa f' in
    N_y and in N_z, the relative mesh stiffness in contact and 0 without contact.
    """
    per_tau = np.ones(system.lanes)
    scales = state_scales(system, per_tau)
    result = np.empty((*scales.shape, scales.shape[1]))
    # What excites the pair is not part of its linearisation: it need not be compiled.
    linear = system._replace(
        effects=Effects(False, False, False, system.effects.transverse, system.effects.axial)
    )
    slopes = np.stack(np.broadcast_arrays(tangential, axial), axis=1)
    coefficients = lane_coefficients(system, per_tau)
    _differentiate(coefficients, scales, slopes, result, flags(linear, _ALONE))
    return result


@evaluator
def _differentiate(coefficients, scales, slopes, result, present):
    """Apply the tangent formula to the unit vector of every state, lane by lane."""
    memory = aligned_memory()
    for index in range(scales.shape[0]):
        scale = scales[index]
        lane = fill_lane(memory, 0, coefficients[index])
        stiffness = Directions(
            lane.mean_stiffness * slopes[index, 0],
            lane.axial_share * lane.mean_stiffness * slopes[index, 1],
        )
        for column in range(scale.shape[0]):
            unit = np.zeros(scale.shape[0])
            unit[column] = 1.0
            fill(memory, rows.STATE, 0, scale, unit)
            tangent = read_state(memory, rows.STATE, 0, present)
            forces = tangent_forces(tangent, lane, stiffness, present)
            change = State(tangent.rate, accelerations(tangent, forces, 0.0, lane, present))
            write_state(memory, rows.STATE, 0, change, present)
            take(memory, rows.STATE, 0, scale, result[index, :, column])


def mesh_motion(
    system: System, states: Floats, steps_per_period: int, first_period: int = 0
) -> MeshMotion:
    """Return forces, contact and accelerations along a motion (eqs 6, 7, 13, 22 and 23).

    Without clearance teeth never part, and the sign of the gap tells the flank. ``states`` (lanes,
    samples, states): one step apart, the first one at mesh phase 0, after so many mesh periods that
    the teeth have turned.
    """
    lanes, samples, count = states.shape
    step = system.mesh_period / steps_per_period
    motion = MeshMotion(
        np.zeros((lanes, samples)),
        np.zeros((lanes, samples)),
        np.zeros((lanes, samples), dtype=np.uint8),
        np.zeros((lanes, samples), dtype=np.uint8),
        np.zeros((lanes, samples, count // 2)),
        np.zeros((lanes, samples)),
    )
    present = flags(system, _ALONE)
    _follow(
        lane_coefficients(system, step),
        state_scales(system, step),
        step,
        tables_of(system, present, steps_per_period),
        last_pair(system, first_period),
        np.ascontiguousarray(states, dtype=np.float64),
        motion,
        present,
    )
    return motion


@evaluator
def _follow(coefficients, scales, steps, tables, first, states, motion, present):
    """Evaluate eq. 13 at every sample, lane by lane."""
    memory = aligned_memory()
    change = np.empty(scales.shape[1])
    table, shares, driving, driven, profile = tables
    for index in range(states.shape[0]):
        step = steps[index]
        lane = fill_lane(memory, 0, coefficients[index])
        half_backlash = 0.0 if present.backlash is None else lane.half_backlash
        for sample in range(states.shape[1]):
            fill(memory, rows.STATE, 0, scales[index], states[index, sample])
            state = read_state(memory, rows.STATE, 0, present)
            row = 2 * sample % (table.shape[0] - 1)
            if present.teeth is not None:
                if row == 0:
                    period = first + 2 * sample // (table.shape[0] - 1)
                    engage(memory, 0, driving[profile[index]], driven[profile[index]], period)
            point = point_on_grid(memory, 0, table, shares, row, present)
            forcing = forcing_at(lane, point, present)
            if present.pitch_error is not None:
                motion.pitch_error[index, sample] = pitch_error_at(lane, point, present)
            state = from_rest(state, forcing, present)
            gaps = gaps_at(state, lane, forcing, present)
            forces, _ = mesh_forces(gaps, lane, forcing, ANYWHERE, present)
            # Scaled, N_y and N_z enter eq. 13 with coefficient -1, and per step squared.
            motion.force_tangential[index, sample] = forces.tangential / step**2
            flank = flank_at(gaps.tangential.value, half_backlash)
            motion.contact_tangential[index, sample] = flank
            if present.axial is not None:
                motion.force_axial[index, sample] = forces.axial / step**2
                motion.contact_axial[index, sample] = flank_at(gaps.axial.value, half_backlash)
            acceleration = accelerations(state, forces, forcing.drive, lane, present)
            write_state(memory, rows.STATE, 0, State(state.rate, acceleration), present)
            if present.undamped is not None:
                # That of a state measured from rest: delta_5 is measured from e (eq. 13).
                memory[(rows.STATE + 1) * rows.STRIDE] -= lane.error_inertia * point.curvature
            take(memory, rows.STATE, 0, scales[index], change)
            motion.accelerations[index, sample] = change[1::2] / step
