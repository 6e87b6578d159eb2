"""A gear pair with pitch error: what defines the right-hand side of eq. 13 of Pan 2021."""

import math
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.models.gear_pair.coefficients import (
    growth_rates,
    lane_coefficients,
    state_scales,
)
from gearchaos_kernels.models.gear_pair.forcing import wave_series
from gearchaos_kernels.models.gear_pair.groups import Effects, Groups
from gearchaos_kernels.models.gear_pair.model import GearPair
from gearchaos_kernels.models.gear_pair.teeth import NARROW, Tables, tables_of
from gearchaos_kernels.models.gear_pair.tooth_errors import Teeth
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import flag

_UNIT = {
    "load": 0.0,
    "half_backlash": 0.0,
    "error_mean": 0.0,
    "error_amplitude": 1.0,
    "error_phase": 0.0,
}
"""Groups on which flow maps do not depend, with their values for inputs of one."""

_OWN = [name for name in Groups._fields if name not in _UNIT]
"""Groups on which the flow maps of a lane depend."""


class System(NamedTuple):
    """Everything that defines the right-hand side of eq. 13 for a batch of lanes.

    ``stiffness_cosine`` and ``stiffness_sine``, shape (harmonics,), are the Fourier coefficients of
    the mesh stiffness relative to its mean (eq. 19); ``physical`` says whether delta_5 + e enters
    the gaps, as eq. 1 gives, instead of delta_5 as eqs 6 and 7 are printed. With ``teeth`` the
    pitch error is not that of eq. 14.
    """

    effects: Effects
    groups: Groups
    stiffness_cosine: Floats
    stiffness_sine: Floats
    physical: bool = True
    teeth: Teeth | None = None

    @property
    def states(self) -> tuple[str, ...]:
        """The states that there are, in the order of `STATES`."""
        return self.effects.states

    @property
    def lanes(self) -> int:
        """Number of lanes."""
        return int(self.groups.mesh_frequency.size)

    @property
    def mesh_period(self) -> Floats:
        """Duration of a mesh period in units of tau, shape (lanes,)."""
        return 2.0 * np.pi / self.groups.mesh_frequency

    @property
    def repeats_after(self) -> int:
        """Mesh periods after which the excitation repeats: 1, or until the same teeth meet."""
        if self.teeth is None or not self.effects.pitch_error:
            return 1
        return math.lcm(self.teeth.driving.shape[1], self.teeth.driven.shape[1])

    @property
    def excitation_period(self) -> Floats:
        """Duration of `repeats_after` mesh periods in units of tau, shape (lanes,)."""
        return self.repeats_after * self.mesh_period

    @property
    def clearance(self) -> bool:
        """Whether the teeth have backlash."""
        return self.effects.backlash

    def flags(self) -> GearPair:
        """Return what the compiled loop has of the model."""
        effects = self.effects
        teeth = self.teeth if effects.pitch_error else None
        phase = effects.pitch_error and teeth is None and bool(np.any(self.groups.error_phase))
        return GearPair(
            pitch_error=flag(effects.pitch_error),
            phase=flag(phase),
            teeth=flag(teeth is not None),
            undamped=flag(teeth is not None and self.physical),
            wide=flag(teeth is not None and teeth.pairs_in_mesh > NARROW),
            stiffness_variation=flag(effects.stiffness_variation),
            transverse=flag(effects.transverse),
            axial=flag(effects.axial),
        )

    def coefficients(self, step: Floats) -> Floats:
        """Return the coefficients of every lane for steps of these lengths; see `Lane`."""
        return lane_coefficients(self, step)

    def scales(self, step: Floats) -> Floats:
        """Return what turns scaled states into those of eq. 13, shape (lanes, states)."""
        return state_scales(self, step)

    def tables(self, steps_per_period: int) -> Tables:
        """Return what acts on all lanes over a mesh period, on a grid of half steps."""
        return tables_of(self, steps_per_period)

    def growth_rates(self) -> Floats:
        """Return a bound on how fast a tangent vector grows or decays, per unit of tau."""
        return growth_rates(self)

    def linearised(self) -> Self:
        """Return it without excitation and clearance, which are no part of its linearisation."""
        effects = Effects(False, False, False, self.effects.transverse, self.effects.axial)
        return self._replace(effects=effects)

    def of_unit_inputs(self) -> Self:
        """Return it forced by inputs of one, from which flow maps are made."""
        unit = {name: np.full(self.lanes, value) for name, value in _UNIT.items()}
        return self._replace(groups=self.groups._replace(**unit))

    def owned(self) -> Floats:
        """Return all numbers on which the flow maps of a lane depend, shape (lanes, numbers)."""
        return np.array([getattr(self.groups, name) for name in _OWN]).T.copy()

    def shared(self) -> tuple[object, ...]:
        """Return all else on which flow maps depend, the same for all lanes."""
        return self.physical, self.stiffness_cosine.tobytes(), self.stiffness_sine.tobytes()

    def harmonics(self) -> int:
        """Return the highest harmonic of the mesh frequency in the coefficients."""
        return self.stiffness_cosine.size if self.effects.stiffness_variation else 0

    def wave_series(self, steps: int, terms: int) -> Floats:
        """Return Taylor coefficients about the middle of every step, shape (3, terms, steps).

        Of the stiffness variation relative to the mean (eq. 19), and of sine and cosine.
        """
        return wave_series(self, steps, terms)

    def wave_values(self, phase: Floats) -> Floats:
        """Return sine and cosine of mesh phases in rad, shape (phases, 2)."""
        return np.stack([np.sin(phase), np.cos(phase)], axis=1)

    def refuses_maps(self) -> str:
        """Return why flow maps cannot integrate it, or an empty text."""
        if self.effects.pitch_error and self.teeth is not None:
            return "flow maps know pitch errors that are a sine, not those of teeth"
        return ""

    def of(self, lanes: slice | NDArray[np.intp] | list[int]) -> Self:
        """Return the system of some lanes, in the order given."""
        teeth = self.teeth and self.teeth._replace(profile=self.teeth.profile[lanes])
        groups = Groups(*(group[lanes] for group in self.groups))
        return self._replace(groups=groups, teeth=teeth)

    def repeated(self, times: int) -> Self:
        """Return the system with every lane so many times in a row."""
        return self.of(np.repeat(np.arange(self.lanes), times))


class MeshMotion(NamedTuple):
    """Forces, contact and accelerations along a motion.

    ``force_tangential``, ``force_axial`` (lanes, samples): N_y and N_z of eq. 13;
    ``contact_tangential``, ``contact_axial`` (lanes, samples): 0 apart, 1 on the driving flank, 2
    on the back flank; ``accelerations`` (lanes, samples, coordinates): delta_5'' and, where the
    system has them, delta_1'' to delta_4''; ``pitch_error`` (lanes, samples): e. Without an axial
    pair its force and contact are 0.
    """

    force_tangential: Floats
    force_axial: Floats
    contact_tangential: NDArray[np.uint8]
    contact_axial: NDArray[np.uint8]
    accelerations: Floats
    pitch_error: Floats
