"""A configured sweep, computed block by block."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from gearchaos_kernels import (
    LANES,
    STATE_ROWS,
    STATUS_TEXTS,
    Model,
    Outcome,
    Plan,
    Scene,
    Status,
    integrate,
)
from numpy.typing import NDArray

from gearchaos.configuration import Configuration, lane_groups
from gearchaos.configuration.run_tables import states_of
from gearchaos.configuration.sweep_values import SWEEPABLE_GROUPS, SWEEPABLE_KEYS
from gearchaos.error_check import MEANINGS, check_arrays, checked_lanes
from gearchaos.errors import ConfigurationError
from gearchaos.group_table import GROUP_TABLE
from gearchaos.lanes import model, select, start_states
from gearchaos.lyapunov import largest_exponent
from gearchaos.motion_difference import Motion, difference
from gearchaos.motion_period import POINTS_NEEDED
from gearchaos.result import Parameter
from gearchaos.spectrum import exponents, sum_of_exponents
from gearchaos.stability import stability_limit
from gearchaos.step_choice import PILOT_LANES, PILOT_PERIODS, Candidate, choose_steps
from gearchaos.variables import Variable, axis_name, step_choice_variables, sweep_variables

Arrays = Mapping[str, NDArray[Any]]
Bounds = tuple[int, int]


class Simulation:
    """One configured sweep: what it yields, and the means to compute any block of its lanes.

    Lanes are ordered by the swept value; where a value has several starts, these follow one
    another. A lane's result depends on its number in the sweep and nothing else.

    Parameters
    ----------
    config : Configuration
    """

    def __init__(self, config: Configuration) -> None:
        self.config = config
        self.values, self.groups = lane_groups(config)
        self.starts = config.start.count
        self.lanes = self.values.size * self.starts
        self.effects = config.needed_effects
        self.states = states_of(self.effects)
        self.scene = Scene(**{effect: effect in self.effects for effect in Scene._fields})
        self.plan = Plan(
            steps_per_period=config.integration.steps_per_period,
            transient_periods=config.integration.transient_periods,
            recorded_periods=config.integration.recorded_periods,
            section_points=config.outputs.section_points if config.outputs.section else 0,
            section_states=config.outputs.section,
            tangent=config.outputs.lyapunov,
            resolved=config.integration.crossings == "resolved",
        )
        self._choice: list[Variable] = []
        self.notes: list[str] = []
        """What a user should know before the sweep begins."""
        self._keep_stable()

    @property
    def axis(self) -> str:
        """Name of the dimension of the lanes."""
        return axis_name(self.config.sweep.parameter)

    @property
    def carried(self) -> bool:
        """Whether each value starts from the end state of its neighbour."""
        return self.config.start.carry != "none"

    @property
    def splits_steps(self) -> bool:
        """Whether steps are split where they cross a clearance boundary."""
        return self.plan.resolved and self.scene.backlash

    @property
    def steps(self) -> int:
        """Runge-Kutta steps of the whole sweep."""
        periods = self.plan.transient_periods + self.plan.recorded_periods
        return self.lanes * periods * self.plan.steps_per_period

    @property
    def variables(self) -> list[Variable]:
        """What the sweep yields."""
        units, long_name, symbol = self._wording()
        checked = self.config.integration.error_check > 0.0
        of_the_lanes = sweep_variables(
            self.axis,
            units=units,
            long_name=long_name,
            symbol=symbol,
            states=self.states,
            section=self.config.outputs.section,
            section_points=self.config.outputs.section_points,
            lyapunov=self.config.outputs.lyapunov,
            crossings=self.splits_steps,
            spectrum=self.config.outputs.spectrum,
            several_starts=self.starts > 1,
            status_meanings=[status.name.lower() for status in STATUS_TEXTS],
            check_meanings=MEANINGS if checked else (),
        )
        return of_the_lanes + self._choice

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The groups of the model with their origin; those that no effect needs are left out."""
        parameters = {}
        for row in GROUP_TABLE:
            value = getattr(self.groups, row.name)
            if value is None or not row.needed_by(self.effects):
                continue
            swept = np.ndim(value) > 0 and not row.is_list
            parameters[row.name] = Parameter(
                np.repeat(value, self.starts) if swept else value,
                "swept" if swept else self.groups.origin[row.name],
                row.units,
                row.long_name,
                row.mathtext,
            )
        return parameters

    def compile(self) -> None:
        """Compile the kernel of this scene, or load it from the cache."""
        self.rehearse(1, 0)

    def rehearse(self, lanes: int, periods: int) -> int:
        """Integrate the first lanes for a few mesh periods and return the number of steps."""
        plan = self.plan._replace(transient_periods=0, recorded_periods=periods, section_points=0)
        numbers = np.arange(lanes)
        self._integrate(numbers, self._start(numbers), plan)
        return lanes * periods * plan.steps_per_period

    def block_memory(self, threads: int) -> int:
        """Return about how many bytes the arrays of one block take while it is computed."""
        numbers = self.plan.section_points * len(self.plan.section_states) + 4 * len(STATE_ROWS)
        if self.plan.tangent:
            numbers += self.plan.recorded_periods
        return 8 * self.block_lanes(threads) * numbers

    def block_lanes(self, threads: int) -> int:
        """Return how many lanes make a block: work for every thread, and progress to be seen."""
        lanes = LANES * max(8, 2 * threads)
        # A carried sweep hands on whole values.
        return max(self.starts, lanes - lanes % self.starts) if self.carried else lanes

    def in_order(self, bounds: Iterable[Bounds]) -> list[Bounds]:
        """Sort the bounds of blocks into the order in which they are to be computed."""
        return sorted(bounds, reverse=self.config.start.carry == "downwards")

    def compute(self, first: int, last: int, neighbour: Arrays | None = None) -> dict[str, Any]:
        """Compute the lanes ``first`` to ``last - 1``.

        Parameters
        ----------
        first, last : int
            Bounds of the block, from `blocks`.
        neighbour : mapping of str to ndarray, optional
            What the block before this one yielded; a carried sweep goes on from its end states.

        Returns
        -------
        dict
            The lanes' part of every variable that runs over lanes, by name.
        """
        if not self.carried:
            lanes = np.arange(first, last)
            start = self._start(lanes)
            arrays = self._arrays(first, self._integrate(lanes, start))
            if self.config.outputs.spectrum:
                arrays |= self._spectrum(lanes, start)
            return arrays | self._check(arrays, lanes, start)
        return self._compute_carried(first, last, neighbour)

    def _keep_stable(self) -> None:
        """Refuse or raise a number of steps with which the method itself would blow up."""
        steps = self.plan.steps_per_period
        harmonics = self._harmonics()
        limit = stability_limit(
            self.scene, model(self.groups, self.values.size), *harmonics, steps=steps
        )
        if limit is None:
            return
        fault = limit.fault(steps, self.config.sweep.parameter, self.values)
        if self.config.integration.unstable == "refuse":
            raise ConfigurationError(fault.text(self.config.source))
        self.plan = self.plan._replace(steps_per_period=limit.steps)
        self.notes.append(
            f"integration.steps_per_period raised from {steps} to {limit.steps}, the stability "
            f"limit of {limit.lanes.size} of {self.values.size} values"
        )

    def _harmonics(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        nothing = np.zeros(0)
        cosine, sine = self.groups.stiffness_cosine, self.groups.stiffness_sine
        return nothing if cosine is None else cosine, nothing if sine is None else sine

    def _compute_carried(self, first: int, last: int, neighbour: Arrays | None) -> dict[str, Any]:
        downwards = self.config.start.carry == "downwards"
        columns = [STATE_ROWS[name] for name in self.states]
        carried = None
        if neighbour is not None:
            carried = np.full((self.starts, len(STATE_ROWS)), 0.0)
            edge = slice(None, self.starts) if downwards else slice(-self.starts, None)
            carried[:, columns] = neighbour["end_state"][edge]
        parts: list[Outcome] = []
        starts: list[NDArray[np.float64]] = []
        for lane in range(first, last, self.starts)[:: -1 if downwards else 1]:
            lanes = np.arange(lane, lane + self.starts)
            starts.append(self._start(lanes, carried))
            parts.append(self._integrate(lanes, starts[-1]))
            carried = parts[-1].end_state
        if downwards:
            parts.reverse()
            starts.reverse()
        merged: Any = [
            None if arrays[0] is None else np.concatenate(arrays)
            for arrays in zip(*parts, strict=True)
        ]
        arrays = self._arrays(first, Outcome(*merged))
        return arrays | self._check(arrays, np.arange(first, last), np.concatenate(starts))

    def _check(
        self, arrays: Arrays, lanes: NDArray[np.intp], start: NDArray[np.float64]
    ) -> dict[str, Any]:
        """Compute a share of the lanes again with half the step and compare."""
        share = self.config.integration.error_check
        if share == 0.0:
            return {}
        checked = checked_lanes(int(lanes[0]), int(lanes[-1]) + 1, share)
        finer = self._motion(
            lanes[checked],
            start[checked],
            self.plan._replace(steps_per_period=2 * self.plan.steps_per_period),
        )
        exponent = arrays.get("lyapunov_exponent")
        coarser = Motion(
            np.stack([arrays[f"section_{n}"][checked] for n in self.plan.section_states], axis=2),
            None if exponent is None else exponent[checked],
            arrays["status"][checked] != Status.OK,
        )
        return check_arrays(lanes.size, checked, difference(coarser, finer))

    def _motion(self, lanes: NDArray[np.intp], start: NDArray[np.float64], plan: Plan) -> Motion:
        outcome = self._integrate(lanes, start, plan)
        exponent = None
        if outcome.growth is not None:
            exponent, _ = largest_exponent(outcome.growth, self._periods(lanes))
        return Motion(outcome.section, exponent, outcome.status != Status.OK)

    def choose_steps(self) -> None:
        """Measure which number of steps the configured tolerance needs, and take it."""
        tolerance = self.config.integration.tolerance
        if tolerance is None:
            return
        coarsest = self.plan.steps_per_period
        lanes, motion = self.pilot(PILOT_LANES, 4 * coarsest)
        candidates = choose_steps(
            partial(motion, resolved=self.plan.resolved), coarsest, tolerance, self.config.source
        )
        steps, *measured = zip(*candidates, strict=True)
        self._choice = step_choice_variables(
            steps, dict(zip(Candidate._fields[1:], measured, strict=True))
        )
        self.plan = self.plan._replace(steps_per_period=candidates[-1].steps)
        self.notes.append(
            f"{candidates[-1].steps} steps per period: on {lanes} lanes the error is "
            f"{candidates[-1].error:.1e}, wanted is {tolerance:g}"
        )

    def pilot(self, lanes: int, finest: int) -> tuple[int, Callable[..., Motion]]:
        """Prepare to integrate some lanes of the sweep on several grids, to compare them.

        Parameters
        ----------
        lanes : int
            Lanes wanted, spread evenly over the sweep.
        finest : int
            Steps per period of the transient that all grids go on from, so that a lane comes to
            the same one of several coexisting motions on each of them.

        Returns
        -------
        lanes : int
            Number of lanes that there are.
        motion : callable
            ``motion(steps, resolved)`` settles on that grid and returns the `Motion`.
        """
        count = min(lanes, self.lanes)
        numbers = np.unique(np.linspace(0, self.lanes - 1, count).round().astype(np.intp))
        transient = self.plan._replace(
            steps_per_period=finest,
            recorded_periods=0,
            section_points=0,
            tangent=False,
            resolved=True,
        )
        common = self._integrate(numbers, self._start(numbers), transient).end_state

        def motion(steps: int, resolved: bool) -> Motion:
            plan = self.plan._replace(
                steps_per_period=steps,
                transient_periods=PILOT_PERIODS,
                recorded_periods=PILOT_PERIODS,
                section_points=min(POINTS_NEEDED, PILOT_PERIODS),
                resolved=resolved,
            )
            return self._motion(numbers, common, plan)

        return numbers.size, motion

    def _periods(self, lanes: NDArray[np.intp]) -> NDArray[np.float64]:
        """Mesh period of each lane in units of tau."""
        frequency = select(self.groups, lanes // self.starts).mesh_frequency
        return np.broadcast_to(2.0 * np.pi / np.float64(frequency), lanes.shape)

    def _lane_model(self, lanes: NDArray[np.intp]) -> Model:
        return model(select(self.groups, lanes // self.starts), lanes.size)

    def _start(
        self, lanes: NDArray[np.intp], carried: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        start = start_states(self.config, self._lane_model(lanes), lanes)
        if carried is None:
            return start
        # A lane that diverged hands nothing on: its successor begins anew.
        return np.where(np.isfinite(carried).all(axis=1, keepdims=True), carried, start)

    def _spectrum(self, lanes: NDArray[np.intp], start: NDArray[np.float64]) -> dict[str, Any]:
        lane_model = self._lane_model(lanes)
        spectrum = exponents(
            self.scene,
            lane_model,
            *self._harmonics(),
            start,
            self.plan,
            rederived=self.config.formulation == "rederived",
        )
        return {
            "lyapunov_spectrum": spectrum.exponents,
            "lyapunov_spectrum_standard_error": spectrum.standard_errors,
            "lyapunov_sum": sum_of_exponents(self.scene, lane_model),
        }

    def _integrate(
        self, lanes: NDArray[np.intp], start: NDArray[np.float64], plan: Plan | None = None
    ) -> Outcome:
        return integrate(
            self.scene,
            self._lane_model(lanes),
            *self._harmonics(),
            start,
            plan or self.plan,
            rederived=self.config.formulation == "rederived",
        )

    def _arrays(self, first: int, outcome: Outcome) -> dict[str, Any]:
        numbers = np.arange(first, first + outcome.status.size)
        value = numbers // self.starts
        arrays: dict[str, Any] = {
            self.axis: self.values[value],
            "start": numbers % self.starts,
            "status": outcome.status,
            "diverged_period": outcome.diverged_period,
            "end_state": outcome.end_state[:, [STATE_ROWS[name] for name in self.states]],
        }
        if self.splits_steps:
            sound = outcome.status == Status.OK
            crossings = outcome.crossings / self.plan.recorded_periods
            arrays["crossings_per_period"] = np.where(sound, crossings, np.nan)
            slowest = np.where(outcome.crossings > 0, outcome.slowest_crossing, np.nan)
            arrays["slowest_crossing"] = np.where(sound, slowest, np.nan)
            arrays["unsplit_steps"] = outcome.overflows
        for column, name in enumerate(self.plan.section_states):
            arrays[f"section_{name}"] = outcome.section[:, :, column]
        if outcome.growth is not None:
            exponent, standard_error = largest_exponent(outcome.growth, self._periods(numbers))
            arrays["lyapunov_exponent"] = exponent
            arrays["lyapunov_exponent_standard_error"] = standard_error
        wanted = {v.name for v in self.variables if v.dims[0] == self.axis}
        return {name: array for name, array in arrays.items() if name in wanted}

    def _wording(self) -> tuple[str, str, str]:
        parameter = self.config.sweep.parameter
        if parameter in SWEEPABLE_GROUPS:
            row = SWEEPABLE_GROUPS[parameter]
            return row.units, row.long_name, row.mathtext
        key = SWEEPABLE_KEYS[parameter]
        return key.units or "1", key.wording, ""


def compute_all(
    simulation: Simulation,
    bounds: Sequence[Bounds],
    finished: Mapping[Bounds, Callable[[], Arrays]] | None = None,
) -> Iterator[tuple[Bounds, Arrays]]:
    """Compute blocks one after the other, skipping the finished ones.

    Parameters
    ----------
    simulation : Simulation
    bounds : sequence of (first, last)
        Blocks that cover the sweep, ordered by `Simulation.in_order`.
    finished : mapping, optional
        Bounds of finished blocks with a way to read them; a carried sweep goes on from them.
    """
    finished = finished or {}
    read: Callable[[], Arrays] | None = None
    for block in bounds:
        if block in finished:
            read = finished[block]
            continue
        neighbour = read() if read is not None and simulation.carried else None
        arrays = simulation.compute(*block, neighbour)
        yield block, arrays
        read = partial(_same, arrays)


def _same(arrays: Arrays) -> Arrays:
    return arrays
