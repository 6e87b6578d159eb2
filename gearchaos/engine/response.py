"""The time response: the motion at every step, after the transient."""

import time

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan, Status

from gearchaos.arguments import whole_number
from gearchaos.arrays import Array
from gearchaos.configuration.methods import METHODS
from gearchaos.engine.choosing import with_chosen_steps, with_controllers
from gearchaos.engine.computing import integrate_places
from gearchaos.engine.excitation import whole_lengths
from gearchaos.engine.kept import arrays_of
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.run_plan import Chosen, RunPlan, plan_run
from gearchaos.engine.running import choose_threads, metadata, require_memory, result_of
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration, Given, configuration_of
from gearchaos.models.protocol import Model
from gearchaos.outputs.catalogue import DEFAULT_PERIODS, NO_CONTACT
from gearchaos.outputs.names import MESH_PERIOD
from gearchaos.results.reading.result import Result

FEWEST_SAMPLES = 60
"""Fewest steps per mesh period of a response whose configuration does not give their number."""


def respond(config: Given, periods: int = DEFAULT_PERIODS, threads: int | None = None) -> Result:
    """Compute the motion at every step of the last mesh periods, for every value of the sweep.

    Parameters
    ----------
    config : Configuration, mapping or path
        Scene, start, transient and recorded periods.
    periods : int
        Mesh periods at the end of the recorded periods.
    threads : int, optional
        Number of threads; by default all cores.

    Returns
    -------
    Result
        The variables of a sweep, and the motion along ``time`` in mesh periods. Sections have all
        states of the scene in all recorded periods.

    Raises
    ------
    ConfigurationError
        If fewer periods are recorded, if the motion does not fit into memory, or if there are fewer
        threads.

    Examples
    --------
    >>> config = gearchaos.load_config("sweeps/pan2021.toml", ["sweep.count=2"])
    >>> result = gearchaos.respond(config, periods=4)
    >>> result.dims("delta_5"), result["time"][-1]
    (('pitch_error', 'time'), np.float64(4.0))
    """
    choose_threads(threads)
    config, periods = configuration_of(config), whole_number("periods", periods)
    run = with_controllers(with_chosen_steps(prepared(config, periods)))
    return compute_response(run, periods, config.text)


def prepared(config: Configuration, periods: int) -> RunPlan:
    """Return the run of a response before its steps are chosen.

    Raises ConfigurationError if fewer periods are recorded.
    """
    # An excitation period longer than a mesh period makes the record longer.
    lanes, given = Lanes(config), config.integration.recorded_periods
    recorded = max(given, whole_lengths(lanes)["recorded_periods"])
    if not 1 <= periods <= recorded:
        raise ConfigurationError(
            f"{config.source}: periods = {periods}: must be between 1 and "
            f"integration.recorded_periods = {recorded}; request fewer or record more"
        )
    # All states are kept, so that effects which act on no output of a sweep are computed, too.
    whole = config.replace("outputs.section", config.states)
    whole = whole.replace("integration.recorded_periods", recorded)
    run = plan_run(whole.replace("outputs.section_points", recorded))
    raised = f"integration.recorded_periods raised from {given} to {recorded}"
    return _with_samples(run).with_notes(raised if recorded > given else "")


def _with_samples(run: RunPlan) -> RunPlan:
    """Return a run with enough steps for curves."""
    steps = sampled_steps(run.config, run.plan.steps_per_period)
    if steps == run.plan.steps_per_period:
        return run
    return run.with_choice(Chosen(steps, run.plan.transient_periods), "")


def sampled_steps(config: Configuration, steps: int) -> int:
    """Return the steps per period that curves and spectra need, a multiple of those taken.

    The default of an exact method is too few for them. A number in the configuration is kept.
    """
    integration = config.integration
    if integration.steps_per_period is not None or not METHODS[integration.method].exact:
        return steps
    return steps * -(-FEWEST_SAMPLES // steps)


def compute_response(run: RunPlan, periods: int, text: str, fixed: str = "") -> Result:
    """Compute all lanes of a run from `prepared` and keep the last ``periods`` mesh periods.

    ``text``: the configuration as written; ``fixed``: coordinates of the lane that is continued,
    for the metadata. Raises ConfigurationError if the motion does not fit into memory.
    """
    plan, states, lanes = run.recording, len(run.lanes.states), len(run.lanes)
    plan = plan._replace(history_periods=periods)
    size = 8 * lanes * states * (3 * periods * plan.steps_per_period + plan.section_points)
    what = f"the response of {lanes} lanes over {periods} mesh periods of {plan.steps_per_period} "
    require_memory(run, size, f"{what}steps", "request fewer periods or values")
    began = time.monotonic()
    places = run.lanes.computed_at(np.arange(lanes))
    start, outcome = integrate_places(run, np.arange(lanes), plan)
    system = run.lanes.system_of(places)
    arrays = {
        **arrays_of(run, places, start, outcome),
        MESH_PERIOD: system.mesh_period,
        **_motion(run.lanes.model, system, outcome, plan),
    }
    model = run.lanes.model
    instants = np.arange(periods * plan.steps_per_period + 1) / plan.steps_per_period
    variables = model.catalogue.motion(
        run.lanes.axes, instants, system.states, model.elements(run.lanes.effects)
    )
    facts = {
        **metadata(run, time.monotonic() - began),
        "kind": "response",
        "response_periods": periods,
        "configuration": text,
        "fixed": fixed,
    }
    return result_of(run, [arrays], facts, variables)


def _motion(model: Model, system: LaneSystem, outcome: Outcome, plan: Plan) -> dict[str, Array]:
    """Return states and outputs of the model by name; NaN in lanes that diverged."""
    turned = plan.transient_periods + plan.recorded_periods - plan.history_periods
    motion: dict[str, Array] = {
        name: outcome.history[..., column].copy() for column, name in enumerate(system.states)
    }
    motion |= model.motion(system, outcome.history, plan.steps_per_period, turned)
    for values in motion.values():
        nothing = NO_CONTACT if values.dtype == np.uint8 else np.nan
        values[outcome.status != Status.OK] = nothing
    return motion
