"""The controllers of the lanes of a run, and what a result says of them."""

from collections.abc import Mapping

import gearchaos_kernels as kernels
import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Codes, Floats, Integers
from gearchaos.dynamics.control import require_controllable
from gearchaos.dynamics.controllers import ControlSettings, Designed, Target, control_of
from gearchaos.engine.run_plan import RunPlan
from gearchaos.engine.target_orbits import machine_at, target_orbits
from gearchaos.errors import ConfigurationError
from gearchaos.records.control import NO_GAIN, NO_ORBIT, NOT_CAPTURED, OFF

NUMBERS_PER_COUNTER = 4
"""Random numbers per Philox counter."""


class Controllers:
    """The controllers of all lanes of a run; a gain is designed when a lane first needs it.

    Attributes
    ----------
    orbits : TargetOrbits
        The orbits on which they keep the lanes.
    """

    def __init__(self, run: RunPlan) -> None:
        control = run.config.control
        assert control is not None
        self._run, self._control, self.orbits = run, control, target_orbits(run)
        self._targets: dict[int, Target] = {}
        self._designs: dict[tuple[int, ControlSettings], tuple[Designed, int]] = {}

    def of(
        self, lanes: Integers, values: Mapping[str, Floats], system: kernels.LaneSystem
    ) -> kernels.Control:
        """Return the controllers of some lanes.

        ``lanes`` (lanes,): their numbers in the sweep; ``values``: of the swept parameters, each
        (lanes,); ``system``: their system.
        """
        designs, rows = self._designs_of(lanes, values)
        control = control_of([design for design, _ in designs], system).of(rows)
        idle = np.array([state != NOT_CAPTURED for _, state in designs])[rows]
        limit = self._limit(lanes, values, system)
        factor = self._setting("gain_factor", lanes, values)
        return control._replace(
            # With a negative limit, no input is ever small enough.
            limit=np.where(idle, -1.0, limit),
            gain=control.gain * factor[:, np.newaxis, np.newaxis],
            seeds=_seeds(self._control.seed, lanes),
        )

    def states_of(self, lanes: Integers, values: Mapping[str, Floats]) -> Codes:
        """Return `NOT_CAPTURED` for lanes with a controller, otherwise why they have none."""
        designs, rows = self._designs_of(lanes, values)
        states = np.array([state for _, state in designs], dtype=np.uint8)[rows]
        off = self._setting(self._limit_key(values), lanes, values) == 0.0
        return np.where(off, np.uint8(OFF), states)

    def noise_of(self, lanes: Integers, values: Mapping[str, Floats]) -> Floats:
        """Return the noise of lanes in the scales of the states, (lanes,)."""
        return self._setting("noise", lanes, values)

    def unit_of(self, lanes: Integers, values: Mapping[str, Floats]) -> Floats | None:
        """Return the size of an input of 1 in N m or force, (lanes,); None if it is not known."""
        run = self._run
        unit = run.lanes.model.input_unit(run.config, values)
        return None if unit is None else np.broadcast_to(unit, lanes.shape)

    def described(self) -> str:
        """Return what is controlled, in words."""
        config, control, orbits = self._run.config, self._control, self.orbits
        absolute = config.absolute_limit
        value = getattr(control, absolute)
        if not {"control.limit", f"control.{absolute}"}.isdisjoint(config.swept):
            limit = "within the swept limits"
        elif value is None:
            limit = f"within {100.0 * (control.limit or 0.0):g} % of it"
        else:
            limit = f"within {value:g}{' N m' if absolute == 'limit_Nm' else ''}"
        actuator = config.actuator_of(control.actuator)
        along = f" for {orbits.exists} of {orbits.values.size} values" if orbits.parameter else ""
        return (
            f"{actuator} {limit}, {control.gain}, period-{control.period} orbit found"
            f"{orbits.place}{along}, from mesh period {control.begins} on"
        )

    def _setting(self, name: str, lanes: Integers, values: Mapping[str, Floats]) -> Floats:
        """Return the value of a key of [control] in every lane, (lanes,)."""
        value = values.get(f"control.{name}", getattr(self._control, name))
        return np.broadcast_to(np.asarray(value, dtype=np.float64), lanes.shape)

    def _limit_key(self, values: Mapping[str, Floats]) -> str:
        """Return the key of the limit: that of a share, or of a value in the unit of the input."""
        absolute = self._run.config.absolute_limit
        given = getattr(self._control, absolute) is not None or f"control.{absolute}" in values
        return absolute if given else "limit"

    def _limit(
        self, lanes: Integers, values: Mapping[str, Floats], system: kernels.LaneSystem
    ) -> Floats:
        """Return the limits of lanes in the units of the equations, (lanes,)."""
        key = self._limit_key(values)
        limit = self._setting(key, lanes, values)
        if key == "limit":
            return limit * np.abs(system.steady_input)
        unit = self.unit_of(lanes, values)
        if unit is None:
            raise ConfigurationError(
                f"{self._run.config.source}: control.{key}: needs operation.torque_Nm, from "
                "which the load follows; give that, or control.limit as a share of the load"
            )
        return limit / unit

    def _designs_of(
        self, lanes: Integers, values: Mapping[str, Floats]
    ) -> tuple[list[tuple[Designed, int]], Integers]:
        """Return the different designs of lanes with their states, and the one of each lane."""
        orbits = self.orbits
        at = np.searchsorted(orbits.values, values.get(orbits.parameter, np.zeros(lanes.shape)))
        names = "state_weight", "input_weight", "noise"
        columns = [at, *(self._setting(name, lanes, values) for name in names)]
        different, rows = np.unique(np.column_stack(columns), axis=0, return_inverse=True)
        return [self._design(int(place), *some) for place, *some in different], rows.ravel()

    def _design(
        self, at: int, state_weight: float, input_weight: float, noise: float
    ) -> tuple[Designed, int]:
        """Return the design at a number of the values of the parameter, and its state."""
        given = self._control
        settings = ControlSettings(
            given.gain,
            float(state_weight),
            float(input_weight),
            measured=given.measured,
            noise=float(noise),
            begins=given.begins,
        )
        if (at, settings) not in self._designs:
            self._designs[at, settings] = self._new_design(at, settings)
        return self._designs[at, settings]

    def _new_design(self, at: int, settings: ControlSettings) -> tuple[Designed, int]:
        """Return a new design and its state; an idle one where there is no orbit or no gain."""
        orbits, run = self.orbits, self._run
        system = machine_at(run, orbits.parameter, orbits.values[at : at + 1])
        period, states = self._control.period, len(system.states)
        idle = Target.idle(period * system.repeats_after, states)
        nothing = Designed(idle, np.zeros_like(idle.maps.points), settings)
        if not np.isfinite(orbits.points[at]).all():
            return nothing, NO_ORBIT
        if at not in self._targets:
            self._targets[at] = Target.at(system, orbits.points[at], period, run.plan)
        target = self._targets[at]
        try:
            require_controllable(target.maps, run.config.source)
            return Designed(target, target.gain(settings), settings), NOT_CAPTURED
        except (ConfigurationError, np.linalg.LinAlgError):
            return nothing, NO_GAIN


def _seeds(seed: int, lanes: Integers) -> NDArray[np.uint64]:
    """Return a seed for the noise of each lane (lanes,), from the number of the lane only."""
    seeds = np.empty(lanes.shape, dtype=np.uint64)
    for run in np.split(np.arange(lanes.size), np.flatnonzero(np.diff(lanes) != 1) + 1):
        generator = np.random.Philox(seed)
        generator.advance(int(lanes[run[0]]))
        seeds[run] = generator.random_raw(NUMBERS_PER_COUNTER * run.size)[::NUMBERS_PER_COUNTER]
    return seeds
