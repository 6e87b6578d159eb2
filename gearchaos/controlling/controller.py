"""Control of a machine by its load or a force: it keeps the machine on a periodic orbit.

>>> import gearchaos
>>> system = gearchaos.System("sweeps/pan2021.toml", pitch_error=12.47)
>>> controller = gearchaos.Controller(system, system.orbits(1)[0])
>>> controller.run(starts=100, periods=500).captured.mean()
"""

import gearchaos_kernels as kernels
import numpy as np
from gearchaos_kernels import Control, LaneSystem, Outcome, Plan

from gearchaos.arguments import finite_number, instance, one_of, whole_number
from gearchaos.arrays import Complex, Floats
from gearchaos.configuration.messages import Fault
from gearchaos.dynamics.control import controllability, require_controllable, sorted_multipliers
from gearchaos.dynamics.controllers import ControlSettings, Designed, Target, control_of
from gearchaos.dynamics.following import Orbit
from gearchaos.errors import ConfigurationError
from gearchaos.models import axis_values
from gearchaos.models.registry import model_of
from gearchaos.records.control import ControlledMotion, distance_from, reach_of
from gearchaos.system import System

METHODS = ("lqr", "placement", "delayed")
"""How the gain is found; see `ControlSettings`."""

SPREAD = 1e-3
"""Largest difference between the states from which starts are computed."""

LEAST_TRANSIENT = 300
"""Smallest number of mesh periods over which chaos separates them."""


