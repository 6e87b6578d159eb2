"""Control of a gear pair by its load: it keeps the pair on a periodic orbit.

>>> import gearchaos
>>> system = gearchaos.System("sweeps/pan2021.toml", pitch_error=12.47)
>>> controller = gearchaos.Controller(system, system.orbits(1)[0])
>>> controller.run(starts=100, periods=500).captured.mean()
"""

import gearchaos_kernels as kernels
import numpy as np
from gearchaos_kernels import Control, Outcome, Plan

from gearchaos.arguments import finite_number, instance, one_of, whole_number
from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.control import controllability, require_controllable, sorted_multipliers
from gearchaos.dynamics.controllers import ControlSettings, Designed, Target, control_of
from gearchaos.dynamics.following import Orbit
from gearchaos.errors import ConfigurationError
from gearchaos.records.control import ControlledMotion, distance_from, reach_of
from gearchaos.system import System

METHODS = ("lqr", "placement", "delayed")
"""How the gain is found; see `ControlSettings`."""

SPREAD = 1e-3
"""Largest difference between the states from which starts are computed."""

LEAST_TRANSIENT = 300
"""Smallest number of mesh periods over which chaos separates them."""


class Controller:
    """A controller that keeps a system on a periodic orbit by its load.

    Parameters
    ----------
    system : System
        The system, with all parameters fixed.
    orbit : Orbit
        The target, stable or unstable, of `System.orbit` or `System.orbits`.
    settings : ControlSettings, optional
        How the controller is designed.

    Attributes
    ----------
    gain : array, shape (mesh periods, states)
        Gains K of u = -K (x - r), one for each mesh period of the orbit.
    multipliers, closed_multipliers : array of complex, shape (states,)
        Floquet multipliers without and with control, largest modulus first.
    shares : array, shape (states,)
        Share of the input in the mode of each of `multipliers`; see `controllability`.

    Raises
    ------
    ConfigurationError
        If a setting is out of its range, if the model has no load, or if the load does not act on
        an unstable mode.

    Notes
    -----
    Once per mesh period the controller adds u to the load. The linearised map of the section is
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
        self.settings = _checked(settings or ControlSettings(), system.states)
        target = Target.at(system.equations, orbit.point, orbit.period, system.plan)
        self.maps, self.scales = target.maps, target.scales
        require_controllable(self.maps, system.config.source)
        self.multipliers, self.shares = controllability(self.maps)
        self.gain = target.gain(self.settings)
        self._control = control_of([Designed(target, self.gain, self.settings)], system.equations)
        self.closed_multipliers: Complex = sorted_multipliers(self.maps.closed(self.gain))

    @property
    def load(self) -> float:
        """The dimensionless load without control."""
        return float(self.system.equations.steady_input[0])

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
            limit=np.full(lanes, self.settings.limit * abs(self.load)), seeds=seeds
        )

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
        settle = Plan(plan.steps_per_period, transient, 0, 0, method=plan.method)
        return kernels.integrate(lanes, begin, settle).end_state

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
        plan = self.system.plan
        outcome = self.integrate(
            states, Plan(plan.steps_per_period, 0, periods, periods, method=plan.method)
        )
        distance = distance_from(
            self.maps.points, outcome.section, self.scales.max(), self.system.repeats_after, 1
        )
        reach = float(reach_of(self.settings.noise))
        return ControlledMotion(outcome.section, outcome.inputs, distance, reach)

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
        lanes = len(states)
        system = self.system.equations.of(np.zeros(lanes, dtype=np.intp))
        return kernels.integrate(system.controlled(self.control(lanes)), states, plan)


def _checked(given: ControlSettings, states: tuple[str, ...]) -> ControlSettings:
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
        one_of("measured", name, states)
    return given
