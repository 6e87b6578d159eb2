"""The batch driver: splits lanes into blocks, runs them side by side, returns arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from gearchaos_kernels.block_loop import integrate_block
from gearchaos_kernels.coefficients import (
    Model,
    lane_coefficients,
    state_scales,
    steps_between_scalings,
)
from gearchaos_kernels.compilation import driver
from gearchaos_kernels.forcing import phase_table
from gearchaos_kernels.lane import LANES, STATES
from gearchaos_kernels.status import Status

STATE_ROWS = {
    "delta_5": 0,
    "delta_1": 1,
    "delta_2": 2,
    "delta_3": 3,
    "delta_4": 4,
    "delta_5_rate": 5,
    "delta_1_rate": 6,
    "delta_2_rate": 7,
    "delta_3_rate": 8,
    "delta_4_rate": 9,
}
"""Column of each state of eq. 13 in the arrays of this layer."""


class Scene(NamedTuple):
    """Which effects exist; what is off is absent from the compiled loop."""

    pitch_error: bool = True
    stiffness_variation: bool = True
    backlash: bool = True
    transverse: bool = True
    axial: bool = True


class Plan(NamedTuple):
    """How long and how finely a batch is integrated, and what is kept of it.

    ``resolved`` splits the steps that cross a clearance boundary; without it they are plain steps.
    ``history_periods`` are the last ones, of which every step is kept.
    """

    steps_per_period: int
    transient_periods: int
    recorded_periods: int
    section_points: int
    section_states: tuple[str, ...] = ()
    tangent: bool = False
    resolved: bool = True
    history_periods: int = 0


class Outcome(NamedTuple):
    """What a batch yields; lanes first.

    ``section`` (lanes, section points, section states), ``growth`` (lanes, recorded periods): the
    logarithm of the tangent vector's growth over each recorded period, None without tangent;
    ``end_state``, ``end_tangent`` (lanes, 10) in the columns of `STATE_ROWS`; ``status`` (lanes,)
    of `Status`; ``diverged_period`` (lanes,): number of the period in which a lane diverged, or -1;
    ``crossings`` (lanes,): clearance boundaries crossed in the recorded periods;
    ``slowest_crossing`` (lanes,): smallest speed of y_1 or y_2 at one of them, or infinity;
    ``overflows`` (lanes,): steps that crossed more often than they were split, in all periods;
    these three stay as they began in scenes without backlash and with plain steps; ``history``
    (lanes, history periods times steps + 1, 10): the state at every step, or None.
    """

    section: NDArray[np.float64]
    growth: NDArray[np.float64] | None
    end_state: NDArray[np.float64]
    end_tangent: NDArray[np.float64]
    status: NDArray[np.uint8]
    diverged_period: NDArray[np.int32]
    crossings: NDArray[np.int64]
    slowest_crossing: NDArray[np.float64]
    overflows: NDArray[np.int64]
    history: NDArray[np.float64] | None


@driver
def _integrate_blocks(
    coefficients,
    scales,
    start,
    tangent_start,
    table,
    transient_periods,
    recorded_periods,
    steps_between_scalings,
    section_states,
    pitch_error,
    phase,
    stiffness_variation,
    backlash,
    resolved,
    transverse,
    axial,
    section,
    growth,
    end_state,
    end_tangent,
    status,
    diverged_period,
    crossings,
    slowest_crossing,
    overflows,
    history,
):
    for number in prange((status.shape[0] + LANES - 1) // LANES):
        integrate_block(
            number * LANES,
            coefficients,
            scales,
            start,
            tangent_start,
            table,
            transient_periods,
            recorded_periods,
            steps_between_scalings,
            section_states,
            pitch_error,
            phase,
            stiffness_variation,
            backlash,
            resolved,
            transverse,
            axial,
            section,
            growth,
            end_state,
            end_tangent,
            status,
            diverged_period,
            crossings,
            slowest_crossing,
            overflows,
            history,
        )


def integrate(
    scene: Scene,
    model: Model,
    stiffness_cosine: NDArray[np.float64],
    stiffness_sine: NDArray[np.float64],
    start: NDArray[np.float64],
    plan: Plan,
    *,
    rederived: bool = False,
    tangent_start: NDArray[np.float64] | None = None,
) -> Outcome:
    """Integrate a batch of lanes with fixed-step RK4 from tau = 0.

    Parameters
    ----------
    scene : Scene
        Effects that exist.
    model : Model
        Dimensionless groups, arrays of shape (lanes,).
    stiffness_cosine, stiffness_sine : ndarray, shape (harmonics,)
        Mesh stiffness relative to its mean (eq. 19).
    start : ndarray, shape (lanes, 10)
        States of eq. 13 at tau = 0, columns as in `STATE_ROWS`.
    plan : Plan
        Steps, periods and what is kept.
    rederived : bool
        Which form of eq. 6 holds (see `coefficients.lane_coefficients`).
    tangent_start : ndarray, shape (lanes, 10), optional
        Tangent vectors at tau = 0; by default an equal share of every state that the scene has.

    Returns
    -------
    Outcome
        Identical bit for bit for any number of threads, any split and any order of the lanes.
    """
    lanes = start.shape[0]
    steps = plan.steps_per_period
    present = np.tile(np.repeat([True, scene.transverse, scene.axial], [1, 2, 2]), 2)
    if tangent_start is None:
        tangent_start = np.ones((lanes, STATES)) / np.sqrt(np.count_nonzero(present))
    outcome = Outcome(
        section=np.full((lanes, plan.section_points, len(plan.section_states)), np.nan),
        growth=np.full((lanes, plan.recorded_periods), np.nan) if plan.tangent else None,
        end_state=np.full((lanes, STATES), np.nan),
        end_tangent=np.full((lanes, STATES), np.nan),
        status=np.full(lanes, Status.OK, dtype=np.uint8),
        diverged_period=np.full(lanes, -1, dtype=np.int32),
        crossings=np.zeros(lanes, dtype=np.int64),
        slowest_crossing=np.full(lanes, np.inf),
        overflows=np.zeros(lanes, dtype=np.int64),
        history=np.full((lanes, plan.history_periods * steps + 1, STATES), np.nan)
        if plan.history_periods
        else None,
    )
    _integrate_blocks(
        lane_coefficients(model, steps, rederived),
        state_scales(model, steps),
        np.where(present, start, 0.0),
        np.where(present, tangent_start, 0.0),
        phase_table(stiffness_cosine, stiffness_sine, steps),
        plan.transient_periods,
        plan.recorded_periods,
        steps_between_scalings(model, steps),
        np.array([STATE_ROWS[name] for name in plan.section_states], dtype=np.intp),
        _flag(scene.pitch_error),
        _flag(scene.pitch_error and bool(np.any(model.error_phase))),
        _flag(scene.stiffness_variation),
        _flag(scene.backlash),
        _flag(scene.backlash and plan.resolved),
        _flag(scene.transverse),
        _flag(scene.axial),
        *outcome,
    )
    return outcome


def _flag(present: bool) -> tuple[()] | None:
    """Encode an effect in a type, so that every scene is compiled for itself."""
    return () if present else None
