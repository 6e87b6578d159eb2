"""The plan of a run: the lanes of a configured sweep, and the plan of their integration."""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import gearchaos_kernels as kernels

from gearchaos.configuration.methods import METHODS
from gearchaos.configuration.plausible import implausible
from gearchaos.dynamics.plans import plan_of
from gearchaos.engine.excitation import remarks, whole_lengths
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.method_choice import with_method
from gearchaos.engine.step_choice import steps_for_exponents
from gearchaos.engine.steps import coarse_steps, needless_maps, stable_steps
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration
from gearchaos.records.label import MOST_LABEL_POINTS
from gearchaos.records.period import POINTS_NEEDED


class Chosen(NamedTuple):
    """The part of a plan that trials choose before a sweep.

    Attributes
    ----------
    steps_per_period : int
        Steps per mesh period.
    transient_periods : int
        Length of the transient in mesh periods.
    """

    steps_per_period: int
    transient_periods: int


@dataclass(frozen=True)
class RunPlan:
    """The lanes of a run and the plan of their integration. It is immutable.

    Attributes
    ----------
    config : Configuration
        The configuration.
    lanes : Lanes
        The lanes of its sweep.
    plan : gearchaos_kernels.Plan
        Method, steps and periods, with the kept section.
    notes : tuple of str
        Notes for the user before the run.
    warnings : tuple of str
        Those of the notes that are printed with --quiet, too.
    """

    config: Configuration
    lanes: Lanes
    plan: kernels.Plan
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()

    @property
    def chosen(self) -> Chosen:
        """The part of the plan that trials choose, for all processes that compute its lanes."""
        return Chosen(self.plan.steps_per_period, self.plan.transient_periods)

    @property
    def method_description(self) -> str:
        """The method with its steps and its crossings, in words."""
        crossings = self.config.integration.crossings
        return METHODS[self.plan.method].description(self.plan.steps_per_period, crossings)

    @property
    def carried(self) -> bool:
        """Whether each value starts from the end state of its neighbour."""
        return self.config.start.carry != "none"

    @property
    def recording(self) -> kernels.Plan:
        """The plan with the section points for outputs and for labels."""
        checked = POINTS_NEEDED if self.config.integration.error_check > 0.0 else 0
        wanted = MOST_LABEL_POINTS if self.config.outputs.motion else checked
        enough = min(wanted * self.lanes.repeats_after, self.plan.recorded_periods)
        return self.plan._replace(section_points=max(self.plan.section_points, enough))

    @property
    def splits_steps(self) -> bool:
        """Whether steps are split at the boundaries of a clearance."""
        return self.plan.resolved and self.lanes.clearance

    @property
    def elements(self) -> tuple[str, ...]:
        """Names of the clearance elements."""
        return self.lanes.model.elements(self.lanes.effects)

    def with_choice(self, chosen: Chosen, *notes: str) -> Self:
        """Return a copy with chosen steps and transient, and with further non-empty notes."""
        plan = self.plan._replace(**chosen._asdict())
        return replace(self, plan=plan, notes=(*self.notes, *filter(None, notes)))

    def with_notes(self, *notes: str) -> Self:
        """Return a copy with further notes that are not empty."""
        return self.with_choice(self.chosen, *notes)


def plan_run(config: Configuration) -> RunPlan:
    """Return the plan of a configured run, with steps that are stable in every lane.

    `gearchaos.engine.choosing.with_chosen_steps` then makes them accurate enough.

    Parameters
    ----------
    config : Configuration
        The configuration.

    Returns
    -------
    RunPlan
        Lanes, plan and notes.

    Raises
    ------
    ConfigurationError
        If the number of steps per period is unstable and must not be raised, or if the excitation
        or the record does not suit the outputs.
    """
    unusual = [*implausible(config)]
    try:
        run = _planned(config).with_notes(*unusual)
        return replace(run, warnings=(*run.warnings, *unusual))
    except ConfigurationError as error:
        # A value in another unit may be the cause.
        causes = [f"{config.source}: {text}" for text in unusual]
        raise ConfigurationError([*error.problems, *causes]) from None


def _planned(config: Configuration) -> RunPlan:
    """Return the plan of a run, see `plan_run`."""
    config, reason = with_method(config)
    lanes, integration, outputs = Lanes(config), config.integration, config.outputs
    steps, note = stable_steps(lanes, integration.fixed_steps)
    judged = outputs.lyapunov and integration.tolerance is None
    if judged and integration.fixed_steps is None:
        steps = steps_for_exponents(lanes, steps)
    lengths = whole_lengths(lanes)
    plan = plan_of(
        config,
        steps_per_period=steps,
        **lengths,
        section_points=outputs.section_points if outputs.section else 0,
        tangent=outputs.lyapunov,
        contact=outputs.contact,
        loads=outputs.loads,
        states=outputs.states,
        orders=outputs.mesh_orders,
    )
    coarse = coarse_steps(lanes, steps) if judged else ""
    notes = [reason, note, coarse, needless_maps(lanes, plan), *remarks(lanes, lengths)]
    warnings = (coarse,) if coarse else ()
    return RunPlan(config, lanes, plan, tuple(text for text in notes if text), warnings)
