"""The single numbers that the paper prints, computed: one line each, by the key of the number."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from gearchaos.figures.response_lane import samples_per_period
from gearchaos.gear.derivation import derive_groups
from gearchaos.gear.geometry import HelicalPair
from gearchaos.gear.mesh_stiffness import FourierStiffness, TrapezoidalStiffness
from gearchaos.paper.computation import Reproduction, lane_of, largest_acceleration
from gearchaos.paper.published import Published
from gearchaos.records.amplitude_spectrum import spectral_lines

NAN = float("nan")
_METRES_PER_MM = 1e-3
_N_PER_UM_MM = 1e9


def our_numbers(printed: Published, found: Reproduction) -> Mapping[str, float]:
    """Compute each number of `Published.numbers`; not a number where there is no such thing."""
    return {key: float(compute(printed, found)) for key, compute in _OURS.items()}


def contact_line_stiffness(printed: Published) -> TrapezoidalStiffness:
    """Return the mesh stiffness of the contact lines as the paper counts them (eqs 15 to 18)."""
    lines = printed.contact_lines
    return TrapezoidalStiffness(*lines.parts, half_height=lines.half_height)


def printed_series(printed: Published) -> FourierStiffness:
    """Return the mesh stiffness of Table 2 relative to its mean (eq. 19)."""
    mean = printed.numbers["mean_stiffness"].value
    harmonics = printed.harmonics
    return FourierStiffness(np.divide(harmonics.cosine, mean), np.divide(harmonics.sine, mean))


def pair_of(found: Reproduction) -> HelicalPair:
    """Return the gear pair of the configuration (Table 1)."""
    pair = found.config.pair
    assert pair is not None, "the configuration of the paper has a pair"
    return HelicalPair(
        teeth=pair.teeth,
        normal_module=pair.normal_module_mm * _METRES_PER_MM,
        normal_pressure_angle=math.radians(pair.normal_pressure_angle_deg),
        helix_angle=math.radians(pair.helix_angle_deg),
        face_width=pair.face_width_mm * _METRES_PER_MM,
    )


def _teeth(found: Reproduction, gear: int) -> float:
    return float(pair_of(found).teeth[gear])


def _mean_stiffness(printed: Published) -> float:
    """Mean about which Table 2's variation is that of the contact lines, in N/(um mm)."""
    cosine, sine = printed.harmonics.cosine, printed.harmonics.sine
    variation = FourierStiffness(cosine, sine).to_trapezoid().half_height
    return variation / printed.contact_lines.half_height


def _mesh_damping(printed: Published, found: Reproduction) -> float:
    """c_m = 2 xi sqrt(k_m m_e) with the stiffness of the whole face width, in N s/m."""
    pair = pair_of(found)
    per_width = printed.numbers["mean_stiffness"].value * _N_PER_UM_MM
    product = per_width * pair.face_width * pair.equivalent_mass
    return 2.0 * _damping_ratio(found) * math.sqrt(product)


def _damping_ratio(found: Reproduction) -> float:
    return float(found.config.groups.given()["damping_ratio"])  # type: ignore[arg-type]


def _frequency(printed: Published, found: Reproduction) -> float:
    """omega = 2 pi f / omega_h (eq. 9)."""
    operation = {"speed_rpm": printed.driving_speed_rpm}
    return float(derive_groups(found.config.replace("operation", operation))["mesh_frequency"])


def _mesh_period(found: Reproduction) -> float:
    return float(found.response["mesh_period"][0])


def _spectral_peak(found: Reproduction) -> float:
    """Frequency of the highest line at one e(tau), in cycles per unit of dimensionless time."""
    response = found.response
    values = response["delta_5_acceleration"][lane_of(response, 1.0)]
    lines = spectral_lines(values[:-1], samples_per_period(response))
    highest = lines.order[1:][np.argmax(lines.amplitude[1:])]
    return float(highest) / _mesh_period(found)


def _hop(found: Reproduction) -> float:
    change = None if found.hop is None else found.hop.changes.get("rest")
    return NAN if change is None else change.after


def _hop_exponent(found: Reproduction, side: int) -> float:
    change = None if found.hop is None else found.hop.changes.get("rest")
    return NAN if change is None else change.exponents[side]


_OURS: Mapping[str, Callable[[Published, Reproduction], float]] = MappingProxyType(
    {
        "driven_speed": lambda p, f: p.driving_speed_rpm * _teeth(f, 0) / _teeth(f, 1),
        "mesh_frequency_hz": lambda p, f: p.driving_speed_rpm / 60.0 * _teeth(f, 0),
        "total_contact_ratio": lambda _, f: float(pair_of(f).total_contact_ratio),
        "mean_stiffness": lambda p, _: _mean_stiffness(p),
        "damping_ratio": lambda _, f: _damping_ratio(f),
        "mesh_damping": _mesh_damping,
        "frequency": _frequency,
        "mesh_period": lambda _, f: _mesh_period(f),
        "added_acceleration": lambda _, f: (
            largest_acceleration(f.response, 1.0) - largest_acceleration(f.response, 0.0)
        ),
        "spectral_peak": lambda _, f: _spectral_peak(f),
        "hop": lambda _, f: _hop(f),
        "hop_exponent_before": lambda _, f: _hop_exponent(f, 0),
        "hop_exponent_after": lambda _, f: _hop_exponent(f, 1),
    }
)
