"""The kept outputs of integrated lanes: the variables of a result, and their arrays."""

from collections.abc import Sequence
from typing import Any

import gearchaos_kernels as kernels
import numpy as np

from gearchaos.arrays import Array, Floats, Integers
from gearchaos.dynamics.exponents import contact_shares, exponents, sum_of_exponents
from gearchaos.dynamics.labelling import Labelled, labels_of
from gearchaos.dynamics.largest_exponents import RECORD_MEANINGS, largest_exponents
from gearchaos.engine import error_check
from gearchaos.engine.capture import control_arrays, input_unit
from gearchaos.engine.claims import completed
from gearchaos.engine.run_plan import RunPlan
from gearchaos.engine.steps import solution_of
from gearchaos.outputs import catalogue, names
from gearchaos.outputs.entries import Part
from gearchaos.outputs.listing import Details, for_each
from gearchaos.outputs.variable import Variable
from gearchaos.records.contact import CONTACT_STATES, DIVERGED, contact_summary
from gearchaos.records.control import CAPTURE_MEANINGS
from gearchaos.records.difference import difference
from gearchaos.records.dimension import kaplan_yorke
from gearchaos.records.label import MOTION_MEANINGS, QUASI_PERIODIC, UNRESOLVED

MEANINGS: dict[str, Sequence[str]] = {
    "motion": MOTION_MEANINGS,
    names.RECORD: RECORD_MEANINGS,
    "contact_state_@": CONTACT_STATES,
    "capture": CAPTURE_MEANINGS,
    "motion_changed": error_check.CHANGE_MEANINGS,
    names.STATUS: [status.name.lower() for status in kernels.STATUS_TEXTS],
}
"""Words for the codes 0, 1, ... of each flag, by the name of the output."""


def variables_of(run: RunPlan) -> list[Variable]:
    """Return the variables of a sweep, in the order of the file."""
    outputs, repeats = run.config.outputs, run.lanes.repeats_after
    excitation_periods = f"periods of the excitation, {repeats} mesh periods each,"
    touched = run.plan.contact and run.splits_steps
    model = run.lanes.model
    signals = (*outputs.states, *model.signals[:1])
    parts: dict[Part, bool | Sequence[str]] = {
        catalogue.SECTION_POINTS_PART: bool(outputs.section),
        catalogue.SECTION_PART: outputs.section,
        catalogue.LYAPUNOV_PART: outputs.lyapunov,
        catalogue.MOTION_PART: outputs.motion,
        catalogue.RECORD_PART: outputs.motion and outputs.lyapunov,
        catalogue.EXPONENTS_PART: outputs.exponents,
        catalogue.DIMENSION_PART: outputs.exponents,
        catalogue.CROSSINGS_PART: run.splits_steps,
        catalogue.CONTACT_PART: run.elements if touched else (),
        **(for_each(model.load_parts, run.elements) if run.plan.loads else {}),
        catalogue.EXTREMES_PART: outputs.states,
        catalogue.ORDERS_PART: bool(run.plan.orders),
        catalogue.AMPLITUDES_PART: signals if run.plan.orders else (),
        catalogue.CONTROL_PART: run.config.control is not None,
        catalogue.CONTROL_TORQUE_PART: input_unit(run) == "Nm",
        catalogue.CONTROL_FORCE_PART: input_unit(run) == "force",
        catalogue.CHECK_PART: run.config.integration.error_check > 0.0,
        catalogue.EVERY_SWEEP_PART: True,
    }
    values = {
        names.SECTION_POINT: np.arange(outputs.section_points),
        names.EXPONENT_NUMBER: np.arange(1, len(run.lanes.states) + 1),
        names.ORDER: np.array([float(order) for order in run.plan.orders]),
        names.STATE: np.arange(len(run.lanes.states)),
    }
    meanings = MEANINGS | {names.STATE: run.lanes.states}
    wordings = {"period": excitation_periods if repeats > 1 else "mesh periods"}
    return model.catalogue.variables(run.lanes.axes, parts, Details(values, meanings, wordings))


def arrays_of(
    run: RunPlan, lanes: Integers, start: Floats, outcome: kernels.Outcome
) -> dict[str, Any]:
    """Return the arrays (lanes, ...) of integrated lanes by variable; ``start`` (lanes, states)."""
    system, plan, outputs = run.lanes.system_of(lanes), run.plan, run.config.outputs
    sound = outcome.status == kernels.Status.OK
    arrays: dict[str, Any] = {
        "status": outcome.status,
        "diverged_period": outcome.diverged_period,
        "start_state": start,
        "end_state": outcome.end_state,
    }
    if run.splits_steps:
        crossings = outcome.crossings / plan.recorded_periods
        arrays["crossings_per_period"] = np.where(sound, crossings, np.nan)
        slowest = np.where(outcome.crossings > 0, outcome.slowest_crossing, np.nan)
        arrays["slowest_crossing"] = np.where(sound, slowest, np.nan)
        arrays["unsplit_steps"] = outcome.overflows
    arrays |= recorded_quantities(run, system, outcome)
    arrays |= control_arrays(run, lanes, system, outcome)
    for name in outputs.section:
        points = outcome.section[:, -plan.section_points :, system.states.index(name)]
        # A copy: a view would keep the whole record in memory.
        arrays[f"section_{name}"] = points.copy()
    labelled = labels_of(system, outcome, run.recording) if outputs.motion else None
    if labelled is not None:
        arrays |= labelled.labels._asdict()
    largest = None
    if plan.tangent:
        period = labelled.labels.period if labelled else np.zeros(lanes.size, dtype=np.int32)
        state = labelled.state if labelled else outcome.end_state
        largest = largest_exponents(system, outcome, run.recording, period, state)
        arrays["lyapunov_exponent"] = largest.values
        arrays["lyapunov_exponent_standard_error"] = largest.standard_errors
        if labelled is not None:
            arrays["record"] = largest.record
    if outputs.exponents:
        spectrum = exponents(system, start, plan)
        if largest is not None:
            spectrum = spectrum.given(largest.of_orbit)
        arrays["lyapunov_exponents"] = spectrum.values
        arrays["lyapunov_exponents_standard_error"] = spectrum.standard_errors
        motion = labelled.labels.motion if labelled else outcome.status * 0
        arrays |= dimensions(spectrum.values, spectrum.standard_errors, motion)
        total = sum_of_exponents(system, contact_shares(outcome, plan))
        # The damping alone does not determine the sum of a closed loop.
        arrays["lyapunov_sum"] = total if system.control is None else np.full_like(total, np.nan)
    if run.config.integration.error_check > 0.0:
        arrays |= _check(run, lanes, start, outcome, labelled)
    return arrays


