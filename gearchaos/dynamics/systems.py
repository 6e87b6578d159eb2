"""From a configuration and values of its parameters to a system and a plan for the kernels."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from gearchaos_kernels import (
    Effects,
    ForkedProcessError,
    GearPairs,
    Groups,
    Plan,
    Teeth,
    require_threads,
)

from gearchaos.arrays import Floats
from gearchaos.configuration import Configuration
from gearchaos.configuration.run_tables import DEFAULT_STEPS
from gearchaos.configuration.tables import groups_at, physical_at
from gearchaos.errors import ConfigurationError, ExecutionError
from gearchaos.gear.contact_lines import contact_shares
from gearchaos.gear.derivation import Quantities, common_contact_ratios
from gearchaos.gear.tooth_deviations import tooth_deviations


def plan_of(config: Configuration, **others: Any) -> Plan:
    """Return the configured plan of an integration that keeps no section, but for some fields.

    Where no steps per period are configured, it has the fewest that are ever chosen. Raises
    ExecutionError in a process that cannot integrate, as it was forked from one that has.
    """
    try:
        require_threads()
    except ForkedProcessError as error:
        raise ExecutionError(str(error)) from None
    integration = config.integration
    configured = Plan(
        integration.steps_per_period or DEFAULT_STEPS,
        integration.transient_periods,
        integration.recorded_periods,
        section_points=0,
        resolved=integration.crossings == "resolved",
        method=integration.method,
    )
    return configured._replace(**others)


def system_of(
    config: Configuration, values: Mapping[str, Floats], effects: Collection[str] | None = None
) -> GearPairs:
    """Return the system of some lanes.

    ``values``: that of each swept parameter in every lane, (lanes,), and the number of its drawn
    gear pair; ``effects``: those that exist, by default those of the scene.
    """
    found = groups_at(config, values)
    lanes = np.broadcast_shapes(*(np.shape(value) for value in values.values()))

    def filled(name: str, absent: float = 0.0) -> Floats:
        value = getattr(found, name)
        return np.broadcast_to(absent if value is None else value, lanes).astype(np.float64)

    multiple = filled("pitch_error")
    # "5.86 e(tau)" multiplies mean and amplitude of one pitch error alike (eq. 14).
    groups = {
        "base_helix_angle": np.radians(filled("base_helix_angle_deg")),
        "error_mean": multiple * filled("pitch_error_mean"),
        "error_amplitude": multiple * filled("pitch_error_amplitude"),
        "error_phase": np.radians(filled("pitch_error_phase_deg")),
        "mass_ratio_p": filled("mass_ratio_p", absent=1.0),
        "mass_ratio_g": filled("mass_ratio_g", absent=1.0),
    }
    groups |= {name: filled(name) for name in Groups._fields if name not in groups}
    acting = config.scene.effects if effects is None else effects
    cosine, sine = found.stiffness_cosine, found.stiffness_sine
    cosine, sine = (np.zeros(0) if wave is None else wave for wave in (cosine, sine))
    return GearPairs(
        Effects(**{effect: effect in acting for effect in Effects._fields}),
        Groups(**groups),
        cosine,
        sine,
        physical=config.formulation == "physical",
        teeth=_teeth(config, values, complex(*cosine[:1], *-sine[:1])),
    )


def _teeth(
    config: Configuration, values: Mapping[str, Floats], fundamental: complex
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
    shares = contact_shares(*ratios, error.smoothing, fundamental)
    return Teeth(*tooth_deviations(error, config.pair, values), *shares)
