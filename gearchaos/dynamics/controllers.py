"""Controllers of periodic orbits: their design, and what the kernels need of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Control, LaneSystem, Plan, integrate

from gearchaos.arrays import Floats
from gearchaos.dynamics.control import (
    PeriodMaps,
    estimate_correction,
    lqr_gain,
    period_maps,
    placed_gain,
)
from gearchaos.records.period import coordinate_scale

QUIET = 1e-6
"""Noise that an estimate assumes where none is given, in the scales of the states."""


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
        Largest input as a share of the steady input. Where more is needed, the input is 0.
    measured : tuple of str
        Names of the states that are measured; the others are estimated. By default all are known.
    noise : float
        Standard deviation of the measurement noise, in the scales of the states.
    begins : int
        Mesh period in which control begins.
    seed : int
        Seed of the noise.
    actuator : str or None
        The input: the load of a gear pair, a force of a machine, a shaft whose torque it is; by
        default the only one.
    limit_absolute : float or None
        Largest input in its own unit, in place of ``limit``: N m, or that of the forces of a
        machine.
    """

    method: str = "lqr"
    state_weight: float = 1.0
    input_weight: float = 10.0
    limit: float = 0.1
    measured: tuple[str, ...] = ()
    noise: float = 0.0
    begins: int = 0
    seed: int = 0
    actuator: str | None = None
    limit_absolute: float | None = None


class Target(NamedTuple):
    """A periodic orbit as the target of a controller.

    Attributes
    ----------
    maps : PeriodMaps
        The linearised map over each of its mesh periods.
    scales : array, shape (states,)
        Scales of the states.
    """

    maps: PeriodMaps
    scales: Floats

    @classmethod
    def at(cls, system: LaneSystem, point: Floats, period: int, plan: Plan) -> "Target":
        """Return the orbit through a point.

        ``system``: of one lane; ``point`` (states,) at mesh phase 0; ``period`` in excitation
        periods; ``plan``: method and steps.
        """
        once = plan.over(period * system.repeats_after)
        section = integrate(system, point[np.newaxis], once).section[0]
        points = np.vstack([point, section[:-1]])
        return cls(period_maps(system, points, plan), coordinate_scale(points[np.newaxis])[0])

    @classmethod
    def idle(cls, periods: int, states: int) -> "Target":
        """Return a target of zeros, for lanes without an orbit of this number of mesh periods."""
        nothing = np.zeros((periods, states))
        maps = PeriodMaps(nothing, np.zeros((periods, states, states)), nothing)
        return cls(maps, np.ones(states))

    def gain(self, settings: ControlSettings) -> Floats:
        """Return the gains, shape (mesh periods, states)."""
        if settings.method == "placement":
            return placed_gain(self.maps)
        return lqr_gain(self.maps, settings.state_weight, settings.input_weight)

    def correction(self, settings: ControlSettings, measured: list[int]) -> Floats:
        """Return the Kalman gains (mesh periods, states, signals), for measured states."""
        assumed = max(settings.noise, QUIET) * self.scales
        return estimate_correction(self.maps, measured, assumed[measured], assumed)


class Designed(NamedTuple):
    """A target with the gains of its controller.

    Attributes
    ----------
    target : Target
        The target.
    gain : array, shape (mesh periods, states)
        The gains.
    settings : ControlSettings
        How the controller is designed.
    """

    target: Target
    gain: Floats
    settings: ControlSettings


def control_of(designs: Sequence[Designed], system: LaneSystem) -> Control:
    """Return controllers for the kernels, one lane for each design, without limit and seeds.

    The designs differ in targets, weights and noise only. ``system``: some lane, for the names of
    the states and the length of the excitation.
    """
    first = designs[0].settings
    control = Control.of_states(
        np.array([one.target.maps.points for one in designs]),
        np.array([one.gain for one in designs]),
        np.zeros(len(designs)),
        system.repeats_after,
    )
    measured = [system.states.index(name) for name in first.measured or system.states]
    scales = np.array([one.target.scales for one in designs])
    noise = np.array([one.settings.noise for one in designs])[:, np.newaxis]
    control = control._replace(
        scales=scales,
        begins=first.begins,
        measured=np.array(measured),
        noise=noise * scales[:, measured],
        delay=control.points.shape[1] if first.method == "delayed" else 0,
    )
    if not first.measured:
        return control
    corrections = [one.target.correction(one.settings, measured) for one in designs]
    return control._replace(
        transition=np.array([one.target.maps.jacobians for one in designs]),
        response=np.array([one.target.maps.responses for one in designs]),
        correction=np.array(corrections),
    )
