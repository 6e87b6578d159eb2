"""The single numbers that the paper prints, computed, by the key of the number."""

from __future__ import annotations

import math

import numpy as np

from gearchaos.figures.response_lane import coordinates_of, samples_per_period
from gearchaos.gear.derivation import Quantities, derive_groups
from gearchaos.gear.geometry import HelicalPair
from gearchaos.gear.mesh_stiffness import FourierStiffness, TrapezoidalStiffness
from gearchaos.paper.computation import Reproduction, lane_of, largest_acceleration
from gearchaos.paper.published import Published
from gearchaos.records.amplitude_spectrum import spectral_lines

NAN = float("nan")
_N_PER_UM_MM = 1e9


def our_numbers(printed: Published, found: Reproduction) -> dict[str, float]:
    """Compute each number of `Published.numbers`; not a number where there is no such thing."""
    pair, speed, response = pair_of(found), printed.driving_speed_rpm, found.response
    harmonics = printed.harmonics
    table_2 = FourierStiffness(harmonics.cosine, harmonics.sine).coefficients()
    lines = contact_line_stiffness(printed).to_fourier(table_2.size).coefficients()
    damping_ratio = found.group("damping_ratio")
    whole_width = printed.numbers["mean_stiffness"].value * _N_PER_UM_MM * pair.face_width
    driven = found.config.replace("operation", {"speed_rpm": speed})
    change = None if found.hop is None else found.hop.changes.get("rest")
    exponents = (NAN, NAN) if found.exponents is None else found.exponents
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
        **{
            f"added_{name}": largest_acceleration(response, 1.0, name)
            - largest_acceleration(response, 0.0, name)
            for name in coordinates_of(response)
        },
        "spectral_peak": _highest_order(found) / response["mesh_period"][0],
        "hop": NAN if change is None else change.after,
        "hop_exponent_before": exponents[0],
        "hop_exponent_after": exponents[1],
    }
    return {key: float(number) for key, number in numbers.items()}


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
    return Quantities(found.config.physical()).pair


def _highest_order(found: Reproduction) -> float:
    """Order of the highest line of the torsional acceleration at one e(tau)."""
    values = found.response["delta_5_acceleration"][lane_of(found.response, 1.0)]
    lines = spectral_lines(values[:-1], samples_per_period(found.response))
    return float(lines.order[1:][np.argmax(lines.amplitude[1:])])
