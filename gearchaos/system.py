"""One gear pair at one operating point: motions, orbits, stability and exponents.

>>> import gearchaos
>>> system = gearchaos.System("sweeps/pan2021.toml", pitch_error=10.75)
>>> system.orbit(period=2).multipliers
"""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple, Self

import gearchaos_kernels as kernels
import numpy as np
from gearchaos_kernels import Plan, Status

from gearchaos.arguments import (
    coordinates,
    finite_number,
    instance,
    one_of,
    whole_number,
)
from gearchaos.arguments import state as checked_state
from gearchaos.arrays import Floats
from gearchaos.dynamics.arclength import along_the_way
from gearchaos.dynamics.branch_range import BranchRange
from gearchaos.dynamics.branches import trace
from gearchaos.dynamics.embedded import embedded_orbits, record_length
from gearchaos.dynamics.exponents import (
    Exponents,
    contact_shares,
    exponents,
    sum_of_exponents,
)
from gearchaos.dynamics.following import Branch, Followed, Orbit, follow
from gearchaos.dynamics.orbits import NEIGHBOURHOOD, Orbits, exponents_of, polish
from gearchaos.dynamics.plans import plan_of
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.dynamics.stability_loss import NOT_LOST, STABILITY_LOSS_TEXTS, StabilityLoss
from gearchaos.engine.branching import arrays_of_branch
from gearchaos.engine.choosing import with_chosen_steps
from gearchaos.engine.lanes import Lanes, start_states
from gearchaos.engine.method_choice import for_continuation, with_method
from gearchaos.engine.recomputing import computable
from gearchaos.engine.response import respond, sampled_steps
from gearchaos.engine.run_plan import plan_run
from gearchaos.engine.running import one_thread
from gearchaos.engine.steps import stable_steps
from gearchaos.errors import ConfigurationError
from gearchaos.models import Given, axis_values, configuration_of, swept_values
from gearchaos.models.registry import model_of, system_of
from gearchaos.outputs.catalogue import DEFAULT_PERIODS
from gearchaos.outputs.names import axis_name
from gearchaos.records.amplitude_spectrum import SpectralLines, spectral_lines
from gearchaos.records.branch import PeriodicBranch
from gearchaos.records.period import coordinate_scale
from gearchaos.results.reading.result import Result


class Trajectory(NamedTuple):
    """A motion with every step of the integration.

    Attributes
    ----------
    time : array, shape (samples,)
        Time in mesh periods.
    states : array, shape (samples, states)
        Dimensionless states (eq. 13 of Pan, Li, Wang 2021).
    first_period : int
        Mesh periods before the first sample.
    """

    time: Floats
    states: Floats
    first_period: int = 0