class Controller:
    """A controller that keeps a system on a periodic orbit by its load or another input.

    Parameters
    ----------
    system : System
        The system, with all parameters fixed.
    orbit : Orbit
        The target, stable or unstable, of `System.orbit` or `System.orbits`.
    settings : ControlSettings, optional
        How the controller is designed, and which input it changes.

    Attributes
    ----------
    actuator : str
        Name of the input.
    equations : LaneSystem
        The equations of motion with this input as their steady one.
    gain : array, shape (mesh periods, states)
        Gains K of u = -K (x - r), one for each mesh period of the orbit.
    multipliers, closed_multipliers : array of complex, shape (states,)
        Floquet multipliers without and with control, largest modulus first. Those with control
        take all states as known. Delayed feedback remembers an orbit, and its loop has more of
        them; these are the largest.
    shares : array, shape (states,)
        Share of the input in the mode of each of `multipliers`; see `controllability`.

    Raises
    ------
    ConfigurationError
        If a setting is out of its range, if the machine has no such input, or if the input does not
        act on an unstable mode.

    Notes
    -----
    Once per mesh period the controller adds u to the input. The linearised map of the section is
    x' = J x + b u, with J and b from tangent vectors. The gain minimises the sum of q |x|^2 + r u^2
    (discrete Riccati equation). With measured states only, a Kalman filter estimates the others.

    Examples
    --------
    >>> system = gearchaos.System("sweeps/pan2021.toml", pitch_error=10.75)
    >>> controller = gearchaos.Controller(system, system.orbit(period=2))
    >>> controller.gain.shape
    (2, 6)
    """

    def __init__(
        self, system: System, orbit: Orbit, settings: ControlSettings | None = None
    ) -> None:
        instance("system", system, System, "System(config) makes one")
        instance("orbit", orbit, Orbit, "System.orbit finds one")
        self.system, self.orbit = system, orbit
        self.settings = _checked(settings or ControlSettings(), system)
        self.actuator = system.config.actuator_of(self.settings.actuator)
        self.equations = system.actuated(self.actuator)
        self._limit = self._largest_input()
        target = Target.at(self.equations, orbit.point, orbit.period, system.plan)
        self.maps, self.scales = target.maps, target.scales
        require_controllable(self.maps, system.config.source)
        self.multipliers, self.shares = controllability(self.maps)
        self.gain = target.gain(self.settings)
        self._control = control_of([Designed(target, self.gain, self.settings)], self.equations)
        self.closed_multipliers = self._closed_multipliers()

    def _closed_multipliers(self) -> Complex:
        """Return the Floquet multipliers with control, the largest ones (states,)."""
        delayed = self.settings.method == "delayed"
        loop = self.maps.closed_with_delay if delayed else self.maps.closed
        return sorted_multipliers(loop(self.gain))[: len(self.scales)]

    @property
    def load(self) -> float:
        """The input without control, in the units of the equations, such as the load."""
        return float(self.equations.steady_input[0])

    @property
    def unit(self) -> tuple[float, str]:
        """Size of an input of 1 in its own unit, and the name of this unit.

        The name is "Nm" or "force", and empty for a dimensionless load.
        """
        config = self.system.config
        found = model_of(config).input_unit(config, axis_values(config))
        if found is None:
            return 1.0, ""
        return float(np.ravel(found)[0]), config.unit_of_inputs

    def _largest_input(self) -> float:
        """Return the limit in the units of the equations."""
        given, source = self.settings.limit_absolute, self.system.config.source
        if given is not None:
            size, unit = self.unit
            if not unit:
                raise ConfigurationError(
                    f"{source}: limit_absolute: no torque in N m determines the load; give "
                    "operation.torque_Nm, or limit as a share of the load"
                )
            return given / size
        if self.load == 0.0:
            raise ConfigurationError(
                f"{source}: limit: is a share of {self.actuator}, whose steady value is 0; give "
                "limit_absolute (--limit-absolute) in its unit"
            )
        return self.settings.limit * abs(self.load)

    def control(self, lanes: int) -> Control:
        """Return the controller for the kernels.

        Parameters
        ----------
        lanes : int
            Number of lanes. The noise of each has its own seed.

        Returns
        -------
        Control
            Its arrays have one row for each lane.

        Examples
        --------
        >>> controller.control(3).gain.shape
        (3, 2, 6)
        """
        lanes = whole_number("lanes", lanes, least=1)
        seeds = np.empty(lanes, dtype=np.uint64)
        seeds[:] = np.random.SeedSequence(self.settings.seed).generate_state(lanes, np.uint64)
        return self._control.of(np.zeros(lanes, dtype=np.intp))._replace(
            limit=np.full(lanes, self._limit), seeds=seeds
        )

    def lanes(self, count: int) -> LaneSystem:
        """Return lanes of the machine with the controller.

        Parameters
        ----------
        count : int
            Number of lanes. The noise of each has its own seed.

        Returns
        -------
        LaneSystem
            The equations of motion, with `control`.

        Examples
        --------
        >>> controller.lanes(3).lanes
        3
        """
        control = self.control(count)
        return self.equations.of(np.zeros(count, dtype=np.intp)).controlled(control)

    def starts(self, count: int) -> Floats:
        """Return states of the motion without control, after the configured transient.

        Parameters
        ----------
        count : int
            Number of states. They come from motions that begin next to each other, which chaos
            separates.

        Returns
        -------
        array, shape (count, states)
            The states.

        Examples
        --------
        >>> controller.starts(5).shape
        (5, 6)
        """
        count = whole_number("count", count, least=1)
        repeats, plan = self.system.repeats_after, self.system.plan
        transient = max(self.system.config.integration.transient_periods, LEAST_TRANSIENT)
        transient = -(-transient // repeats) * repeats
        lanes = self.system.equations.of(np.zeros(count, dtype=np.intp))
        shifts = np.random.default_rng(0).uniform(-SPREAD, SPREAD, (count, len(self.scales)))
        begin = self.system.state + shifts
        return kernels.integrate(lanes, begin, plan.over(0, transient)).end_state

    def run(self, starts: int | Floats = 1000, periods: int = 1000) -> ControlledMotion:
        """Integrate motions with control.

        Parameters
        ----------
        starts : int or array, shape (starts, states)
            States at mesh phase 0, or how many are taken from the motion without control.
        periods : int
            Mesh periods.

        Returns
        -------
        ControlledMotion
            Section, inputs, and distance from the orbit of every motion.

        Examples
        --------
        >>> motion = controller.run(starts=20, periods=400)
        >>> bool(motion.captured.all())
        True
        """
        periods = whole_number("periods", periods, least=1)
        states = self.starts(starts) if isinstance(starts, int) else np.asarray(starts, float)
        outcome = self.integrate(states, self.system.plan.over(periods))
        repeats, noise = self.system.repeats_after, self.settings.noise
        distance = distance_from(self.maps.points, outcome.section, self.scales.max(), repeats, 1)
        return ControlledMotion(
            outcome.section, outcome.inputs, distance, float(reach_of(noise)), noise > 0.0, repeats
        )

    def integrate(self, states: Floats, plan: Plan) -> Outcome:
        """Integrate motions with control as a plan of the kernels says.

        Parameters
        ----------
        states : array, shape (lanes, states)
            States at mesh phase 0.
        plan : Plan
            What is integrated and recorded.

        Returns
        -------
        Outcome
            What the plan requests; ``inputs`` holds the inputs.

        Examples
        --------
        >>> from gearchaos_kernels import Plan
        >>> plan = Plan(200, 0, 10, 10, tangent=True)
        >>> outcome = controller.integrate(controller.starts(2), plan)
        >>> outcome.inputs.shape
        (2, 10)
        """
        return kernels.integrate(self.lanes(len(states)), states, plan)


def _checked(given: ControlSettings, system: System) -> ControlSettings:
    """Return settings, or raise ConfigurationError for one out of its range."""
    instance("settings", given, ControlSettings, "ControlSettings() has the defaults")
    one_of("method", given.method, METHODS)
    for name in ("state_weight", "input_weight", "limit", "noise"):
        value = finite_number(name, getattr(given, name))
        if value < 0.0 or (value == 0.0 and name in ("input_weight", "limit")):
            raise ConfigurationError(f"{name}: is {value:g}, and must be positive")
    whole_number("begins", given.begins, least=0)
    whole_number("seed", given.seed, least=0)
    for name in given.measured:
        one_of("measured", name, system.states)
    if given.limit_absolute is not None:
        value = finite_number("limit_absolute", given.limit_absolute)
        if value <= 0.0:
            raise ConfigurationError(f"limit_absolute: is {value:g}, and must be positive")
    _check_actuator(given.actuator, system)
    return given


def _check_actuator(given: str | None, system: System) -> None:
    """Raise ConfigurationError unless a machine has the input, or only one if none is given."""
    config = system.config
    fault = config.input_fault(given)
    if fault:
        raise ConfigurationError(Fault("actuator", *fault, given).text(config.source))
