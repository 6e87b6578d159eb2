"""A configured sweep: what it yields, and the means to compute any block of its lanes."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import gearchaos_kernels as kernels
import numpy as np

from gearchaos.arrays import Array, Floats, Integers
from gearchaos.configuration.methods import METHODS
from gearchaos.dynamics.exponents import exponents, sum_of_exponents
from gearchaos.dynamics.labelling import LOOK_BYTES, LOOKS, Told, labels_of
from gearchaos.dynamics.largest_exponents import MEANINGS as RECORD_MEANINGS
from gearchaos.dynamics.largest_exponents import largest_exponents
from gearchaos.dynamics.plans import plan_of
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine import error_check
from gearchaos.engine.claims import completed
from gearchaos.engine.excitation import remarks, whole_lengths
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.step_choice import judged_steps, steps_for_exponents
from gearchaos.engine.steps import (
    MOST_STEPS,
    PILOT_LANES,
    choose_steps,
    coarse_steps,
    needless_maps,
    pilot,
    solution_of,
    stable_steps,
)
from gearchaos.engine.transient import settled
from gearchaos.interrupts import check
from gearchaos.models import Configuration
from gearchaos.outputs import catalogue, names
from gearchaos.outputs.entries import Part
from gearchaos.outputs.listing import Details, for_each
from gearchaos.outputs.variable import Variable
from gearchaos.records.contact import CONTACT_STATES, contact_told
from gearchaos.records.difference import difference
from gearchaos.records.label import MEANINGS as MOTION_MEANINGS
from gearchaos.records.label import MOST_POINTS
from gearchaos.records.period import POINTS_NEEDED

Arrays = Mapping[str, Array]
Bounds = tuple[int, int]


class Chosen(NamedTuple):
    """What of a plan is chosen by trials before a sweep begins."""

    steps_per_period: int
    transient_periods: int


class Simulation:
    """The lanes of a configured sweep with a plan of their integration, and what is kept of them.

    ``plan``: steps and periods, with the section that is kept; ``notes``: what a user should know
    before the sweep begins. Raises ConfigurationError if the number of steps per period is unstable
    and may not be raised.
    """

    def __init__(self, config: Configuration) -> None:
        self.config = config
        self.lanes = Lanes(config)
        integration, outputs = config.integration, config.outputs
        steps, note = stable_steps(self.lanes, integration.steps_per_period)
        judged = outputs.lyapunov and integration.tolerance is None
        if judged and integration.steps_per_period is None:
            steps = steps_for_exponents(self.lanes, steps)
        lengths = whole_lengths(self.lanes)
        self.plan = plan_of(
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
        coarse = coarse_steps(self.lanes, steps) if judged else ""
        notes = [note, coarse, needless_maps(self.lanes, self.plan), *remarks(self.lanes, lengths)]
        self.notes = [text for text in notes if text]

    def choose_steps(self) -> None:
        """Measure which transient and steps the tolerance or, without one, the scene needs.

        They are taken where a tolerance or no number of steps is configured; where one is
        configured that is too coarse, the notes say so.
        """
        tolerance = self.config.integration.tolerance
        if tolerance is None:
            if not METHODS[self.plan.method].exact:
                self.plan, note = judged_steps(self.lanes, self.plan)
                self.notes += [note] if note else []
            return
        kept, recording = self.plan.section_points, self.recording
        # As many points as tell a period, however few the file keeps.
        enough = min(MOST_POINTS * self.lanes.repeats_after, recording.recorded_periods)
        recording = recording._replace(section_points=max(recording.section_points, enough))
        transient, left, note = settled(self.lanes, recording, kept, tolerance, PILOT_LANES)
        self.plan = self.plan._replace(transient_periods=transient)
        self.notes += [note] if note else []
        coarsest = self.plan.steps_per_period
        lanes, solution = pilot(self.lanes, self.plan, PILOT_LANES, 4 * coarsest)
        candidates = choose_steps(
            lambda steps: solution(steps, self.plan.resolved, self.plan.method, hidden=True),
            coarsest,
            tolerance,
            self.config.source,
            # Finer steps of an exact method are no more exact.
            4 * coarsest if METHODS[self.plan.method].exact else MOST_STEPS,
            left,
        )
        self.plan = self.plan._replace(steps_per_period=candidates[-1].steps)
        exponent = ", their exponent by {:.1e}" if self.plan.tangent else ""
        self.notes += [
            f"{tried.steps} steps per period: {tried.periodic_share * lanes:.0f} of {lanes} lanes "
            f"move periodically, their section is off by {tried.section_error:.1e}"
            f"{exponent.format(tried.exponent_error)}, wanted is {tolerance:g}; "
            f"{tried.changed_share * lanes:.0f} move in another way with finer steps"
            for tried in candidates
        ]

    @property
    def chosen(self) -> Chosen:
        """What the plan has now, after `choose_steps` for all who compute lanes of the sweep."""
        return Chosen(self.plan.steps_per_period, self.plan.transient_periods)

    @property
    def carried(self) -> bool:
        """Whether each value starts from the end state of its neighbour."""
        return self.config.start.carry != "none"

    @property
    def recording(self) -> kernels.Plan:
        """The plan with all that is recorded: what is kept, and what the labels are read off."""
        checked = POINTS_NEEDED if self.config.integration.error_check > 0.0 else 0
        wanted = MOST_POINTS if self.config.outputs.motion else checked
        enough = min(wanted * self.lanes.repeats_after, self.plan.recorded_periods)
        return self.plan._replace(section_points=max(self.plan.section_points, enough))

    @property
    def variables(self) -> list[Variable]:
        """The variables of the sweep, in the order of the file."""
        outputs, repeats = self.config.outputs, self.lanes.repeats_after
        of_teeth = f"periods of the excitation, {repeats} mesh periods each,"
        touched = self.plan.contact and self._splits_steps
        model = self.lanes.model
        signals = (*outputs.states, *model.signals[:1])
        parts: dict[Part, bool | Sequence[str]] = {
            catalogue.SECTION_POINTS_PART: bool(outputs.section),
            catalogue.SECTION_PART: outputs.section,
            catalogue.LYAPUNOV_PART: outputs.lyapunov,
            catalogue.MOTION_PART: outputs.motion,
            catalogue.RECORD_PART: outputs.motion and outputs.lyapunov,
            catalogue.EXPONENTS_PART: outputs.exponents,
            catalogue.CROSSINGS_PART: self._splits_steps,
            catalogue.CONTACT_PART: self._elements if touched else (),
            **(for_each(model.load_parts, self._elements) if self.plan.loads else {}),
            catalogue.EXTREMES_PART: outputs.states,
            catalogue.ORDERS_PART: bool(self.plan.orders),
            catalogue.AMPLITUDES_PART: signals if self.plan.orders else (),
            catalogue.CHECK_PART: self.config.integration.error_check > 0.0,
            catalogue.EVERY_SWEEP_PART: True,
        }
        values = {
            names.SECTION_POINT: np.arange(outputs.section_points),
            names.EXPONENT_NUMBER: np.arange(1, len(self.lanes.states) + 1),
            names.ORDER: np.array([float(order) for order in self.plan.orders]),
            names.STATE: np.arange(len(self.lanes.states)),
        }
        meanings = {
            "motion": MOTION_MEANINGS,
            names.RECORD: RECORD_MEANINGS,
            "contact_state_@": CONTACT_STATES,
            "motion_changed": error_check.MEANINGS,
            names.STATUS: [status.name.lower() for status in kernels.STATUS_TEXTS],
            names.STATE: self.lanes.states,
        }
        wordings = {"period": of_teeth if repeats > 1 else "mesh periods"}
        return model.catalogue.variables(
            self.lanes.axes, parts, Details(values, meanings, wordings)
        )

    @property
    def _splits_steps(self) -> bool:
        return self.plan.resolved and self.lanes.clearance

    @property
    def _elements(self) -> tuple[str, ...]:
        """Names of the clearance elements."""
        return self.lanes.model.elements(self.lanes.effects)

    def rehearse(self, periods: int = 0) -> None:
        """Integrate the first lane, and so many mesh periods of it step by step.

        The kernel of this scene is compiled for it, or loaded from the cache.
        """
        plan = self.plan._replace(transient_periods=0, section_points=0)
        plan = plan._replace(recorded_periods=periods, history_periods=periods)
        first = np.arange(1)
        kernels.integrate(self.lanes.system_of(first), self.lanes.start_of(first), plan)

    def block_memory(self, threads: int) -> int:
        """Return about how many bytes the arrays of one block take while it is computed."""
        states, lanes = len(self.lanes.states), min(len(self.lanes), self.block_lanes(threads))
        numbers, looked = (self.recording.section_points + 4) * states, 0
        if self.plan.tangent:
            numbers += self.plan.recorded_periods
            if self.config.outputs.motion:
                # Doubtful lanes are looked at again, a share at a time, but a whole lane at least.
                longest = 8 * numbers * LOOKS[-1]
                looked = max(8 * numbers * lanes, longest, min(longest * lanes, LOOK_BYTES))
        if self.config.outputs.exponents:
            numbers += self.plan.recorded_periods * states
        maps = 0
        if METHODS[self.plan.method].shares_maps:
            for block in np.arange(lanes), np.arange(len(self.lanes) - lanes, len(self.lanes)):
                system = self.lanes.system_of(block)
                maps = max(
                    maps, kernels.maps_memory(system, self.plan, fewest_stable_steps(system))
                )
        return 8 * lanes * numbers + looked + maps

    def block_lanes(self, threads: int) -> int:
        """Return how many lanes make a block: work for every thread, and progress to be seen."""
        lanes = kernels.LANES * max(8, 2 * threads)
        # What is left over of lanes side by side would fill no vector.
        return lanes - lanes % min(lanes, self.lanes.side_by_side)

    def blocks(self, size: int) -> list[Bounds]:
        """Cut the sweep into blocks of so many lanes, in the order in which they are computed."""
        lanes = len(self.lanes)
        return [(n, min(n + size, lanes)) for n in range(0, lanes, size)]

    def compute(self, first: int, last: int) -> dict[str, Any]:
        """Compute the lanes at the places ``first`` to ``last - 1`` of the order of computation.

        Gives every variable over lanes by its name. A carried sweep goes on from the lanes that it
        has computed before, or whose ends `ended` holds.
        """
        places = np.arange(first, last)
        found = self.integrate(places, self.recording)
        return self.arrays(self.lanes.computed_at(places), *found)

    @cached_property
    def ended(self) -> Floats:
        """End states of a carried sweep in the order of computation, not a number where unnames."""
        return np.full((len(self.lanes), len(self.lanes.states)), np.nan)

    def integrate(self, places: Integers, plan: kernels.Plan) -> tuple[Floats, kernels.Outcome]:
        """Integrate the lanes at such places by a plan, and return their start states as well."""
        check()
        many, starts, outcomes = self.lanes.side_by_side, [], []
        for some in np.split(places, range(many, places.size, many)):
            lanes = self.lanes.computed_at(some)
            starts.append(self.lanes.start_of(lanes))
            if self.carried:
                before = self.ended[np.maximum(some - many, 0)]
                # A lane that diverged hands nothing on: its successor begins anew.
                on = (some >= many) & np.isfinite(before).all(axis=1)
                starts[-1][on] = before[on]
            outcomes.append(kernels.integrate(self.lanes.system_of(lanes), starts[-1], plan))
            if self.carried:
                self.ended[some] = outcomes[-1].end_state
        if len(outcomes) == 1:
            return starts[0], outcomes[0]
        every: Any = map(np.concatenate, zip(*outcomes, strict=True))
        return np.concatenate(starts), kernels.Outcome(*every)

    def arrays(self, lanes: Integers, start: Floats, outcome: kernels.Outcome) -> dict[str, Any]:
        """Return what is kept of integrated lanes, by the name of the variable."""
        system, plan, outputs = self.lanes.system_of(lanes), self.plan, self.config.outputs
        sound = outcome.status == kernels.Status.OK
        arrays: dict[str, Any] = {
            "status": outcome.status,
            "diverged_period": outcome.diverged_period,
            "start_state": start,
            "end_state": outcome.end_state,
        }
        if self._splits_steps:
            crossings = outcome.crossings / plan.recorded_periods
            arrays["crossings_per_period"] = np.where(sound, crossings, np.nan)
            slowest = np.where(outcome.crossings > 0, outcome.slowest_crossing, np.nan)
            arrays["slowest_crossing"] = np.where(sound, slowest, np.nan)
            arrays["unsplit_steps"] = outcome.overflows
        arrays |= self._told_of_elements(system, outcome)
        for name in outputs.section:
            points = outcome.section[:, -plan.section_points :, system.states.index(name)]
            # A copy: a view would keep alive all that was recorded.
            arrays[f"section_{name}"] = points.copy()
        told = labels_of(system, outcome, self.recording) if outputs.motion else None
        if told is not None:
            arrays |= told.labels._asdict()
        largest = None
        if plan.tangent:
            period = told.labels.period if told else np.zeros(lanes.size, dtype=np.int32)
            state = told.state if told else outcome.end_state
            largest = largest_exponents(system, outcome, self.recording, period, state)
            arrays["lyapunov_exponent"] = largest.values
            arrays["lyapunov_exponent_standard_error"] = largest.standard_errors
            if told is not None:
                arrays["record"] = largest.record
        if outputs.exponents:
            spectrum = exponents(system, start, plan)
            if largest is not None:
                spectrum = spectrum.given(largest.of_orbit)
            arrays["lyapunov_exponents"] = spectrum.values
            arrays["lyapunov_exponents_standard_error"] = spectrum.standard_errors
            arrays["lyapunov_sum"] = sum_of_exponents(system)
        if self.config.integration.error_check > 0.0:
            arrays |= self._check(lanes, start, outcome, told)
        return arrays

    def _told_of_elements(
        self, system: kernels.LaneSystem, outcome: kernels.Outcome
    ) -> dict[str, Array]:
        """Return what is kept of contact, loads and states; of lanes that diverged none of it."""
        told: dict[str, Array] = {}
        if self.plan.contact and self._splits_steps:
            for number, way in enumerate(self._elements):
                found = contact_told(outcome.contact[:, number], self.plan.recorded_periods)
                told |= {f"{name}_{way}": values for name, values in found.items()}
        if self.plan.loads:
            told |= self.lanes.model.loads(outcome.loads, system)
        told |= states_told(outcome, self.plan, self.lanes.model.signals[:1])
        for values in told.values():
            if values.dtype != np.uint8:
                values[outcome.status != kernels.Status.OK] = np.nan
        return told

    def _check(
        self, lanes: Integers, start: Floats, outcome: kernels.Outcome, told: Told | None
    ) -> dict[str, Array]:
        """Integrate and label the checked lanes of a block again with half the step, and compare.

        Compared is what the labels know: the file may keep fewer section points. Added is what half
        the step does not show.
        """
        plan, kept = self.recording, self.config.outputs.section
        share = self.config.integration.error_check
        checked = error_check.checked_lanes(lanes // self.lanes.directions, share)
        section, exponent = np.full((2, lanes.size), np.nan)
        motion = np.full(lanes.size, error_check.NOT_CHECKED, dtype=np.uint8)
        if checked.size:
            half = plan._replace(steps_per_period=2 * plan.steps_per_period)
            system = self.lanes.system_of(lanes[checked])
            finer = kernels.integrate(system, start[checked], half)
            some = told and labels_of(system, finer, half)
            fine = solution_of(system, finer, half, kept, some)
            some = told and Told(told.labels.of(checked), told.state[checked])
            theirs: Any = (array[checked] for array in outcome)
            ended = kernels.Outcome(*theirs)
            coarse = solution_of(system, ended, plan, kept, some)
            coarse = completed(coarse, system, ended, plan, kept, some)
            found = difference(coarse, fine)
            section[checked], exponent[checked] = found.section_error, found.exponent_error
            motion[checked] = np.where(found.changed, error_check.CHANGED, error_check.SAME)
        return dict(zip(error_check.CHECKED, (section, exponent, motion), strict=True))


def states_told(
    outcome: kernels.Outcome, plan: kernels.Plan, signals: Sequence[str]
) -> dict[str, Floats]:
    """Return extremes of the states of a plan, and amplitudes at its orders, by name.

    ``signals``: name of the observed signal of which there are amplitudes.
    """
    told: dict[str, Floats] = {}
    for number, state in enumerate(plan.states):
        smallest, largest = outcome.extremes[:, number].T
        ends = smallest, largest, largest - smallest
        told |= {f"{state}_{name}": end for name, end in zip(names.EXTREMES, ends, strict=True)}
    if plan.orders:
        amplitudes = (f"{names.AMPLITUDE}{one}" for one in (*plan.states, *signals))
        told |= zip(amplitudes, np.moveaxis(outcome.amplitudes, 1, 0), strict=True)
    return told
