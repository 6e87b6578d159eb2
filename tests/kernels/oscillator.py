"""Complete example of a second model: x'' + 2 zeta x' + D(x; b) = F + A cos(W tau)."""

from collections import namedtuple
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from gearchaos_kernels import LaneSystem
from gearchaos_kernels.models.protocol import Element, Gap, MapFormulas, Model
from gearchaos_kernels.scene import implement

X = namedtuple("X", "x")
Lane = namedtuple("Lane", "stiffness damping half_clearance load amplitude speed")


@dataclass(frozen=True)
class Flags:
    """The oscillator has no optional effects."""


@dataclass(frozen=True)
class Oscillators(LaneSystem):
    """A batch of oscillators; every field has the shape (lanes,)."""

    frequency: np.ndarray
    damping: np.ndarray
    half_clearance: np.ndarray
    load: np.ndarray
    amplitude: np.ndarray
    unit_inputs: ClassVar = {"half_clearance": 0.0, "load": 0.0, "amplitude": 1.0}
    flags: ClassVar = Flags
    mesh_period = property(lambda self: 2.0 * np.pi / self.frequency)

    def coefficients(self, step):
        forces = self.load * step**2, self.amplitude * step**2
        lane = Lane(step**2, 2.0 * self.damping * step, self.half_clearance, *forces, 1.0 / step)
        return np.stack(lane, axis=1)

    def growth_rates(self):
        return 2.0 * self.damping + 1.0


OSCILLATOR = Model(
    coordinates=X,
    lane=Lane,
    forcing_at=lambda lane, phase, _scene: lane.load + lane.amplitude * phase.cosine,
    elements_at=lambda lane, _, __: (Element(lane.stiffness, lane.damping, lane.half_clearance),),
    gaps_at=lambda state, _, __, ___: (Gap(state.position.x, state.rate.x, state.rate.x),),
    accelerations=lambda _state, pushes, drive, _lane, _scene: X(drive - pushes[0].force),
    actuated="load",
    observed=("x",),
    observed_at=lambda state, _lane, _phase, _scene: (state.position.x,),
    maps=MapFormulas(inputs_of=lambda lane, _scene: (lane.load, lane.amplitude * lane.speed**2)),
)
implement(Flags, OSCILLATOR)
