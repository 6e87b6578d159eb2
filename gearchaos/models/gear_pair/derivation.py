"""Dimensionless groups from physical data (Pan 2021, eqs 8-13 and 20).

Scales: length b', time 1 / omega_h with omega_h = sqrt(k_m / m_e).
"""

import math
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from functools import cached_property
from typing import Any

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.models.gear_pair.contact_lines import TrapezoidalStiffness
from gearchaos.models.gear_pair.geometry import HelicalPair, Value
from gearchaos.models.phase_series import Series
from gearchaos.models.stiffness_table import IN_N_PER_UM, PER_WIDTH, table_series

_MICROMETRE = 1e-6
_MILLIMETRE = 1e-3
BACKLASHES = (
    "mesh.half_backlash_um",
    "mesh.circumferential_backlash_um",
    "mesh.normal_backlash_um",
)
"""Paths of the backlash; a configuration gives one of them."""

_N_PER_UM_MM = 1e9  # stiffness per unit face width: 1 N/(um mm) = 1e9 N/m^2


def derive_scales(physical: Mapping[str, Any], load: Value, frequency: Value) -> dict[str, Value]:
    """Compute those of the `SCALES` for which the physical data suffice; see `derive_groups`.

    ``load``, ``frequency``: two groups that connect dimensionless values with units.
    """
    found = _derive(physical, _SCALE_DERIVATIONS)
    with suppress(KeyError):
        found["mesh_period"] = 2.0 * np.pi / (frequency * found[FREQUENCY])
        found["static_load"] = load * found[STIFFNESS] * found[LENGTH] * _MICROMETRE
    return found


def derive_groups(physical: Mapping[str, Any], without: Collection[str] = ()) -> dict[str, Value]:
    """Compute every group for which the physical data suffice.

    ``physical`` holds every key of the physical tables of a configuration by its path, such as
    ``pair.teeth``, with its value; None is not known, and a number may be an array over lanes,
    which broadcasts. A group whose inputs are not all known is absent, as are those ``without``.
    Raises KeyError if the mapping lacks a path.
    """
    return _derive(physical, {name: _DERIVATIONS[name] for name in _DERIVATIONS.keys() - without})


def _derive(
    physical: Mapping[str, Any], derivations: Mapping[str, Callable[["Quantities"], Any]]
) -> dict[str, Value]:
    quantities = Quantities(physical)
    found: dict[str, Value] = {}
    for name, derivation in derivations.items():
        with suppress(_UnknownError):
            found[name] = derivation(quantities)
    return found


# Ones may contradict the known data.
@np.errstate(all="ignore")
def paths_behind(group: str, physical: Mapping[str, Any]) -> Collection[str]:
    """Return the paths of the physical data from which a group follows.

    ``physical`` is as `derive_groups` takes it; an unknown value is replaced by 1.
    """
    quantities = Quantities(physical, np.ones(2))
    with suppress(ArithmeticError, ValueError):
        _DERIVATIONS[group](quantities)
    return quantities.read_paths


class _UnknownError(Exception):
    """A physical quantity that a derivation needs is not known."""


