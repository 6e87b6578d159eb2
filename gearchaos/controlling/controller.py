"""Control of a gear pair by its load: it keeps the pair on a periodic orbit.

>>> import gearchaos
>>> system = gearchaos.System("sweeps/pan2021.toml", pitch_error=12.47)
>>> controller = gearchaos.Controller(system, system.orbits(1)[0])
>>> controller.run(starts=100, periods=500).captured.mean()
"""

from typing import NamedTuple

import gearchaos_kernels as kernels
import numpy as np
from gearchaos_kernels import Control, Outcome, Plan

from gearchaos.arguments import finite_number, instance, one_of, whole_number
from gearchaos.arrays import Complex, Floats
from gearchaos.dynamics.control import (
    controllability,
    estimate_correction,
    lqr_gain,
    period_maps,
    placed_gain,
    require_controllable,
    sorted_multipliers,
)
from gearchaos.dynamics.following import Orbit
from gearchaos.errors import ConfigurationError
from gearchaos.records.control import ControlledMotion
from gearchaos.records.period import coordinate_scale
from gearchaos.system import System

METHODS = ("lqr", "placement", "delayed")
"""How the gain is found; see `ControlSettings`."""

CAPTURED = 1e-6
"""Largest distance of a captured motion without noise, as a share of the largest state."""

NOISE_REACH = 30.0
"""Largest distance of a captured motion with noise, in standard deviations of the noise."""

QUIET = 1e-6
"""Noise that an estimate assumes where none is given, in the scales of the states."""

SPREAD = 1e-3
"""Largest difference between the states from which starts are computed."""

LEAST_TRANSIENT = 300
"""Smallest number of mesh periods over which chaos separates them."""


class ControlSettings(NamedTuple):
    """How a controller is designed.

    Attributes
    ----------
    method : {"lqr", "placement", "delayed"}
        A linear-quadratic gain; a gain that moves all unstable multipliers to 0; or delayed
        feedback, which multiplies the same linear-quadratic gain with the difference from the
        state one orbit earlier.
    state_weight, input_weight : float
        Weights of the squared deviation and of the squared input in the cost, dimensionless.
    limit : float
        Largest input as a share of the load. Where more is needed, the input is 0.
    measured : tuple of str
        Names of the states that are measured; the others are estimated. By default all are known.
    noise : float
        Standard deviation of the measurement noise, in the scales of the states.
    begins : int
        Mesh period in which control begins.
    seed : int
        Seed of the noise.
    """

    method: str = "lqr"
    state_weight: float = 1.0
    input_weight: float = 10.0
    limit: float = 0.1
    measured: tuple[str, ...] = ()
    noise: float = 0.0
    begins: int = 0
    seed: int = 0


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
        lane, plan = system.equations, system.plan
        whole = orbit.period * lane.repeats_after
        once = Plan(plan.steps_per_period, 0, whole, whole, method=plan.method)
        section = kernels.integrate(lane, orbit.point[np.newaxis], once).section[0]
        points = np.vstack([orbit.point, section[:-1]])
        self.scales: Floats = coordinate_scale(points[np.newaxis])[0]
        self.maps = period_maps(lane, points, plan)
        require_controllable(self.maps, system.config.source)
        self.multipliers, self.shares = controllability(self.maps)
        given = self.settings
        if given.method == "placement":
            self.gain = placed_gain(self.maps)
        else:
            self.gain = lqr_gain(self.maps, given.state_weight, given.input_weight)
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
        given, periods = self.settings, len(self.gain)
        control = Control.of_states(
            np.tile(self.maps.points, (lanes, 1, 1)),
            np.tile(self.gain, (lanes, 1, 1)),
            np.full(lanes, given.limit * abs(self.load)),
            self.system.repeats_after,
        )
        names = self.system.states
        measured = [names.index(name) for name in given.measured or names]
        noise = given.noise * self.scales[measured]
        seeds = np.empty(lanes, dtype=np.uint64)
        seeds[:] = np.random.SeedSequence(given.seed).generate_state(lanes, np.uint64)
        control = control._replace(
            scales=np.tile(self.scales, (lanes, 1)),
            begins=given.begins,
            measured=np.array(measured),
            noise=np.tile(noise, (lanes, 1)),
            seeds=seeds,
            delay=periods if given.method == "delayed" else 0,
        )
        if not given.measured:
            return control
        assumed = max(given.noise, QUIET) * self.scales
        correction = estimate_correction(self.maps, measured, assumed[measured], assumed)
        return control._replace(
            transition=np.tile(self.maps.jacobians, (lanes, 1, 1, 1)),
            response=np.tile(self.maps.responses, (lanes, 1, 1)),
            correction=np.tile(correction, (lanes, 1, 1, 1)),
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
        reach = max(CAPTURED, NOISE_REACH * self.settings.noise)
        return ControlledMotion(
            outcome.section, outcome.inputs, self._distance(outcome.section), reach
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
        lanes = len(states)
        system = self.system.equations.of(np.zeros(lanes, dtype=np.intp))
        return kernels.integrate(system, states, plan, control=self.control(lanes))

    def _distance(self, section: Floats) -> Floats:
        """Return the distance of section points (lanes, periods, states) from the orbit."""
        repeats, points = self.system.repeats_after, self.maps.points
        distance = np.full(section.shape[:2], np.inf)
        for number, point in enumerate(points):
            # After mesh period n the excitation has the phase of point n + 1.
            first = (number - 1) % repeats
            there = np.max(np.abs(section[:, first::repeats] - point), axis=2) / self.scales.max()
            distance[:, first::repeats] = np.fmin(distance[:, first::repeats], there)
        return distance


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
