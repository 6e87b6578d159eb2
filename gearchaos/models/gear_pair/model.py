"""The gear pair as the engine sees it: systems, parameters, scales and motions."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np
from gearchaos_kernels import Effects, GearPairs, Groups, LaneSystem, Teeth, mesh_motion

from gearchaos.arrays import Array, Floats
from gearchaos.errors import ConfigurationError
from gearchaos.models.gear_pair.configuration import GearPairConfiguration
from gearchaos.models.gear_pair.contact_lines import line_shares
from gearchaos.models.gear_pair.derivation import (
    FREQUENCY,
    LENGTH,
    SCALES,
    Quantities,
    common_contact_ratios,
    derive_scales,
)
from gearchaos.models.gear_pair.group_table import GROUP_TABLE, GROUPS_BY_NAME
from gearchaos.models.gear_pair.loads import load_outputs
from gearchaos.models.gear_pair.outputs import (
    CATALOGUE,
    DIRECTIONS,
    FORCES_PART,
    LOADS_PART,
    MESH_ERROR,
    MESH_FORCE,
    TRANSMISSION_ERROR,
)
from gearchaos.models.gear_pair.remarks import remarks
from gearchaos.models.gear_pair.tables import groups_at, physical_at
from gearchaos.models.gear_pair.tooth_deviations import tooth_deviations
from gearchaos.models.protocol import Model, ParameterValue, Scales, accelerations

TORQUE = "operation.torque_Nm"
"""The key from which the load follows."""


class GearPairModel(Model):
    """A helical gear pair with pitch error (Pan 2021, eq. 13)."""

    catalogue = CATALOGUE
    load_parts = (FORCES_PART, LOADS_PART)
    signals = (TRANSMISSION_ERROR,)
    exciter = "mesh"
    contact_words = "mean mesh stiffness, teeth in contact"
    deflection_words = "of the mesh under the static load, along the transverse line of action"

    excitation_words = "pitch errors repeat"
    shorter_excitation = "give one gear deviations, or other teeth"
    shared_inputs = "pitch error, load and clearance"

    def system(
        self,
        config: GearPairConfiguration,
        values: Mapping[str, Floats],
        effects: Collection[str],
    ) -> GearPairs:
        """Return the gear pairs of some lanes.

        ``values`` has the number of the drawn gear pair of every lane as well.
        """
        found = groups_at(config, values)
        lanes = np.broadcast_shapes(*(np.shape(value) for value in values.values()))

        def filled(name: str, absent: float = 0.0) -> Floats:
            value = getattr(found, name)
            return np.full(lanes, absent if value is None else value, dtype=np.float64)

        multiple = filled("pitch_error")
        # "5.86 e(tau)" multiplies mean and amplitude of one pitch error alike (eq. 14).
        groups = {
            "error_mean": multiple * filled("pitch_error_mean"),
            "error_amplitude": multiple * filled("pitch_error_amplitude"),
            "error_phase": np.radians(filled("pitch_error_phase_deg")),
            "mass_ratio_p": filled("mass_ratio_p", absent=1.0),
            "mass_ratio_g": filled("mass_ratio_g", absent=1.0),
        }
        angles = [name for name in Groups._fields if f"{name}_deg" in GROUPS_BY_NAME]
        groups |= {name: np.radians(filled(f"{name}_deg")) for name in angles}
        groups |= {name: filled(name) for name in Groups._fields if name not in groups}
        cosine, sine = found.stiffness_cosine, found.stiffness_sine
        cosine, sine = (np.zeros(0) if wave is None else wave for wave in (cosine, sine))
        if cosine.ndim > 1:
            harmonics = *lanes, cosine.shape[-1]
            cosine, sine = (np.broadcast_to(wave, harmonics).copy() for wave in (cosine, sine))
        return GearPairs(
            Effects(**{effect: effect in effects for effect in Effects._fields}),
            Groups(**groups),
            cosine,
            sine,
            physical=config.formulation == "physical",
            teeth=_teeth(config, values, cosine, sine),
            damped_in_contact_only=config.mesh is not None
            and config.mesh.damping_acts == "in_contact",
        )

    def elements(self, effects: Collection[str]) -> tuple[str, ...]:
        """Return the directions in which teeth have a clearance."""
        return DIRECTIONS[: 1 + ("axial" in effects)]

    def parameters(
        self,
        config: GearPairConfiguration,
        values: Mapping[str, Floats],
        effects: Collection[str],
    ) -> Iterator[ParameterValue]:
        """Yield the groups that some effect needs, with their origin, and the physical scales."""
        groups = groups_at(config, values)
        for row in GROUP_TABLE:
            value = getattr(groups, row.name)
            if value is not None and row.needed_by(effects):
                texts, origin = (row.units, row.long_name, row.mathtext), groups.origin[row.name]
                yield ParameterValue(row.name, *texts, value, origin, row.is_list)
        physical = physical_at(config, values)
        for name, value in derive_scales(physical, groups.load, groups.mesh_frequency).items():
            yield ParameterValue(name, *SCALES[name], value, "derived")

    def scales(self, config: GearPairConfiguration, values: Mapping[str, Floats]) -> Scales:
        """Return omega_h, the speed of the driving gear at 1 Hz, and b'."""
        groups = groups_at(config, values)
        found = derive_scales(physical_at(config, values), groups.load, groups.mesh_frequency)
        lanes = np.broadcast_shapes(*(np.shape(value) for value in values.values()))
        frequency, length = (
            None if name not in found else np.broadcast_to(found[name], lanes)
            for name in (FREQUENCY, LENGTH)
        )
        speed = None if config.pair is None else 60.0 / config.pair.teeth[0]
        return Scales(frequency, speed, length)

    def input_unit(
        self, config: GearPairConfiguration, values: Mapping[str, Floats]
    ) -> Floats | None:
        """Return the torque on the driving gear for a load of 1, None if none determines it."""
        groups = groups_at(config, values)
        if groups.origin["load"] != "derived":
            return None
        torque = np.asarray(physical_at(config, values)[TORQUE], dtype=np.float64)
        unit: Floats = np.abs(torque / groups.load)
        return unit

    def remarks(
        self, config: GearPairConfiguration, system: LaneSystem, parameters: Mapping[str, Floats]
    ) -> Iterator[str]:
        """Yield remarks for the user about the pair before the sweep runs."""
        assert isinstance(system, GearPairs)
        return remarks(config, system, parameters)

    def facts(self, config: GearPairConfiguration, repeats_after: int) -> dict[str, Any]:
        """Return the formulation and, where teeth have errors of their own, their numbers."""
        pair = config.pair if repeats_after > 1 else None
        names = ("driving_teeth", "driven_teeth")
        teeth = dict(zip(names, pair.teeth, strict=True)) if pair else {}
        return {"formulation": config.formulation, **teeth}

    def loads(self, loads: Floats, system: LaneSystem) -> dict[str, Floats]:
        """Return mesh forces, load factors and transmission error by name."""
        return load_outputs(loads, system.static_force(), DIRECTIONS[: system.elements])

    def motion(
        self, system: LaneSystem, states: Floats, steps_per_period: int, first_period: int
    ) -> dict[str, Array]:
        """Return accelerations, errors, mesh forces and contact along a motion, by name."""
        assert isinstance(system, GearPairs)
        found = mesh_motion(system, states, steps_per_period, first_period)
        motion = accelerations(system, found.accelerations)
        motion |= {MESH_ERROR: found.pitch_error, TRANSMISSION_ERROR: found.transmission_error}
        for way in DIRECTIONS[: system.elements]:
            motion[f"{MESH_FORCE}{way}"] = getattr(found, f"force_{way}")
            motion[f"contact_{way}"] = getattr(found, f"contact_{way}")
        return motion


def _teeth(
    config: GearPairConfiguration, values: Mapping[str, Floats], cosine: Floats, sine: Floats
) -> Teeth | None:
    """Return the errors of the teeth of some lanes, None where they have none of their own."""
    error = config.pitch_error
    if error is None or error.kind == "sine" or "pitch_error" not in config.scene.effects:
        return None
    pair = Quantities(physical_at(config, values)).pair
    ratios = common_contact_ratios(pair)
    if ratios is None:
        raise ConfigurationError(
            f"{config.source}: the contact ratio of [pair] would differ between the swept values, "
            "but all of them share one table of contact lines; sweep another parameter"
        )
    # Equal contact ratios give all lanes the same phase of the stiffness.
    first = cosine.reshape(-1, cosine.shape[-1])[0], sine.reshape(-1, sine.shape[-1])[0]
    fundamental = complex(*first[0][:1], *-first[1][:1])
    shares = line_shares(*ratios, error.smoothing, fundamental)
    return Teeth(*tooth_deviations(error, config.pair, values), *shares)