class Quantities:
    """Physical data in SI units, and what follows from them."""

    def __init__(self, physical: Mapping[str, Any], unknown: Floats | None = None) -> None:
        self.physical, self._unknown = physical, unknown
        self.read_paths: dict[str, None] = {}

    def __getitem__(self, path: str) -> Any:
        self.read_paths[path] = None
        value = self.physical[path]
        value = self._unknown if value is None else value
        if value is None:
            raise _UnknownError(path)
        return value

    @cached_property
    def pair(self) -> HelicalPair:
        return HelicalPair(
            teeth=self["pair.teeth"],
            normal_module=self["pair.normal_module_mm"] * _MILLIMETRE,
            normal_pressure_angle=np.radians(self["pair.normal_pressure_angle_deg"]),
            helix_angle=np.radians(self["pair.helix_angle_deg"]),
            face_width=self["pair.face_width_mm"] * _MILLIMETRE,
            density=self["pair.density_kg_m3"],
            given_masses=self.physical["pair.masses_kg"],
            given_inertias=self.physical["pair.inertias_kg_m2"],
            profile_shift=self.physical["pair.profile_shift"],
            centre_distance=_in_metres(self.physical["pair.centre_distance_mm"]),
            tip_diameters=_in_metres(self.physical["pair.tip_diameters_mm"]),
            contact_ratio=self.physical["pair.contact_ratio"],
        )

    @cached_property
    def mean_stiffness(self) -> Any:
        """k_m in N/m: mean mesh stiffness per unit face width times the face width.

        A table of the stiffness in units of force has its mean.
        """
        unit = self.physical["mesh.stiffness.unit"]
        if unit in IN_N_PER_UM:
            return self.table.mean * IN_N_PER_UM[unit] / _MICROMETRE
        if unit == PER_WIDTH:
            return self.table.mean * _N_PER_UM_MM * self.pair.face_width
        per_width = self["mesh.mean_stiffness_N_per_um_mm"] * _N_PER_UM_MM
        return per_width * self.pair.face_width

    @cached_property
    def scaling_frequency(self) -> Any:
        """omega_h = sqrt(k_m / m_e) in rad/s."""
        return np.sqrt(self.mean_stiffness / self.pair.equivalent_mass)

    @cached_property
    def half_backlash(self) -> Any:
        """b_n of eq. 22 in m; y_1 along the transverse line of action has b_n cos(beta_b).

        As given, or from a backlash j_t along the reference circle, j_t cos(alpha_t) along that
        line, or a normal one, j_bn = j_t cos(alpha_t) cos(beta_b).
        """
        half, circumferential, normal = BACKLASHES
        if self.physical[circumferential] is not None:
            backlash = self[circumferential] * _MICROMETRE
            along = backlash * np.cos(self.pair.transverse_pressure_angle)
            return along / (2.0 * np.cos(self.pair.base_helix_angle))
        if self.physical[normal] is not None:
            cosine = np.cos(self.pair.base_helix_angle)
            return self[normal] * _MICROMETRE / (2.0 * cosine**2)
        return self[half] * _MICROMETRE

    @cached_property
    def length_scale(self) -> Any:
        """Length scale b' in m: the one given, else the half backlash."""
        scale = "mesh.length_scale_um"
        if self.physical[scale] is None:
            return self.half_backlash
        return self[scale] * _MICROMETRE

    def over_length_scale(self, path: str) -> Any:
        """Length given in um, over b'."""
        return self[path] * _MICROMETRE / self.length_scale

    def mesh_frequency(self) -> Any:
        """Omega = 2 pi f / omega_h; the paper's omega (eq. 9) is f / omega_h, in cycles."""
        mesh_frequency_hz = self["operation.speed_rpm"] / 60.0 * self.pair.teeth[0]
        return 2.0 * np.pi * mesh_frequency_hz / self.scaling_frequency

    def load(self) -> Any:
        """f_n = T_p / (m_e b' r_bp omega_h^2) (Pan 2021, eq. 13)."""
        force = self["operation.torque_Nm"] / self.pair.base_radii[0]
        return force / (self.mean_stiffness * self.length_scale)

    def damping_ratio(self) -> Any:
        """The mesh damping ratio xi, or that of c_m = 2 xi sqrt(k_m m_e) (Pan 2021, eq. 20)."""
        damping = self.physical["mesh.damping_N_s_per_m"]
        if damping is None:
            return self["mesh.damping_ratio"]
        return damping / (2.0 * np.sqrt(self.mean_stiffness * self.pair.equivalent_mass))

    def friction_lever(self) -> Any:
        """Lever of friction over that of the mesh force, tan(alpha_wt) / cos(beta_b).

        At the pitch point the contact is as far from the foot of either perpendicular on the line
        of action as r_b tan(alpha_wt). Friction is that of the normal force, whose component
        along the line of action in the transverse plane has the factor cos(beta_b).
        """
        tangent = np.tan(self.pair.working_pressure_angle)
        return tangent / np.cos(self.pair.base_helix_angle)

    def bearing_stiffness(self, direction: str, gear: int) -> Any:
        """Bearing stiffness k / (m omega_h^2) (Pan 2021, eq. 13, without its stray factor 2)."""
        stiffness = self[f"bearings.{direction}_stiffness_N_per_m"][gear]
        return stiffness / (self.pair.masses[gear] * self.scaling_frequency**2)

    def bearing_damping(self, direction: str, gear: int) -> Any:
        """Bearing damping c / (2 m omega_h) (Pan 2021, eq. 13)."""
        damping = self[f"bearings.{direction}_damping_N_s_per_m"][gear]
        return damping / (2.0 * self.pair.masses[gear] * self.scaling_frequency)

    def pitch_error_amplitude(self) -> Any:
        """Amplitude of a sine over b'; of deviations in um along the reference circle, their unit.

        Along the line of action they count cos(alpha_t) times.
        """
        if self.physical["pitch_error.kind"] in (None, "sine"):
            return self.over_length_scale("pitch_error.amplitude_um")
        return np.cos(self.pair.transverse_pressure_angle) * _MICROMETRE / self.length_scale

    @property
    def table(self) -> Series:
        """The Fourier series of a table of the stiffness, in the unit of the table."""
        names = ("phase", "values", "period", "fit_error", "most_harmonics")
        return table_series(*(self.physical[f"mesh.stiffness.{name}"] for name in names))

    @cached_property
    def stiffness_harmonics(self) -> tuple[Any, Any]:
        """Cosine and sine harmonics of the stiffness relative to its mean (Pan 2021, eqs 15-19).

        Each has the shape (harmonics,), or (..., harmonics) if a swept value enters. The shape does
        not depend on the values, so that every part of a sweep is computed alike.
        """
        if self["mesh.stiffness.shape"] == "fourier":
            mean = np.asarray(self["mesh.mean_stiffness_N_per_um_mm"])[..., np.newaxis]
            cosine = np.divide(self["mesh.stiffness.cosine_N_per_um_mm"], mean)
            return cosine, np.divide(self["mesh.stiffness.sine_N_per_um_mm"], mean)
        if self["mesh.stiffness.shape"] == "table":
            series = self.table
            return np.array(series.cosine) / series.mean, np.array(series.sine) / series.mean
        ratios = self.pair.transverse_contact_ratio, self.pair.overlap_contact_ratio
        trapezoid = TrapezoidalStiffness.from_contact_ratios(*ratios)
        coefficients = trapezoid.coefficients(self["mesh.stiffness.harmonics"])
        return coefficients.real, -coefficients.imag


