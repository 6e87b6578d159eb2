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
    Outcome,
    Plan,
    Status,
)
from numpy.typing import NDArray

from gearchaos.configuration.sweep_values import SWEEPABLE_GROUPS, SWEEPABLE_KEYS
from gearchaos.dynamics.exponents import exponents, sum_of_exponents
from gearchaos.engine.error_check import MEANINGS, check_arrays, checked_lanes
from gearchaos.engine.labelling import labelling_plan, labels_of
from gearchaos.engine.sweep_lanes import SweepLanes
from gearchaos.gear.group_table import GROUP_TABLE
from gearchaos.records.difference import Motion, difference
from gearchaos.records.label import MEANINGS as MOTION_MEANINGS
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.results.result import Parameter
from gearchaos.results.variables import Variable, sweep_variables

Arrays = Mapping[str, NDArray[Any]]
Bounds = tuple[int, int]


class Simulation(SweepLanes):
    """One configured sweep: what it yields, and the means to compute any block of its lanes.

    Parameters
    ----------
    config : Configuration
    """

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
            motion_meanings=MOTION_MEANINGS if self.config.outputs.motion else (),
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

    @property
    def recording(self) -> Plan:
        """The plan with all that is recorded: what is kept, and what the labels are read off."""
        return labelling_plan(self) if self.config.outputs.motion else self.plan

    def compile(self) -> None:
        """Compile the kernel of this scene, or load it from the cache."""
        self.rehearse(1, 0)

    def rehearse(self, lanes: int, periods: int) -> int:
        """Integrate the first lanes for a few mesh periods and return the number of steps."""
        plan = self.plan._replace(transient_periods=0, recorded_periods=periods, section_points=0)
        numbers = np.arange(lanes)
        self.integrate(numbers, self.start_of(numbers), plan)
        return lanes * periods * plan.steps_per_period

    def block_memory(self, threads: int) -> int:
        """Return about how many bytes the arrays of one block take while it is computed."""
        plan = self.recording
        numbers = plan.section_points * len(plan.section_states) + 4 * len(STATE_ROWS)
        if self.plan.tangent:
            numbers += self.plan.recorded_periods
            # Lanes that a first record leaves unresolved are looked at again in parts of this size.
            numbers *= 2 if self.config.outputs.motion else 1
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
            start = self.start_of(lanes)
            arrays = self._arrays(first, self.integrate(lanes, start, self.recording))
            if self.config.outputs.spectrum:
                arrays |= self._spectrum(lanes, start)
            return arrays | self._check(arrays, lanes, start)
        return self._compute_carried(first, last, neighbour)

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
            starts.append(self.start_of(lanes, carried))
            parts.append(self.integrate(lanes, starts[-1], self.recording))
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
        finer = self.motion_of(
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

    def _spectrum(self, lanes: NDArray[np.intp], start: NDArray[np.float64]) -> dict[str, Any]:
        lane_model = self.model_of(lanes)
        spectrum = exponents(
            self.scene,
            lane_model,
            *self.harmonics(),
            start,
            self.plan,
            rederived=self.config.formulation == "rederived",
        )
        return {
            "lyapunov_spectrum": spectrum.exponents,
            "lyapunov_spectrum_standard_error": spectrum.standard_errors,
            "lyapunov_sum": sum_of_exponents(self.scene, lane_model),
        }

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
        recorded, points = self.recording.section_states, self.plan.section_points
        for name in self.plan.section_states:
            # A copy: a view would keep alive all that was recorded.
            arrays[f"section_{name}"] = outcome.section[:, -points:, recorded.index(name)].copy()
        if outcome.growth is not None:
            exponent, standard_error = largest_exponent(outcome.growth, self.periods_of(numbers))
            arrays["lyapunov_exponent"] = exponent
            arrays["lyapunov_exponent_standard_error"] = standard_error
        if self.config.outputs.motion:
            arrays |= labels_of(self, numbers, outcome)._asdict()
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
