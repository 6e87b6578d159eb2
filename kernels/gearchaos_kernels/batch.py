"""The batch driver: splits lanes into blocks, runs them side by side, returns arrays."""

from __future__ import annotations

import numpy as np
from numba import prange

from gearchaos_kernels.block import Batch, integrate_block
from gearchaos_kernels.block_memory import LANES, Present
from gearchaos_kernels.coefficients import (
    lane_coefficients,
    state_scales,
    steps_between_scalings,
)
from gearchaos_kernels.compilation import driver
from gearchaos_kernels.forcing import phase_table
from gearchaos_kernels.status import Status
from gearchaos_kernels.system import Floats, Outcome, Plan, System


@driver
def _integrate_blocks(
    batch,
    plan,
    outcome,
    pitch_error,
    phase,
    stiffness_variation,
    backlash,
    transverse,
    axial,
    resolved,
    tangent,
):
    for number in prange((outcome.status.shape[0] + LANES - 1) // LANES):
        # Packed here: as a record it would not pass into the parallel loop.
        present = Present(
            pitch_error,
            phase,
            stiffness_variation,
            backlash,
            transverse,
            axial,
            resolved,
            tangent,
        )
        integrate_block(number * LANES, batch, plan, outcome, present)


def integrate(
    system: System, start: Floats, plan: Plan, *, tangent_start: Floats | None = None
) -> Outcome:
    """Integrate a batch of lanes with fixed-step RK4 from tau = 0.

    Parameters
    ----------
    system : System
    start : ndarray, shape (lanes, states)
        States of eq. 13 at tau = 0.
    plan : Plan
        Steps, periods and what is kept.
    tangent_start : ndarray, shape (lanes, states), optional
        Tangent vectors at tau = 0; by default an equal share of every state.

    Returns
    -------
    Outcome
        Identical bit for bit for any number of threads, any split and any order of the lanes.
    """
    lanes, states = start.shape[0], len(system.states)
    steps = plan.steps_per_period
    if tangent_start is None:
        tangent_start = np.full((lanes, states), 1.0 / np.sqrt(states))
    outcome = Outcome(
        section=np.full((lanes, plan.section_points, states), np.nan),
        growth=np.full((lanes, plan.recorded_periods if plan.tangent else 0), np.nan),
        end_state=np.full((lanes, states), np.nan),
        end_tangent=np.full((lanes, states), np.nan),
        status=np.full(lanes, Status.OK, dtype=np.uint8),
        diverged_period=np.full(lanes, -1, dtype=np.int32),
        crossings=np.zeros(lanes, dtype=np.int64),
        slowest_crossing=np.full(lanes, np.inf),
        overflows=np.zeros(lanes, dtype=np.int64),
        history=np.full((lanes, plan.history_periods * steps + 1, states), np.nan),
    )
    step = system.mesh_period / steps
    batch = Batch(
        lane_coefficients(system, step),
        state_scales(system, step),
        np.ascontiguousarray(start, dtype=np.float64),
        np.ascontiguousarray(tangent_start, dtype=np.float64),
        steps_between_scalings(system, steps),
        phase_table(system.stiffness_cosine, system.stiffness_sine, steps),
    )
    _integrate_blocks(batch, plan, outcome, *flags(system, plan))
    return outcome._replace(
        growth=outcome.growth if plan.tangent else None,
        history=outcome.history if plan.history_periods else None,
    )


def flags(system: System, plan: Plan) -> Present:
    """Tell in types what the loop of a scene has, so that every scene is compiled for itself."""
    effects = system.effects
    values = {
        **effects._asdict(),
        "phase": effects.pitch_error and bool(np.any(system.groups.error_phase)),
        "resolved": effects.backlash and plan.resolved,
        "tangent": plan.tangent,
    }
    return Present(**{name: () if present else None for name, present in values.items()})
