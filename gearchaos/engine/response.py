"""The time response: the motion at every step, after the transient."""

import time

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan, Status

from gearchaos.arguments import whole_number
from gearchaos.arrays import Array
from gearchaos.engine.choosing import with_chosen_steps
from gearchaos.engine.computing import integrate
from gearchaos.engine.kept import arrays_of
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.engine.running import choose_threads, metadata, require_memory, result_of
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration, Given, configuration_of
from gearchaos.models.protocol import Model
from gearchaos.outputs.catalogue import DEFAULT_PERIODS, NO_CONTACT
from gearchaos.outputs.names import MESH_PERIOD
from gearchaos.results.reading.result import Result


def respond(config: Given, periods: int = DEFAULT_PERIODS, threads: int | None = None) -> Result:
    """Compute the motion at every step of the last mesh periods, for every value of the sweep.

    ``config``, or the path of its file: transient, recorded periods, start and scene are as
    configured; ``periods``: mesh periods at the end of the recorded ones; ``threads``: by default
    all that there are. The result has the variables of a sweep, and the motion along ``time``; its
    sections hold all states of the scene in all recorded periods. Raises ConfigurationError if
    fewer periods are recorded, the motion does not fit into memory or there are not so many
    threads.
    """
    choose_threads(threads)
    config, periods = configuration_of(config), whole_number("periods", periods)
    run = with_chosen_steps(prepared(config, periods))
    return compute_response(run, periods, config.text)


def prepared(config: Configuration, periods: int) -> RunPlan:
    """Return the run of a response, of which the steps may still be chosen.

    Raises ConfigurationError if fewer periods are recorded.
    """
    recorded = config.integration.recorded_periods
    if not 1 <= periods <= recorded:
        raise ConfigurationError(
            f"{config.source}: periods = {periods}: must be between 1 and "
            f"integration.recorded_periods = {recorded}; ask for fewer or record more"
        )
    # A scene whose axial pair acts on nothing that a sweep keeps is computed as a whole here.
    whole = config.replace("outputs.section", config.states)
    return plan_run(whole.replace("outputs.section_points", recorded))


def compute_response(run: RunPlan, periods: int, text: str, fixed: str = "") -> Result:
    """Compute all lanes of a run from `prepared`; keep the last so many mesh periods.

    ``text``: the configuration as it was written; ``fixed``: as in the metadata of the lane that
    goes on. Raises ConfigurationError if the motion does not fit into memory.
    """
    plan, states, lanes = run.recording, len(run.lanes.states), len(run.lanes)
    plan = plan._replace(history_periods=periods)
    size = 8 * lanes * states * (3 * periods * plan.steps_per_period + plan.section_points)
    what = f"the response of {lanes} lanes over {periods} mesh periods of {plan.steps_per_period} "
    require_memory(run, size, f"{what}steps", "ask for fewer periods or values")
    began = time.monotonic()
    places = run.lanes.computed_at(np.arange(lanes))
    start, outcome = integrate(run, np.arange(lanes), plan)
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
    """Return states and what the model derives from them; of lanes that diverged none of it."""
    turned = plan.transient_periods + plan.recorded_periods - plan.history_periods
    motion: dict[str, Array] = {
        name: outcome.history[..., column].copy() for column, name in enumerate(system.states)
    }
    motion |= model.motion(system, outcome.history, plan.steps_per_period, turned)
    for values in motion.values():
        nothing = NO_CONTACT if values.dtype == np.uint8 else np.nan
        values[outcome.status != Status.OK] = nothing
    return motion
