"""A batch of gear pairs with pitch error, one per lane: the right-hand side of eq. 13."""

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
from gearchaos_kernels.models.gear_pair.model import GearPair, OwnHarmonics
from gearchaos_kernels.models.gear_pair.teeth import NARROW, ToothTables, tables_of
from gearchaos_kernels.models.gear_pair.tooth_errors import Teeth
from gearchaos_kernels.models.lane_system import LaneSystem
from gearchaos_kernels.models.mesh_phase import sine_and_cosine
from gearchaos_kernels.models.waves import waves_of
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import flag

_UNIT_GROUPS = {
    "load": 0.0,
    "half_backlash": 0.0,
    "error_mean": 0.0,
    "error_amplitude": 1.0,
    "error_phase": 0.0,
}
"""Groups on which flow maps do not depend, with their values in a system of unit inputs."""

_LARGEST_GROUP = 1e150
"""Groups are clipped to it before modes are computed, so that products do not overflow."""

_POINTS_PER_WAVE = 64
"""Points per period of the highest stiffness harmonic at which its extremes are sought."""

_MAP_GROUPS = [name for name in Groups._fields if name not in _UNIT_GROUPS]
"""Groups on which the flow maps of a lane depend."""


@dataclass(frozen=True, eq=False)
class GearPairs(LaneSystem):
    """A batch of gear pairs: all that defines the right-hand side of eq. 13.

    Attributes
    ----------
    effects : Effects
        Which effects act, the same for all lanes.
    groups : Groups
        Dimensionless groups of eqs 8-13, each an array of shape (lanes,).
    stiffness_cosine, stiffness_sine : array, shape (harmonics,) or (lanes, harmonics)
        Fourier coefficients of the mesh stiffness relative to its mean (eq. 19), which all lanes
        share, or those of each lane.
    control : Control or None
        The controllers of the pairs, see `LaneSystem.controlled`.
    physical : bool
        Whether the gaps contain delta_5 + e, as follows from eq. 1, or delta_5 alone, as printed in
        eqs 6 and 7.
    teeth : Teeth or None
        Pitch errors tooth by tooth, in place of the sine of eq. 14.
    damped_in_contact_only : bool
        Whether the damper of the mesh acts only while teeth are in contact. In Pan 2021 it always
        acts.

    Notes
    -----
    The equations of motion are eq. 13 of Pan 2021, with the gaps of eqs 6 and 7::

        y_1 = delta_1 - delta_2 + delta_5 - e cos(beta_b)        (+ e if physical)
        y_2 = delta_3 - delta_4 - tan(beta_b) y_1 - 2 e sin(beta_b)

    The module `equations` has all of them in scaled coordinates.

    Examples
    --------
    ::

        pairs = GearPairs(Effects(axial=False), groups, cosine, sine)
        start = np.zeros((pairs.lanes, len(pairs.states)))
        outcome = integrate(pairs, start, Plan(200, 300, 100, 100))
    """

    effects: Effects
    groups: Groups
    stiffness_cosine: Floats
    stiffness_sine: Floats
    physical: bool = True
    teeth: Teeth | None = None
    damped_in_contact_only: bool = False

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, in the order of `STATES`."""
        return self.effects.states

    @property
    def mesh_period(self) -> Floats:
        """Duration of a mesh period in units of tau, shape (lanes,)."""
        return 2.0 * np.pi / self.groups.mesh_frequency

    @property
    def damping_changes(self) -> bool:
        """Whether the effect of dampers changes with the mesh phase: that of friction does."""
        return self.effects.friction

    @property
    def repeats_after(self) -> int:
        """Mesh periods after which the excitation repeats; with teeth, until the same two meet."""
        if self.teeth is None or not self.effects.pitch_error:
            return 1
        return math.lcm(self.teeth.driving.shape[1], self.teeth.driven.shape[1])

    @property
    def own_harmonics(self) -> bool:
        """Whether each lane has harmonics of the mesh stiffness of its own."""
        return self.effects.stiffness_variation and self.stiffness_cosine.ndim > 1

    @property
    def clearance(self) -> bool:
        """Whether the teeth have backlash."""
        return self.effects.backlash

    def flags(self) -> GearPair:
        """Return which parts of the model the compiled loop contains."""
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
            friction=flag(effects.friction),
            damped_in_contact=flag(self.damped_in_contact_only),
            harmonics=OwnHarmonics(self.harmonics()) if self.own_harmonics else None,
        )

    def coefficients(self, step: Floats) -> Floats:
        """Return the coefficients of every lane for steps of these lengths; see `Lane`."""
        coefficients = lane_coefficients(self, step)
        return np.concatenate([coefficients, self._own_waves()], axis=1)

    def _own_waves(self) -> Floats:
        """Return cosine and sine of the harmonics that each lane has of its own, in turn."""
        if not self.own_harmonics:
            return np.zeros((self.lanes, 0))
        waves = np.stack([self.stiffness_cosine, self.stiffness_sine], axis=2)
        return waves.reshape(self.lanes, -1)

    def scales(self, step: Floats) -> Floats:
        """Return the factors from scaled states to those of eq. 13, shape (lanes, states)."""
        return state_scales(self, step)

    def tables(self, steps_per_period: int) -> ToothTables:
        """Return the tables over one mesh period, on a grid of half steps."""
        return tables_of(self, steps_per_period)

    def growth_rates(self) -> Floats:
        """Return a bound on how fast a tangent vector grows or decays, per unit of tau."""
        return growth_rates(self)

    def linearised(self) -> Self:
        """Return the system without excitation and clearance, which a linearisation leaves out."""
        effects = Effects(False, False, False, self.effects.transverse, self.effects.axial)
        return self.replace(effects=effects)

    def measurable(self) -> Self:
        """Return the system with groups clipped, so that their products do not overflow."""
        clipped = (np.clip(group, -_LARGEST_GROUP, _LARGEST_GROUP) for group in self.groups)
        return self.replace(groups=Groups(*clipped))

    def branch_stiffnesses(self) -> Floats:
        """Return kappa f' on each contact branch, shape (branches, lanes, elements).

        The branches are: contact at the smallest and at the largest mesh stiffness, and no contact.
        Both directions are on the same branch: the axial motion does not act back on the rest, so
        combinations add no further exponents.
        Friction reduces the smallest mesh stiffness and adds to the largest.
        """
        values = [np.ones(self.lanes)]
        if self.effects.friction:
            values = 2 * values
        if self.effects.stiffness_variation:
            waves = self.stiffness_cosine + 1j * self.stiffness_sine
            harmonics = np.concatenate([np.zeros((*waves.shape[:-1], 1)), waves], axis=-1)
            points = _POINTS_PER_WAVE * harmonics.shape[-1]
            variation = np.fft.fft(harmonics, points).real
            scale = self.groups.stiffness_variation_scale
            extremes = np.min(variation, axis=-1), np.max(variation, axis=-1)
            values = [1.0 + scale * extreme for extreme in extremes]
        if self.effects.friction:
            share = self.groups.friction_coefficient * self.groups.friction_lever
            values = [values[0] * (1.0 - share), values[1] * (1.0 + share)]
        if self.effects.backlash:
            values.append(np.zeros(self.lanes))
        return np.repeat(np.stack(values)[..., np.newaxis], self.elements, axis=2)

    def contact_state(self) -> Floats:
        """Return the state at rest under the load: half the backlash plus the deflection f_n."""
        groups, state = self.groups, np.zeros((self.lanes, len(self.states)))
        clearance = np.zeros(self.lanes)
        if self.effects.backlash:
            clearance = groups.half_backlash * np.cos(groups.base_helix_angle)
        state[:, 0] = np.copysign(clearance, groups.load) + groups.load
        return state

    def static_force(self) -> Floats:
        """Return N_y at rest and mean stiffness: eq. 13 gives cos(beta_b) N_y = f_n.

        It equals the deflection, the gap y_1 less its clearance b cos(beta_b).
        """
        force: Floats = self.groups.load / np.cos(self.groups.base_helix_angle)
        return force

    def with_steady_input(self, values: Floats) -> Self:
        """Return the pairs with other loads."""
        return self.replace(groups=self.groups._replace(load=values))

    @property
    def steady_input(self) -> Floats:
        """The load of every pair."""
        return self.groups.load

    def of_unit_inputs(self) -> Self:
        """Return the system with unit inputs, from which flow maps are computed."""
        unit = {name: np.full(self.lanes, value) for name, value in _UNIT_GROUPS.items()}
        return self.replace(groups=self.groups._replace(**unit))

    def map_parameters(self) -> Floats:
        """Return all numbers on which the flow maps of a lane depend, shape (lanes, numbers)."""
        groups = np.array([getattr(self.groups, name) for name in _MAP_GROUPS]).T
        return np.concatenate([groups, self._own_waves()], axis=1)

    def with_map_parameter(self, number: int, values: Floats) -> Self | None:
        """Return the pairs with other values (lanes,) of a column of `map_parameters`, or None."""
        if number >= len(_MAP_GROUPS):
            return None
        return self.replace(groups=self.groups._replace(**{_MAP_GROUPS[number]: values}))

    def map_constants(self) -> tuple[object, ...]:
        """Return what else the flow maps depend on, the same for all lanes."""
        constants = self.physical, self.damped_in_contact_only
        if self.own_harmonics:
            return constants
        return *constants, self.stiffness_cosine.tobytes(), self.stiffness_sine.tobytes()

    def harmonics(self) -> int:
        """Return the highest harmonic of the mesh frequency in the coefficients."""
        return self.stiffness_cosine.shape[-1] if self.effects.stiffness_variation else 0

    def wave_series(self, steps: int, terms: int) -> Floats:
        """Return Taylor coefficients about the middle of every step, (3 + waves, terms, steps).

        They are those of the stiffness variation relative to the mean (eq. 19), of sine and cosine
        of the mesh phase, and of the waves of harmonics that each lane has of its own.
        """
        return wave_series(self, steps, terms)

    def wave_values(self, phase: Floats) -> Floats:
        """Return the waves at mesh phases in rad, shape (phases, waves): see `wave_series`."""
        own = waves_of(self.flags().orders, phase)
        return np.concatenate([sine_and_cosine(phase), own], axis=1)

    def refuses_maps(self) -> str:
        """Return why flow maps cannot integrate the system, or an empty text."""
        if self.effects.pitch_error and self.teeth is not None:
            return "flow maps know pitch errors that are a sine, not those of teeth"
        if self.effects.friction:
            return "flow maps cannot integrate friction, whose sign changes within the mesh period"
        return ""

    def of(self, chosen: slice | NDArray[np.intp] | list[int]) -> Self:
        """Return the system of some lanes, in the order given."""
        teeth = self.teeth and self.teeth._replace(profile=self.teeth.profile[chosen])
        groups = Groups(*(group[chosen] for group in self.groups))
        control = self.control and self.control.of(chosen)
        changes = {}
        if self.stiffness_cosine.ndim > 1:
            for name in ("stiffness_cosine", "stiffness_sine"):
                changes[name] = getattr(self, name)[chosen]
        return self.replace(groups=groups, teeth=teeth, control=control, **changes)


class MeshMotion(NamedTuple):
    """Mesh forces, contact, accelerations and errors along a motion, dimensionless.

    Attributes
    ----------
    force_tangential, force_axial : array, shape (lanes, samples)
        N_y and N_z of eq. 13; N_z is 0 in a scene without axial motion.
    contact_tangential, contact_axial : array of int, shape (lanes, samples)
        0 without contact, 1 on the driving flank, 2 on the back flank; the axial one is 0 in a
        scene without axial motion.
    accelerations : array, shape (lanes, samples, coordinates)
        delta_5'', then delta_1'' to delta_4'' as far as the scene has them.
    pitch_error : array, shape (lanes, samples)
        e.
    transmission_error : array, shape (lanes, samples)
        delta_5 + e.
    """

    force_tangential: Floats
    force_axial: Floats
    contact_tangential: NDArray[np.uint8]
    contact_axial: NDArray[np.uint8]
    accelerations: Floats
    pitch_error: Floats
    transmission_error: Floats
