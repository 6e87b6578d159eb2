"""Transient, steps and controllers of a run, chosen before the run."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from gearchaos.configuration.methods import METHODS
from gearchaos.engine.run_plan import Chosen, RunPlan
from gearchaos.engine.step_choice import judged_steps
from gearchaos.engine.steps import FINEST_GRID, PILOT_LANES, Candidate, choose_steps, pilot
from gearchaos.engine.transient import choose_transient
from gearchaos.records.label import MOST_LABEL_POINTS


def with_chosen_steps(run: RunPlan) -> RunPlan:
    """Return a run with the transient and the steps that its tolerance or its scene needs.

    They change if a tolerance is configured, or if no number of steps is configured. If the
    configured number of steps is too coarse, the notes say so.

    Parameters
    ----------
    run : RunPlan
        The run, with steps that are stable.

    Returns
    -------
    RunPlan
        The run with the chosen steps and transient, and with notes about them.

    Raises
    ------
    ConfigurationError
        If the tolerance cannot be reached.
    """
    if run.config.integration.tolerance is not None:
        return _within_tolerance(run, run.config.integration.tolerance)
    if METHODS[run.plan.method].exact:
        return run
    plan, note = judged_steps(run.lanes, run.plan)
    return run.with_choice(Chosen(plan.steps_per_period, plan.transient_periods), note)


def _within_tolerance(run: RunPlan, tolerance: float) -> RunPlan:
    """Return a run with a transient and steps that reach a tolerance on trial lanes."""
    recording, coarsest = run.recording, run.plan.steps_per_period
    # Enough points to find a period, even if the file keeps fewer.
    enough = min(MOST_LABEL_POINTS * run.lanes.repeats_after, recording.recorded_periods)
    recording = recording._replace(section_points=max(recording.section_points, enough))
    kept = run.plan.section_points
    transient, left, note = choose_transient(run.lanes, recording, kept, tolerance, PILOT_LANES)
    run = run.with_choice(Chosen(coarsest, transient), note)
    lanes, solution = pilot(run.lanes, run.plan, PILOT_LANES, 4 * coarsest)
    resolved, method = run.plan.resolved, run.plan.method
    candidates = choose_steps(
        lambda steps: solution(steps, resolved, method, hidden=True),
        coarsest,
        tolerance,
        run.config.source,
        # More steps do not make an exact method more exact.
        4 * coarsest if METHODS[method].exact else FINEST_GRID,
        left,
    )
    chosen = Chosen(candidates[-1].steps, transient)
    return run.with_choice(chosen, *_texts(candidates, lanes, tolerance, run.plan.tangent))


def _texts(
    candidates: Sequence[Candidate], lanes: int, tolerance: float, tangent: bool
) -> Iterator[str]:
    """Yield the measured errors for each number of steps on a number of trial lanes."""
    for tried in candidates:
        exponent = f", their exponent by {tried.exponent_error:.1e}" if tangent else ""
        yield (
            f"{tried.steps} steps per period: {tried.periodic_share * lanes:.0f} of {lanes} lanes "
            f"move periodically, their section is off by {tried.section_error:.1e}"
            f"{exponent}, wanted is {tolerance:g}; "
            f"{tried.changed_share * lanes:.0f} settle on a different motion with finer steps"
        )


def with_controllers(run: RunPlan) -> RunPlan:
    """Return a run whose lanes have the controllers of its [control], with a note about them.

    Steps have to be chosen before: an orbit belongs to a number of steps. Raises ConfigurationError
    if no orbit is found, or if it cannot be controlled where it was found.
    """
    if run.config.control is None:
        return run
    # SciPy, which designs gains, takes as long to import as Numba.
    from gearchaos.engine.control import Controllers

    controllers = Controllers(run)
    controlled = replace(run, lanes=run.lanes.controlled_by(controllers))
    return controlled.with_notes(f"control: {controllers.described()}")
