"""Plausible values of keys, and the unit in which a value outside them was probably given."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from gearchaos.configuration.messages import IN_UM, shown
from gearchaos.configuration.tables import Tables, swept_values

_DEGREE, _MM, _UM, _NEWTON_PER_UM = "degree", "mm", "um", "N/um"


class Plausible(NamedTuple):
    """The values that a key usually has: ``low`` to ``high`` in ``units``, or zero.

    The sign does not count. ``mistake``: what is often given instead, and what to do then.
    """

    low: float
    high: float
    units: str = ""
    mistake: str = ""

    @property
    def words(self) -> str:
        """The range in words, such as ``0.05 to 100``."""
        return f"{self.low:.12g} to {self.high:.12g}"


_HELIX = Plausible(1.0, 60.0, _DEGREE)
_PRESSURE = Plausible(8.0, 45.0, _DEGREE)
_DIAMETER = Plausible(1.0, 20_000.0, _MM)
_RADIUS = Plausible(0.5, 10_000.0, _MM)
_MASS = Plausible(1e-5, 1e5, "kg")
_INERTIA = Plausible(1e-11, 1e6, "kg m^2")
_BACKLASH = Plausible(0.5, 5000.0, _UM)
_ERROR = Plausible(0.1, 1000.0, _UM)
_DAMPING_RATIO = Plausible(1e-5, 1.0)
_STIFFNESS = Plausible(1e4, 1e13, "N/m")
_DAMPING = Plausible(1e-3, 1e9, "N s/m")
_STATE = Plausible(0.0, 1e6)

PLAUSIBLE: Mapping[str, Plausible] = {
    "normal_module_mm": Plausible(0.05, 100.0, _MM),
    "normal_pressure_angle_deg": _PRESSURE,
    "pressure_angle_deg": _PRESSURE,
    "helix_angle_deg": _HELIX,
    "base_helix_angle_deg": _HELIX,
    "face_width_mm": Plausible(0.2, 3000.0, _MM),
    "centre_distance_mm": _DIAMETER,
    "tip_diameters_mm": _DIAMETER,
    "tip_diameter_mm": _DIAMETER,
    "base_radius_mm": _RADIUS,
    "sun_base_radius_mm": _RADIUS,
    "density_kg_m3": Plausible(500.0, 25_000.0, "kg/m^3"),
    "masses_kg": _MASS,
    "mass_kg": _MASS,
    "inertias_kg_m2": _INERTIA,
    "inertia_kg_m2": _INERTIA,
    "speed_rpm": Plausible(0.1, 1e6, "rpm"),
    "torque_Nm": Plausible(1e-5, 1e8, "N m"),
    "mean_stiffness_N_per_um_mm": Plausible(
        0.05, 100.0, "N/(um mm)", "the stiffness of the whole face is divided by its width in mm"
    ),
    "stiffness_N_per_um": Plausible(0.1, 1e6, _NEWTON_PER_UM),
    "bearing_N_per_um": Plausible(0.01, 1e6, _NEWTON_PER_UM),
    "length_scale_um": _BACKLASH,
    "half_backlash_um": _BACKLASH,
    "circumferential_backlash_um": _BACKLASH,
    "normal_backlash_um": _BACKLASH,
    "bearing_half_clearance_um": _BACKLASH,
    "amplitude_um": _ERROR,
    "transmission_error_um": _ERROR,
    "damping_ratio": _DAMPING_RATIO,
    "bearing_damping_ratio": _DAMPING_RATIO,
    "damping_N_s_per_m": _DAMPING,
    "friction_coefficient": Plausible(1e-3, 0.5),
    "transverse_stiffness_N_per_m": _STIFFNESS,
    "axial_stiffness_N_per_m": _STIFFNESS,
    "transverse_damping_N_s_per_m": _DAMPING,
    "axial_damping_N_s_per_m": _DAMPING,
    "state": _STATE,
    "box": _STATE,
    "drawn": _STATE,
    "spread": _STATE,
}
"""Plausible values by the name of the key, for all models."""

_CONVERSIONS: Mapping[str, Mapping[str, float]] = {
    _MM: {"m": 1e3, "um": 1e-3, "inches": 25.4},
    _UM: {unit: size for unit, size in IN_UM.items() if unit != _UM},
    _DEGREE: {"radians": math.degrees(1.0)},
    "kg": {"g": 1e-3, "t": 1e3},
    "kg m^2": {"kg mm^2": 1e-6, "g mm^2": 1e-9},
    "kg/m^3": {"g/cm^3": 1e3, "t/mm^3": 1e12},
    "rpm": {"Hz": 60.0, "rad/s": 30.0 / math.pi},
    "N m": {"N mm": 1e-3, "kN m": 1e3},
    "N/(um mm)": {"N/m^2": 1e-9, "N/mm^2": 1e-3},
    _NEWTON_PER_UM: {"N/m": 1e-6, "N/mm": 1e-3},
    "N/m": {"N/um": 1e6, "N/mm": 1e3},
    "N s/m": {"N s/mm": 1e3},
    "": {"percent": 1e-2},
}
"""Factors from other units to the unit of a key."""


def implausible(config: Tables) -> Iterator[str]:
    """Yield a warning for every value outside the plausible ones of its key.

    Keys that ``unusual`` of the configuration lists have none.
    """
    # Tables that cannot be read are absent while faults of the others are collected.
    given = {name: value for name, value in config.__dict__.items() if value is not None}
    given = config.tables([name for name in config.__class__.model_fields if name in given])
    meant = {*given.get("unusual", ())}
    for path, name, value in _values(given):
        if name in PLAUSIBLE and path not in meant:
            yield from _warning(path, PLAUSIBLE[name], value)
    for table in config.sweeps if "sweep" in given else ():
        sweep = config.sweeps[table]
        if sweep.count == 1 and sweep.to not in (None, sweep.from_):
            yield (
                f"{table}.count = 1: only from = {sweep.from_:g} is computed, to = {sweep.to:g} is "
                "not; raise it, or give values"
            )
        known = config.parameters.get(sweep.parameter)
        name = known.path.rpartition(".")[2] if known else ""
        if known and name in PLAUSIBLE and known.path not in meant:
            ends = swept_values(sweep)[[0, -1]].tolist()
            texts = [text for end in ends for text in _warning(known.path, PLAUSIBLE[name], end)]
            yield from texts[:1]


def _values(tables: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str, Any]]:
    """Yield path, name and value of every key whose value is no table, or a known one."""
    for name, value in tables.items():
        here = f"{path}.{name}".lstrip(".")
        if isinstance(value, Mapping) and name not in PLAUSIBLE:
            yield from _values(value, here)
        else:
            yield here, name, value


def _warning(path: str, usual: Plausible, value: Any) -> Iterator[str]:
    """Yield the warning about a value, a list or a table of values, if it is implausible."""
    numbers = _numbers(value)
    outside = [one for one in numbers if one and not usual.low <= one <= usual.high]
    if not outside:
        return
    found = f"{path} = {shown(value)}: is unusual, values are usually {usual.words}"
    found += f" {usual.units}" if usual.units else ""
    middle = math.sqrt(max(usual.low, 1e-300) * usual.high)
    fitting = {
        unit: factor
        for unit, factor in _CONVERSIONS.get(usual.units, {}).items()
        if usual.low and all(usual.low <= one * factor <= usual.high for one in outside)
    }
    if fitting:
        unit = min(fitting, key=lambda one: abs(math.log(outside[0] * fitting[one] / middle)))
        meant = [float(f"{one * fitting[unit]:.6g}") for one in numbers]
        probable = shown(meant if len(meant) > 1 else meant[0])
        found += f"; probably it is in {unit}: then write {probable}"
    found += f"; {usual.mistake}" if usual.mistake else ""
    yield f'{found}; if it is intended, add unusual = ["{path}"] to leave this warning out'


def _numbers(value: Any) -> list[float]:
    """Return the sizes of all numbers in a value."""
    if isinstance(value, Mapping):
        return [one for entry in value.values() for one in _numbers(entry)]
    if isinstance(value, str | bool):
        return []
    return [abs(float(one)) for one in np.ravel(value)]
