"""Geometry and inertia of a helical gear pair from catalogue data."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from gearchaos.arrays import Floats

Value: TypeAlias = float | Floats
PairOfValues: TypeAlias = tuple[Value, Value]


@dataclass(frozen=True, eq=False, kw_only=True)
class HelicalPair:
    """An external helical gear pair without profile shift, at standard centre distance.

    A spur pair has a helix angle of zero. Every quantity may be a float or an array; arrays
    broadcast against each other. Pairs of values are in the order (driving p, driven g).

    ``teeth``: numbers of teeth z; ``normal_module``, ``face_width``: m_n and B, in m;
    ``normal_pressure_angle``, ``helix_angle``: alpha_n, and beta on the reference circle, in rad;
    ``density``: of the solid discs on the reference circles, in kg/m^3; ``given_masses``,
    ``given_inertias``: in kg and kg m^2, they replace those of the solid discs.
    """

    teeth: PairOfValues
    normal_module: Value
    normal_pressure_angle: Value
    helix_angle: Value
    face_width: Value
    density: Value
    given_masses: PairOfValues | None = None
    given_inertias: PairOfValues | None = None

    @property
    def transverse_pressure_angle(self) -> Value:
        """alpha_t in rad, from tan(alpha_t) = tan(alpha_n) / cos(beta)."""
        tangent: Value = np.tan(self.normal_pressure_angle) / np.cos(self.helix_angle)
        return np.arctan(tangent)

    @property
    def base_helix_angle(self) -> Value:
        """beta_b in rad, from tan(beta_b) = tan(beta) cos(alpha_t)."""
        tangent: Value = np.tan(self.helix_angle) * np.cos(self.transverse_pressure_angle)
        return np.arctan(tangent)

    @property
    def reference_radii(self) -> PairOfValues:
        """Radii r = m_n z / (2 cos(beta)) of the reference circles, in m."""
        per_tooth = self.normal_module / (2.0 * np.cos(self.helix_angle))
        return per_tooth * self.teeth[0], per_tooth * self.teeth[1]

    @property
    def base_radii(self) -> PairOfValues:
        """Radii r_b = r cos(alpha_t) of the base circles, in m."""
        cosine = np.cos(self.transverse_pressure_angle)
        reference_p, reference_g = self.reference_radii
        return reference_p * cosine, reference_g * cosine

    @property
    def transverse_base_pitch(self) -> Value:
        """p_bt = 2 pi r_b / z in m, one mesh period along the path of contact."""
        return 2.0 * np.pi * self.base_radii[0] / self.teeth[0]

    @property
    def transverse_contact_ratio(self) -> Value:
        """eps_alpha: length of the path of contact over p_bt, for an addendum of one m_n."""
        reaches = [
            np.sqrt((reference + self.normal_module) ** 2 - base**2)
            for reference, base in zip(self.reference_radii, self.base_radii, strict=True)
        ]
        centre_distance = self.reference_radii[0] + self.reference_radii[1]
        between_base_circles = centre_distance * np.sin(self.transverse_pressure_angle)
        return (reaches[0] + reaches[1] - between_base_circles) / self.transverse_base_pitch

    @property
    def transverse_contact_rounding(self) -> Value:
        """Bound of the rounding error of eps_alpha.

        Each reach is the root of a difference of squares. A rounding error of the tip radius r_a
        by eps r_a changes it by eps r_a^2 / reach, which is larger than that of any other term;
        about ten operations round.
        """
        bound: Value = 0.0
        for reference, base in zip(self.reference_radii, self.base_radii, strict=True):
            tip = reference + self.normal_module
            bound = bound + tip**2 / np.sqrt(tip**2 - base**2)
        return 10.0 * np.finfo(np.float64).eps * bound / self.transverse_base_pitch

    @property
    def overlap_contact_ratio(self) -> Value:
        """eps_beta = B tan(beta_b) / p_bt: the lead of the tooth across the face over p_bt."""
        return self.face_width * np.tan(self.base_helix_angle) / self.transverse_base_pitch

    @property
    def total_contact_ratio(self) -> Value:
        """eps_gamma = eps_alpha + eps_beta."""
        return self.transverse_contact_ratio + self.overlap_contact_ratio

    @property
    def masses(self) -> PairOfValues:
        """Masses in kg: the given ones, else of solid discs on the reference circles."""
        if self.given_masses is not None:
            return self.given_masses
        area_density = np.pi * self.density * self.face_width
        reference_p, reference_g = self.reference_radii
        return area_density * reference_p**2, area_density * reference_g**2

    @property
    def inertias(self) -> PairOfValues:
        """Moments of inertia in kg m^2: the given ones, else m r^2 / 2 of uniform discs."""
        if self.given_inertias is not None:
            return self.given_inertias
        mass_p, mass_g = self.masses
        reference_p, reference_g = self.reference_radii
        return mass_p * reference_p**2 / 2.0, mass_g * reference_g**2 / 2.0

    @property
    def equivalent_mass(self) -> Value:
        """m_e = I_p I_g / (I_p r_bg^2 + I_g r_bp^2) in kg (Pan 2021, eq. 12)."""
        inertia_p, inertia_g = self.inertias
        base_p, base_g = self.base_radii
        return inertia_p * inertia_g / (inertia_p * base_g**2 + inertia_g * base_p**2)