def dimensions(values: Floats, errors: Floats, motion: Array) -> dict[str, Array]:
    """Return the dimension of each lane and its error by variable.

    ``values``, ``errors`` (lanes, states): all exponents; ``motion`` (lanes,): label of each lane.
    """
    errors = errors.copy()
    torus = motion == QUASI_PERIODIC
    # The largest exponent of a torus is 0; its estimate tends to 0 with the length of the record.
    errors[torus, 0] = np.maximum(errors[torus, 0], np.abs(values[torus, 0]))
    found = np.array(kaplan_yorke(values, errors))
    # A record that is too short for a label is too short for errors of its exponents.
    dimension, error = np.where(motion == UNRESOLVED, np.nan, found)
    name = "kaplan_yorke_dimension"
    return {name: dimension, f"{name}{names.STANDARD_ERROR}": error}


def recorded_quantities(
    run: RunPlan, system: kernels.LaneSystem, outcome: kernels.Outcome
) -> dict[str, Array]:
    """Return contact, loads and state summaries by variable; NaN in lanes that diverged."""
    kept: dict[str, Array] = {}
    if run.plan.contact and run.splits_steps:
        for number, element in enumerate(run.elements):
            found = contact_summary(outcome.contact[:, number], run.plan.recorded_periods)
            kept |= {f"{name}_{element}": values for name, values in found.items()}
    if run.plan.loads:
        kept |= run.lanes.model.loads(outcome.loads, system)
    kept |= state_summary(outcome, run.plan, run.lanes.model.signals[:1])
    for values in kept.values():
        of_kinds = values.dtype == np.uint8
        values[outcome.status != kernels.Status.OK] = DIVERGED if of_kinds else np.nan
    return kept


def _check(
    run: RunPlan,
    lanes: Integers,
    start: Floats,
    outcome: kernels.Outcome,
    labelled: Labelled | None,
) -> dict[str, Array]:
    """Integrate the checked lanes of a block again with half the step, and compare.

    The comparison uses the section points of the labels, because the file may keep fewer. Errors
    that half the step does not show are added.
    """
    plan, kept = run.recording, run.config.outputs.section
    share = run.config.integration.error_check
    checked = error_check.checked_lanes(lanes // run.lanes.directions, share)
    section, exponent = np.full((2, lanes.size), np.nan)
    motion = np.full(lanes.size, error_check.NOT_CHECKED, dtype=np.uint8)
    if checked.size:
        half = plan._replace(steps_per_period=2 * plan.steps_per_period)
        system = run.lanes.system_of(lanes[checked])
        finer = kernels.integrate(system, start[checked], half)
        some = labelled and labels_of(system, finer, half)
        fine = solution_of(system, finer, half, kept, some)
        some = labelled and Labelled(labelled.labels.of(checked), labelled.state[checked])
        theirs: Any = (array[checked] for array in outcome)
        ended = kernels.Outcome(*theirs)
        coarse = solution_of(system, ended, plan, kept, some)
        coarse = completed(coarse, system, ended, plan, kept, some)
        found = difference(coarse, fine)
        section[checked], exponent[checked] = found.section_error, found.exponent_error
        motion[checked] = np.where(found.changed, error_check.CHANGED, error_check.SAME)
    return dict(zip(error_check.CHECKED, (section, exponent, motion), strict=True))


def state_summary(
    outcome: kernels.Outcome, plan: kernels.Plan, signals: Sequence[str]
) -> dict[str, Floats]:
    """Return extremes of the states of a plan, and amplitudes at its orders, by variable.

    ``signals``: names of the observed signals with amplitudes.
    """
    found: dict[str, Floats] = {}
    for number, state in enumerate(plan.states):
        smallest, largest = outcome.extremes[:, number].T
        ends = smallest, largest, largest - smallest
        found |= {f"{state}_{name}": end for name, end in zip(names.EXTREMES, ends, strict=True)}
    if plan.orders:
        amplitudes = (f"{names.AMPLITUDE}{one}" for one in (*plan.states, *signals))
        found |= zip(amplitudes, np.moveaxis(outcome.amplitudes, 1, 0), strict=True)
    return found