def _in_metres(millimetres: Any) -> Any:
    """Return a length, or a pair of lengths, in m; None if it is not known."""
    if millimetres is None:
        return None
    if isinstance(millimetres, tuple | list):
        return tuple(_MILLIMETRE * one for one in millimetres)
    return _MILLIMETRE * millimetres


def common_contact_ratios(pair: HelicalPair) -> tuple[float, float] | None:
    """Return eps_alpha and eps_beta of all lanes, None where they differ by more than rounding.

    In a spur pair they do not depend on the module, but their last digits do.
    """
    overlap = pair.overlap_contact_ratio
    rounding = 10.0 * np.finfo(np.float64).eps * np.abs(overlap)
    found = (
        _common(pair.transverse_contact_ratio, pair.transverse_contact_rounding),
        _common(overlap, rounding),
    )
    return None if found[0] is None or found[1] is None else (found[0], found[1])


def _common(value: Value, rounding: Value) -> float | None:
    """Return the value that all lanes share, each up to its rounding error, None if there is none.

    Values that differ by rounding are replaced by the smallest.
    """
    values, bound = np.ravel(value), float(np.max(rounding))
    # Not a number where the pair is impossible; the rules of the lanes refuse it with its key.
    if np.isnan(values).all():
        return math.nan
    smallest, largest = float(np.min(values)), float(np.max(values))
    return smallest if largest - smallest <= 2.0 * bound else None


LENGTH, FREQUENCY, STIFFNESS = "length_scale", "scaling_frequency", "mean_mesh_stiffness"
SCALES = {
    LENGTH: ("um", "length scale", r"$b\prime$"),
    FREQUENCY: ("s^-1", "scaling frequency", r"$\omega_h$"),
    STIFFNESS: ("N/m", "mean mesh stiffness", "$k_m$"),
    "equivalent_mass": ("kg", "equivalent mass", "$m_e$"),
    "mesh_period": ("s", "mesh period", ""),
    "static_load": ("N", "static load along the transverse line of action", ""),
}
"""Scales of a model, and two groups in units: unit, wording and symbol by name."""

_SCALE_DERIVATIONS: dict[str, Callable[[Quantities], Any]] = {
    LENGTH: lambda q: q.length_scale / _MICROMETRE,
    FREQUENCY: lambda q: q.scaling_frequency,
    STIFFNESS: lambda q: q.mean_stiffness,
    "equivalent_mass": lambda q: q.pair.equivalent_mass,
}

_DERIVATIONS: dict[str, Callable[[Quantities], Any]] = {
    "mesh_frequency": Quantities.mesh_frequency,
    "load": Quantities.load,
    "damping_ratio": Quantities.damping_ratio,
    "base_helix_angle_deg": lambda q: np.degrees(q.pair.base_helix_angle),
    "half_backlash": lambda q: q.half_backlash / q.length_scale,
    "pitch_error_amplitude": Quantities.pitch_error_amplitude,
    "pitch_error_mean": lambda q: q.over_length_scale("pitch_error.mean_um"),
    "pitch_error_phase_deg": lambda q: q["pitch_error.phase_deg"],
    "stiffness_cosine": lambda q: q.stiffness_harmonics[0],
    "stiffness_sine": lambda q: q.stiffness_harmonics[1],
    "mass_ratio_p": lambda q: q.pair.equivalent_mass / q.pair.masses[0],
    "mass_ratio_g": lambda q: q.pair.equivalent_mass / q.pair.masses[1],
    "transverse_stiffness_p": lambda q: q.bearing_stiffness("transverse", 0),
    "transverse_damping_p": lambda q: q.bearing_damping("transverse", 0),
    "transverse_stiffness_g": lambda q: q.bearing_stiffness("transverse", 1),
    "transverse_damping_g": lambda q: q.bearing_damping("transverse", 1),
    "axial_stiffness_p": lambda q: q.bearing_stiffness("axial", 0),
    "axial_damping_p": lambda q: q.bearing_damping("axial", 0),
    "axial_stiffness_g": lambda q: q.bearing_stiffness("axial", 1),
    "axial_damping_g": lambda q: q.bearing_damping("axial", 1),
    "friction_coefficient": lambda q: q["mesh.friction_coefficient"],
    "friction_lever": Quantities.friction_lever,
}
