"""Gear pairs with pitch error, one in every lane: the right-hand side of eq. 13 of Pan 2021."""

import math
from dataclasses import dataclass
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
from gearchaos_kernels.models.lane_system import LaneSystem
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

_BEYOND_MEASURE = 1e150
"""Groups are cut short of it where the modes of a pair are computed: products do not overflow."""

_POINTS_PER_WAVE = 64
"""Points at which extremes of the mesh stiffness are sought, per period of its last harmonic."""

_OWN = [name for name in Groups._fields if name not in _UNIT]
"""Groups on which the flow maps of a lane depend."""


@dataclass(frozen=True, eq=False)
class GearPairs(LaneSystem):
    """Everything that defines the right-hand side of eq. 13 for a batch of lanes.

    Attributes
    ----------
    effects : Effects
        Which effects act, the same for all lanes.
    groups : Groups
        Dimensionless groups of eqs 8-13, each an array of shape (lanes,).
    stiffness_cosine, stiffness_sine : array, shape (harmonics,)
        Fourier coefficients of the mesh stiffness relative to its mean (eq. 19).
    physical : bool
        Whether delta_5 + e enters the gaps, as eq. 1 gives, instead of delta_5 as eqs 6 and 7 are
        printed.
    teeth : Teeth or None
        Pitch errors tooth by tooth in place of the sine of eq. 14.
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
        return self.replace(effects=effects)

    def measurable(self) -> Self:
        """Return it with groups cut short of overflow."""
        clipped = (np.clip(group, -_BEYOND_MEASURE, _BEYOND_MEASURE) for group in self.groups)
        return self.replace(groups=Groups(*clipped))

    def branch_stiffnesses(self) -> Floats:
        """Return kappa f' on the branches, (branches, lanes, elements).

        In contact at the extremes of the mesh stiffness, and 0 out of contact. The axial motion
        acts on nothing else: both directions in contact or apart are all branches that count.
        """
        values = [np.ones(self.lanes)]
        if self.effects.stiffness_variation:
            waves = self.stiffness_cosine + 1j * self.stiffness_sine
            harmonics = np.concatenate([[0.0], waves])
            variation = np.fft.fft(harmonics, _POINTS_PER_WAVE * harmonics.size).real
            scale = self.groups.stiffness_variation_scale
            values = [1.0 + scale * extreme for extreme in (np.min(variation), np.max(variation))]
        if self.effects.backlash:
            values.append(np.zeros(self.lanes))
        return np.repeat(np.stack(values)[..., np.newaxis], self.elements, axis=2)

    def contact_state(self) -> Floats:
        """Return the clearance taken up towards the load, and the deflection f_n at stiffness 1."""
        groups, state = self.groups, np.zeros((self.lanes, len(self.states)))
        clearance = np.zeros(self.lanes)
        if self.effects.backlash:
            clearance = groups.half_backlash * np.cos(groups.base_helix_angle)
        state[:, 0] = np.copysign(clearance, groups.load) + groups.load
        return state

    def static_force(self) -> Floats:
        """Return N_y at rest and mean stiffness: eq. 13 gives cos(beta_b) N_y = f_n.

        The gap y_1 less its clearance b cos(beta_b) is as large.
        """
        force: Floats = self.groups.load / np.cos(self.groups.base_helix_angle)
        return force

    def of_unit_inputs(self) -> Self:
        """Return it forced by inputs of one, from which flow maps are made."""
        unit = {name: np.full(self.lanes, value) for name, value in _UNIT.items()}
        return self.replace(groups=self.groups._replace(**unit))

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
        return self.replace(groups=groups, teeth=teeth)


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
