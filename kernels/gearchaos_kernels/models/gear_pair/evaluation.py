"""Eq. 13 evaluated on given states, in the terms of a gear pair."""

import numpy as np

from gearchaos_kernels import evaluation
from gearchaos_kernels.batch import scene_of
from gearchaos_kernels.compilation import evaluator
from gearchaos_kernels.memory.block_memory import aligned_memory, fill_lane
from gearchaos_kernels.memory.rows import rows
from gearchaos_kernels.models.gear_pair.forcing import pitch_error_at
from gearchaos_kernels.models.gear_pair.pairs import GearPairs, MeshMotion
from gearchaos_kernels.models.interfaces import begin_period, grid_at, point_at
from gearchaos_kernels.plan import Floats


def mesh_motion(
    system: GearPairs, states: Floats, steps_per_period: int, first_period: int = 0
) -> MeshMotion:
    """Return mesh forces, contact, accelerations and errors along a motion.

    Parameters
    ----------
    system : GearPairs
        The gear pairs.
    states : array, shape (lanes, samples, states)
        States in the units of eq. 13, one step apart; the first one is at mesh phase 0.
    steps_per_period : int
        Samples per mesh period.
    first_period : int, optional
        Mesh periods that the teeth have turned before the first sample.

    Returns
    -------
    MeshMotion
        Dimensionless, as in eq. 13.

    Raises
    ------
    ValueError
        If more than seven tooth pairs are in mesh at once.

    Notes
    -----
    Gaps are those of eqs 6 and 7, mesh forces those of eqs 2 and 4 with the clearance function of
    eqs 22 and 23. Without clearance teeth never separate; the sign of the gap decides the flank.

    Examples
    --------
    With the states of a run that has recorded its history::

        outcome = integrate(pairs, start, Plan(200, 100, 10, 1, history_periods=2))
        motion = mesh_motion(pairs, outcome.history, 200)
        separated = motion.contact_tangential == 0
    """
    found = evaluation.evaluate(system, states, steps_per_period, first_period)
    axial, nothing = system.effects.axial, np.zeros(states.shape[:2])
    return MeshMotion(
        force_tangential=found.forces[:, :, 0].copy(),
        force_axial=found.forces[:, :, 1].copy() if axial else nothing,
        contact_tangential=found.contact[:, :, 0].copy(),
        contact_axial=found.contact[:, :, 1].copy() if axial else nothing.astype(np.uint8),
        accelerations=found.accelerations,
        pitch_error=_pitch_error(system, nothing.shape, steps_per_period, first_period),
        transmission_error=found.observed[:, :, 0].copy(),
    )


def _pitch_error(
    system: GearPairs, shape: tuple[int, ...], steps_per_period: int, first_period: int
) -> Floats:
    """Return the pitch error e at every sample of every lane, shape (lanes, samples)."""
    error = np.zeros(shape)
    if system.effects.pitch_error:
        _follow_error(
            system.coefficients(system.mesh_period / steps_per_period),
            system.tables(steps_per_period),
            2 * steps_per_period,
            first_period,
            error,
            scene_of(system, evaluation.WITHOUT_LOOP),
        )
    return error


@evaluator
def _follow_error(coefficients, tables, half_steps, first, error, scene):
    """Write the pitch error e at every sample into ``error``, shape (lanes, samples)."""
    memory = aligned_memory(rows(scene).total)
    for index in range(error.shape[0]):
        lane = fill_lane(memory, 0, coefficients[index], scene)
        for sample in range(error.shape[1]):
            row = 2 * sample % half_steps
            if row == 0:
                begin_period(memory, 0, index, first + 2 * sample // half_steps, tables, scene)
            point = point_at(memory, 0, grid_at(tables, row, scene), scene)
            error[index, sample] = pitch_error_at(lane, point, scene)