class System:
    """A gear pair with all its parameters fixed.

    Parameters
    ----------
    config : Configuration or path
        Scene, start and integration. Swept parameters must be fixed by ``at`` or ``groups``.
    at : mapping of str to float, optional
        Values of parameters by their paths, such as ``{"operation.speed_rpm": 12000.0}``.
    **groups : float
        Values of parameters by their names or those of their axes, such as ``pitch_error=10.75`` or
        ``operation_speed_rpm=12000.0``.

    Attributes
    ----------
    config : Configuration
        The configuration with all parameters fixed.
    state : array, shape (states,)
        Dimensionless state in which motions start unless another start is given.

    Raises
    ------
    ConfigurationError
        If a swept parameter is not fixed, if a parameter is unknown or out of its range, or if the
        steps per period are unstable.

    Examples
    --------
    >>> system = gearchaos.System("sweeps/pan2021.toml", pitch_error=10.75)
    >>> system.orbit(period=2).stable
    True
    """

    def __init__(
        self, config: Given, at: Mapping[str, float] | None = None, **groups: float
    ) -> None:
        config = configuration_of(config)
        of_axes = {axis_name(one): one for one in config.parameters}
        named = {of_axes.get(name, name): value for name, value in groups.items()}
        values = coordinates("at", at or {}) | coordinates("groups", named)
        self.config, _ = with_method(config.without_control().at(values))
        for sweep in self.config.sweeps.values():
            if swept_values(sweep).size > 1:
                raise ConfigurationError(
                    f"{config.source}: {sweep.parameter}: is swept, and a system has one value of "
                    f"it; give {sweep.parameter}, such as System(config, at="
                    f'{{"{sweep.parameter}": ...}})'
                )
        lanes = Lanes(self.config)
        self._first_steps, _ = stable_steps(lanes, self.config.integration.fixed_steps)
        self._record = self._at({})
        self.state = start_states(self.config, self._record, np.zeros(1, dtype=np.intp))[0]

    @classmethod
    def of_lane(cls, result: Result, **coordinates: float | str) -> Self:
        """Return the system of one lane of a result; it starts at the end of the lane.

        Parameters
        ----------
        result : Result
            Result of a sweep or a response.
        **coordinates : float or str
            One value per axis of the result, by name; the nearest lane is taken.

        Returns
        -------
        System
            The system.

        Raises
        ------
        ConfigurationError
            If a coordinate is missing or names no axis.
        FileError
            If the result does not contain its configuration.

        Examples
        --------
        >>> result = gearchaos.open_result("pan2021.h5")
        >>> last = gearchaos.System.of_lane(result, pitch_error=5.0)
        >>> bool((last.state == result.sel(pitch_error=5.0, method="nearest")["end_state"]).all())
        True
        """
        instance("result", result, Result, "open_result reads it from a file")
        missing = [axis for axis in result.axes if axis not in coordinates]
        if missing:
            raise ConfigurationError(f"give a value of {', '.join(missing)}, an axis of the result")
        lane = result.sel(method="nearest", **coordinates)
        system = cls(computable(lane, "the result"))
        ended = dict(zip(lane.variables["state"].flags, lane["end_state"], strict=True))
        system.state = np.array([ended.get(name, 0.0) for name in system.states])
        return system

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self._record.states

    @property
    def groups(self) -> dict[str, float]:
        """Dimensionless groups of the gear pair as the kernels use them, angles in rad."""
        return {name: float(value[0]) for name, value in self._pair.groups._asdict().items()}

    @property
    def _pair(self) -> kernels.GearPairs:
        """The system of the lane if its model is the gear pair."""
        if not isinstance(self._record, kernels.GearPairs):
            raise ConfigurationError(
                f"{self.config.source}: is no gear pair, and has neither its groups nor its mesh"
            )
        return self._record

    @property
    def equations(self) -> kernels.LaneSystem:
        """The equations of motion as a batch of one lane for the kernels."""
        return self._record

    @property
    def plan(self) -> Plan:
        """The plan of the configured integration, without what a sweep records."""
        return self._plan

    @property
    def mesh_period(self) -> float:
        """Duration of a mesh period, 2 pi / Omega, in units of tau."""
        return float(self._record.mesh_period[0])

    @property
    def repeats_after(self) -> int:
        """Mesh periods per excitation period: 1, or until the same teeth meet again."""
        return self._record.repeats_after

    def __repr__(self) -> str:
        effects = ", ".join(self.config.scene.effects) or "no effects"
        return f"<System {self.config.title!r}: {len(self.states)} states, {effects}>"

    def integrate(
        self, periods: int, transient: int = 0, start: Floats | None = None
    ) -> Trajectory:
        """Integrate the motion and keep every step after the transient.

        Parameters
        ----------
        periods : int
            Mesh periods that are kept.
        transient : int
            Mesh periods before them.
        start : array, shape (states,), optional
            Dimensionless state at mesh phase 0; by default `state`.

        Returns
        -------
        Trajectory
            The motion, both ends included.

        Raises
        ------
        ConfigurationError
            If the motion leaves the range of numbers.

        Examples
        --------
        >>> motion = system.integrate(periods=2, transient=10)
        >>> motion.time[-1], motion.states.shape[1]
        (np.float64(2.0), 6)
        """
        periods = whole_number("periods", periods, least=1)
        transient = whole_number("transient", transient, least=0)
        return self._moved(self._steps, periods, transient, self._start(start))

    def _moved(self, steps: int, periods: int, transient: int, start: Floats) -> Trajectory:
        """Return a motion from a start (1, states) with a number of steps per mesh period."""
        plan = self._plan._replace(
            steps_per_period=steps,
            transient_periods=transient,
            recorded_periods=periods,
            history_periods=periods,
        )
        outcome = kernels.integrate(self._record, start, plan)
        self._require_sound(outcome)
        states = outcome.history[0]
        return Trajectory(np.arange(states.shape[0]) / plan.steps_per_period, states, transient)

    def response(self, periods: int = DEFAULT_PERIODS) -> Result:
        """Compute the motion after the configured transient, with accelerations and mesh forces.

        Parameters
        ----------
        periods : int
            Mesh periods at the end of the recorded periods.

        Returns
        -------
        Result
            The motion from `state`, see `gearchaos.respond`.

        Raises
        ------
        ConfigurationError
            If fewer periods are recorded.

        Examples
        --------
        >>> response = system.response(periods=2)
        >>> response.dims("delta_5")
        ('pitch_error', 'time')
        """
        state = dict(zip(self.states, self.state.tolist(), strict=True))
        start = {"kind": "given", "state": state}
        return respond(self.config.replace("start", start), periods)

    def orbit(self, period: int = 1, guess: Floats | None = None) -> Orbit:
        """Find the periodic orbit on which the motion settles, or the orbit next to a guess.

        Parameters
        ----------
        period : int
            Period in excitation periods, of `repeats_after` mesh periods each.
        guess : array, shape (states,), optional
            State near the orbit at mesh phase 0, such as the orbit of another value; by default the
            state after the configured transient.

        Returns
        -------
        Orbit
            The orbit, stable or unstable, see `polish`.

        Raises
        ------
        ConfigurationError
            If there is no orbit with this period next to the guess.

        Notes
        -----
        Newton's method solves P(x) - x = 0 for the map P over the period. The multipliers are the
        eigenvalues of the monodromy matrix dP/dx.

        Examples
        --------
        >>> orbit = system.orbit(period=2)
        >>> orbit.point.shape, orbit.multipliers.shape
        ((6,), (6,))
        """
        period = whole_number("period", period, least=1)
        settled = guess is None
        if guess is None:
            repeats = self.repeats_after
            transient = repeats * max(-(-self.config.integration.transient_periods // repeats), 1)
            guess = self.integrate(1, transient=transient - 1).states[-1]
        periods = np.array([period], np.int32)
        # A motion that has settled is at its orbit; whoever gives a guess decides how near it is.
        reach = NEIGHBOURHOOD if settled else np.inf
        start = checked_state("guess", guess, self.states)
        found = polish(self._record, start, periods, self._plan, reach=reach)
        if not found.converged[0]:
            where = "where the motion has settled" if settled else "next to the guess"
            raise ConfigurationError(
                f"{self.config.source}: no orbit of period {period} {where}; give "
                "another period or guess, or a longer integration.transient_periods"
            )
        return self._orbit(found, period, self._record)

    def follow(
        self, orbit: Orbit, parameter: str, first: float, last: float, width: float = 1e-4
    ) -> Branch:
        """Follow an orbit along a parameter to where it loses stability.

        Parameters
        ----------
        orbit : Orbit
            The orbit at the first value.
        parameter : str
            Name of a group, or path of a physical key.
        first, last : float
            Values at the beginning and at the end of the way, in the unit of the parameter.
        width : float
            Wanted distance between the last stable value and the value beyond.

        Returns
        -------
        Branch
            The last stable orbit, and how it loses stability.

        Raises
        ------
        ConfigurationError
            If the parameter is unknown or a value out of its range.

        Examples
        --------
        >>> branch = system.follow(system.orbit(period=2), "pitch_error", 10.75, 11.6)
        >>> branch.text
        'period doubling: a real multiplier passes -1'
        """
        instance("orbit", orbit, Orbit, "System.orbit finds it")
        instance("parameter", parameter, str, "name a group, or a key by its path")
        for end in (first, last):
            self.config.at(coordinates("parameter", {parameter: end}))
        width = finite_number("width", width)
        if width <= 0.0:
            raise ConfigurationError(f"width = {width:g}: must be greater than 0")
        period = np.array([orbit.period], np.int32)
        followed = follow(
            lambda values: self._at({parameter: values}),
            checked_state("orbit.point", orbit.point, self.states),
            period,
            np.array([finite_number("first", first)]),
            np.array([finite_number("last", last)]),
            width,
            self._plan,
        )
        return self._branch(followed, parameter, orbit.period)

    def branch(self, orbit: Orbit, parameter: str, first: float, last: float) -> PeriodicBranch:
        """Follow an orbit over a parameter as a whole branch, stable and unstable.

        Parameters
        ----------
        orbit : Orbit
            The orbit of this system.
        parameter : str
            Name of a group, or path of a physical key.
        first, last : float
            Ends of the range, in the unit of the parameter; the value of this system lies between.

        Returns
        -------
        PeriodicBranch
            The branch through the orbit, around its folds, with its special points. It ends where
            it leaves the range, closes on itself, or meets the orbit of half its period.

        Raises
        ------
        ConfigurationError
            If the parameter is unknown, if a value is out of its range, or if the orbit is not one
            of this system.

        Examples
        --------
        >>> branch = system.branch(system.orbit(period=2), "pitch_error", 10.7, 10.8)
        >>> branch.period, branch.ends
        (2, ('edge of the range', 'edge of the range'))
        """
        instance("orbit", orbit, Orbit, "System.orbit finds it")
        instance("parameter", parameter, str, "name a group, or a key by its path")
        low, high = finite_number("first", first), finite_number("last", last)
        for end in (low, high):
            self.config.at(coordinates("parameter", {parameter: end}))
        over = BranchRange(lambda values: self._at({parameter: values}), low, high)
        here = self._value(parameter)
        if not min(low, high) < here < max(low, high):
            raise ConfigurationError(
                f"{parameter} = {here:g}: must lie between first = {low:g} and last = {high:g}"
            )
        with one_thread():
            return self._traced(over, orbit, float(over.share(np.array(here))))

    def _traced(self, over: BranchRange, orbit: Orbit, share: float) -> PeriodicBranch:
        """Return the branch through an orbit at a share of the range."""
        point = checked_state("orbit.point", orbit.point, self.states)
        config = for_continuation(self.config, over.own_maps)
        follower = self if config is self.config else System(config)
        curve = over.curve(follower._plan, orbit.period, coordinate_scale(point[np.newaxis])[0])
        guess = np.append(point[0] / curve.scale, share)
        start = curve.corrected(guess, along_the_way(guess.size - 1))
        if start is None:
            raise ConfigurationError(
                f"{self.config.source}: the orbit is none of this system; find it with "
                "System.orbit of the same system"
            )
        return arrays_of_branch(over, trace(curve, start), plan_run(follower.config))

    def orbits(self, period: int, record: int | None = None) -> list[Orbit]:
        """Find the periodic orbits that the motion comes near, also unstable ones within chaos.

        Parameters
        ----------
        period : int
            Period in excitation periods; orbits that repeat earlier are left out.
        record : int, optional
            Excitation periods of the record, after the configured transient. By default 20,000, or
            as many as have 200,000 mesh periods, but not fewer than 100.

        Returns
        -------
        list of Orbit
            Each orbit once, the least unstable first.

        Raises
        ------
        ConfigurationError
            If the motion leaves the range of numbers.

        Notes
        -----
        Section points that nearly return after the period are guesses for Newton's method, see
        `embedded_orbits`.

        Examples
        --------
        >>> [orbit.stable for orbit in system.orbits(2, record=200)]
        [True]
        """
        period = whole_number("period", period, least=1)
        repeats = self.repeats_after
        record = max(record_length(repeats), period + 1) if record is None else record
        record = whole_number("record", record, least=period + 1)
        transient = self.config.integration.transient_periods
        plan = self._plan._replace(
            transient_periods=-(-transient // repeats) * repeats,
            recorded_periods=record * repeats,
            section_points=record * repeats,
        )
        outcome = kernels.integrate(self._record, self._start(None), plan)
        self._require_sound(outcome)
        section = outcome.every(repeats).section[0]
        found = embedded_orbits(self._record, section, period, self._plan)
        orbits = range(found.converged.size)
        return [self._orbit(found.of(one), period, self._record) for one in orbits]

    def exponents(self, start: Floats | None = None) -> Exponents:
        """Compute all Lyapunov exponents over the configured record, after its transient.

        Parameters
        ----------
        start : array, shape (states,), optional
            Dimensionless state at mesh phase 0; by default `state`.

        Returns
        -------
        Exponents
            Exponents per unit of tau, largest first, and standard errors, each of shape (states,).

        Examples
        --------
        >>> found = system.exponents()
        >>> found.values.shape
        (6,)
        """
        found = exponents(self._record, self._start(start), self._plan)
        return Exponents(*(values[0] for values in found))

    def sum_of_exponents(self, start: Floats | None = None) -> float:
        """Return the exact sum of all Lyapunov exponents per unit of tau.

        The sum follows from the damping alone, and from the shares of contact in the configured
        record where a damper acts in contact only.

        Parameters
        ----------
        start : array, shape (states,), optional
            Dimensionless state at mesh phase 0, from which that record is computed; by default
            `state`.

        Returns
        -------
        float
            The sum; NaN with friction and a damper that acts in contact only, if contact is lost.

        Notes
        -----
        The sum is the mean of the trace of the Jacobian over the motion.

        Examples
        --------
        >>> system.sum_of_exponents() < 0.0
        True
        """
        shares = None
        if any(self._record.damped_in_contact):
            plan = self._plan._replace(contact=True)
            outcome = kernels.integrate(self._record, self._start(start), plan)
            shares = contact_shares(outcome, plan)
        return float(sum_of_exponents(self._record, shares)[0])

    def spectrum(self, state: str | None = None, periods: int = 64) -> SpectralLines:
        """Return the amplitude spectrum of a state after the configured transient.

        Parameters
        ----------
        state : str, optional
            Name of the state, by default the first one, ``"delta_5"`` of a gear pair.
        periods : int
            Length of the record in mesh periods; the spacing of lines is one mesh frequency divided
            by it.

        Returns
        -------
        SpectralLines
            Orders of the mesh frequency, and dimensionless amplitudes.

        Raises
        ------
        ConfigurationError
            If there is no such state.

        Examples
        --------
        >>> lines = system.spectrum("delta_5", periods=16)
        >>> lines.order[1]
        np.float64(0.0625)
        """
        state = self.states[0] if state is None else state
        one_of("state", state, self.states)
        periods = whole_number("periods", periods, least=1)
        # An exact method may take too few steps to sample a motion.
        steps = sampled_steps(self.config, self._steps)
        transient = self.config.integration.transient_periods
        motion = self._moved(steps, periods, transient, self._start(None))
        values = motion.states[:-1, self.states.index(state)]
        return spectral_lines(values, steps)

    def stability_limit(self) -> int:
        """Return the smallest number of steps per mesh period for a stable integration.

        Returns
        -------
        int
            Steps per mesh period; 1 with an exact method.

        Examples
        --------
        >>> system.stability_limit() >= 1
        True
        """
        return int(fewest_stable_steps(self._record, self.config.integration.method)[0])

    def mesh_motion(self, motion: Trajectory) -> kernels.MeshMotion:
        """Return mesh forces, contact and accelerations along a motion (eq. 13).

        Parameters
        ----------
        motion : Trajectory
            Motion from `integrate`.

        Returns
        -------
        MeshMotion
            Dimensionless arrays of shape (samples,), accelerations of shape (samples, coordinates).

        Examples
        --------
        >>> forces = system.mesh_motion(system.integrate(periods=2))
        >>> forces.force_tangential.shape == forces.contact_tangential.shape
        True
        """
        instance("motion", motion, Trajectory, "System.integrate gives it")
        states = motion.states[np.newaxis]
        found = kernels.mesh_motion(self._pair, states, self._steps, motion.first_period)
        return kernels.MeshMotion(*(array[0] for array in found))

    @cached_property
    def _steps(self) -> int:
        """Steps per mesh period: as configured, raised where allowed, or chosen for the scene."""
        if self.config.integration.fixed_steps is not None:
            return self._first_steps
        # The same choice as in `run` of this configuration.
        return with_chosen_steps(plan_run(self.config)).plan.steps_per_period

    @property
    def _plan(self) -> Plan:
        """The plan of an integration with these steps.

        With a tangent vector everywhere: to compile another kernel without it takes longer than the
        vectors of one motion.
        """
        return plan_of(self.config, steps_per_period=self._steps, tangent=True)

    def _require_sound(self, outcome: kernels.Outcome) -> None:
        """Raise a ConfigurationError if the motion of the only lane diverged."""
        if outcome.status[0] != Status.OK:
            raise ConfigurationError(
                f"{self.config.source}: the motion {kernels.STATUS_TEXTS[outcome.status[0]]} in "
                f"period {outcome.diverged_period[0]}; raise integration.steps_per_period or "
                "check the load and the start state"
            )

    def _value(self, parameter: str) -> float:
        """Return the value of a parameter in this system; ConfigurationError if it is derived."""
        value: Any = self.config.tables()
        for name in self.config.parameters[parameter].path.split("."):
            value = value.get(name) if isinstance(value, dict) else None
        if not isinstance(value, int | float):
            raise ConfigurationError(
                f"{parameter}: has no value of its own in {self.config.source}, it is derived; "
                f"give it, such as System(config, {parameter}=...)"
            )
        return float(value)

    def _at(self, values: Mapping[str, Floats]) -> kernels.LaneSystem:
        """Return the system at values of parameters, one lane per value."""
        return system_of(self.config, {**axis_values(self.config), **values})

    def actuated(self, actuator: str) -> kernels.LaneSystem:
        """Return the equations of motion with an input of the machine as their steady input.

        Parameters
        ----------
        actuator : str
            One of ``config.actuators``.

        Returns
        -------
        LaneSystem
            A batch of one lane.

        Examples
        --------
        >>> system.actuated("load").lanes
        1
        """
        model, values = model_of(self.config), axis_values(self.config)
        return model.actuated(self.config, values, self._record, actuator)

    def _start(self, start: Floats | None) -> Floats:
        """Return a checked start state (states,)."""
        return checked_state("start", self.state if start is None else start, self.states)

    def _orbit(self, found: Orbits, period: int, system: kernels.LaneSystem) -> Orbit:
        """Return the orbit of the only lane of a system."""
        exponents = exponents_of(system, self._plan, found.points, found.multipliers, period)
        return Orbit(
            period,
            found.points[0],
            found.multipliers[0],
            float(exponents[0]),
            float(found.residual[0]),
        )

    def _branch(self, followed: Followed, parameter: str, period: int) -> Branch:
        """Return the branch of the only lane over a parameter."""
        loss, value = StabilityLoss(int(followed.loss[0])), followed.stable_value
        # The length of a period may follow from the parameter.
        found = np.isfinite(value).all()
        system = self._at({parameter: value}) if found else self._record
        return Branch(
            float(value[0]),
            self._orbit(followed.stable, period, system),
            float(followed.beyond_value[0]),
            loss,
            NOT_LOST if loss == StabilityLoss.STAYS_STABLE else STABILITY_LOSS_TEXTS[loss],
            complex(followed.multiplier[0]),
        )
