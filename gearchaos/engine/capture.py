"""Capture and effort of controlled lanes, as a result keeps them."""

import gearchaos_kernels as kernels
import numpy as np

from gearchaos.arrays import Array, Integers
from gearchaos.engine.run_plan import RunPlan
from gearchaos.records.control import (
    CAPTURED,
    HELD_PERIODS,
    NOT_CAPTURED,
    distance_from,
    on_orbit,
    reach_of,
)

EFFORTS = ("largest", "mean", "recorded")
"""Endings of the names of efforts."""


def input_unit(run: RunPlan) -> str:
    """Return the unit of the input, as names of efforts end, of a controlled run; "" if unknown."""
    if run.config.control is None:
        return ""
    known = run.lanes.model.input_unit(run.config, run.lanes.values_of(np.arange(1)))
    return "" if known is None else run.config.unit_of_inputs


def control_arrays(
    run: RunPlan, lanes: Integers, system: kernels.LaneSystem, outcome: kernels.Outcome
) -> dict[str, Array]:
    """Return capture and effort of lanes (lanes,) by variable; nothing without controllers."""
    control, controllers = system.control, run.lanes.controllers
    if control is None or controllers is None:
        return {}
    values = run.lanes.values_of(lanes)
    state = controllers.states_of(lanes, values)
    repeats, points = system.repeats_after, outcome.section.shape[1]
    distance = distance_from(
        control.points.swapaxes(0, 1),
        outcome.section,
        control.scales.max(axis=1),
        repeats,
        1 - points,
    )
    noise = controllers.noise_of(lanes, values)
    # A sample of a sweep may be shorter.
    last = slice(-min(HELD_PERIODS * repeats, points, outcome.inputs.shape[1]), None)
    there = on_orbit(distance[:, last], outcome.inputs[:, last], reach_of(noise), noise > 0.0)
    held = there.all(axis=1)
    state[(state == NOT_CAPTURED) & held] = CAPTURED
    size = np.abs(outcome.inputs)
    size[outcome.status != kernels.Status.OK] = np.nan
    acting = size[:, min(control.begins, size.shape[1] - 1) :]
    recorded = size[:, run.plan.transient_periods :]
    means = acting.max(axis=1), acting.mean(axis=1), recorded.mean(axis=1)
    efforts = dict(zip(EFFORTS, means, strict=True))
    # Nothing is a share of a steady input of 0.
    steady = np.where(system.steady_input, np.abs(system.steady_input), np.nan)
    arrays: dict[str, Array] = {"capture": state}
    arrays |= {f"effort_{name}": effort / steady for name, effort in efforts.items()}
    unit = controllers.unit_of(lanes, values)
    if unit is not None:
        end = input_unit(run)
        arrays |= {f"effort_{name}_{end}": effort * unit for name, effort in efforts.items()}
    return arrays
