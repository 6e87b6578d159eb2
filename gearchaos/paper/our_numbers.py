"""The single numbers that the paper prints, computed, by the key of the number."""

import math

import numpy as np
from numpy.typing import NDArray

from gearchaos.figures.response import coordinates_of, samples_per_period
from gearchaos.gear.derivation import Quantities, derive_groups
from gearchaos.gear.geometry import HelicalPair
from gearchaos.gear.mesh_stiffness import TrapezoidalStiffness
from gearchaos.paper.computation import Reproduction, lane_of, largest_acceleration
from gearchaos.paper.published import published
from gearchaos.records.amplitude_spectrum import spectral_lines

_N_PER_UM_MM = 1e9


def our_numbers(found: Reproduction) -> dict[str, float]:
    """Compute each number of `Published.numbers`; not a number where there is no such thing."""
    mean = published().numbers["mean_stiffness"].value
    pair, speed, response = pair_of(found), published().driving_speed_rpm, found.response
    table_2 = mean * printed_coefficients()
    lines = contact_line_stiffness().coefficients(table_2.size)
    damping_ratio = found.group("damping_ratio")
    whole_width = mean * _N_PER_UM_MM * pair.face_width
    driven = found.config.replace("operation", {"speed_rpm": speed})
    torsion = response["delta_5_acceleration"][lane_of(response, 1.0), :-1]
    order, amplitude = spectral_lines(torsion, samples_per_period(response))
    numbers = {
        "driven_speed": speed * pair.teeth[0] / pair.teeth[1],
        "mesh_frequency_hz": speed / 60.0 * pair.teeth[0],
        "total_contact_ratio": pair.total_contact_ratio,
        # The mean about which Table 2's variation is that of the contact lines, in N/(um mm).
        "mean_stiffness": np.vdot(lines, table_2).real / np.vdot(lines, lines).real,
        "damping_ratio": damping_ratio,
        # c_m = 2 xi sqrt(k_m m_e) with the stiffness of the whole face width, in N s/m (eq. 20).
        "mesh_damping": 2.0 * damping_ratio * math.sqrt(whole_width * pair.equivalent_mass),
        # omega = 2 pi f / omega_h (eq. 9).
        "frequency": derive_groups(driven.physical())["mesh_frequency"],
        "mesh_period": response["mesh_period"][0],
        "spectral_peak": order[1:][np.argmax(amplitude[1:])] / response["mesh_period"][0],
        "hop": found.hop.changes["rest"][1],
        "hop_exponent_before": found.exponents[0][0],
        "hop_exponent_after": found.exponents[0][1],
    }
    for name in coordinates_of(response):
        without, once = (largest_acceleration(response, p, name) for p in (0.0, 1.0))
        numbers[f"added_{name}"] = once - without
    return {key: float(number) for key, number in numbers.items()}


def contact_line_stiffness() -> TrapezoidalStiffness:
    """Return the mesh stiffness of the contact lines as the paper counts them (eqs 15 to 18)."""
    lines = published().contact_lines
    # Half of the variation relative to its mean, with equal rise and fall.
    half_height = (lines.longest - lines.shortest) / (lines.longest + lines.shortest)
    return TrapezoidalStiffness(**lines.parts, half_height=half_height)


def printed_coefficients() -> NDArray[np.complex128]:
    """Return the coefficients of Table 2 relative to the mean stiffness, as `series_table` does."""
    mean, harmonics = published().numbers["mean_stiffness"].value, published().harmonics
    cosine, sine = (np.divide(wave, mean) for wave in (harmonics.cosine, harmonics.sine))
    series: NDArray[np.complex128] = cosine - 1j * sine
    return series


def pair_of(found: Reproduction) -> HelicalPair:
    """Return the gear pair of the configuration (Table 1)."""
    return Quantities(found.config.physical()).pair
