"""Geometry and inertia of a helical gear pair from catalogue data."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from gearchaos.arrays import Floats

Value: TypeAlias = float | Floats
PairOfValues: TypeAlias = tuple[Value, Value]


@dataclass(frozen=True, eq=False, kw_only=True)
class HelicalPair:
    """An external helical gear pair (DIN 3960, ISO 21771).

    Without profile shift it is at standard centre distance. A spur pair has a helix angle of zero.
    Every quantity may be a float or an array; arrays broadcast against each other. Pairs of values
    are in the order (driving p, driven g).

    ``teeth``: numbers of teeth z; ``normal_module``, ``face_width``: m_n and B, in m;
    ``normal_pressure_angle``, ``helix_angle``: alpha_n, and beta on the reference circle, in rad;
    ``density``: of the solid discs on the reference circles, in kg/m^3; ``given_masses``,
    ``given_inertias``: in kg and kg m^2, they replace those of the solid discs;
    ``profile_shift``: coefficients x; ``centre_distance``: a in m, by default the one at which
    gears with this profile shift mesh without backlash; ``tip_diameters``: d_a in m, by default
    those for an addendum of one m_n that keep the clearance at the root; ``contact_ratio``:
    eps_alpha where it is known.
    """

    teeth: PairOfValues
    normal_module: Value
    normal_pressure_angle: Value
    helix_angle: Value
    face_width: Value
    density: Value
    given_masses: PairOfValues | None = None
    given_inertias: PairOfValues | None = None
    profile_shift: PairOfValues | None = None
    centre_distance: Value | None = None
    tip_diameters: PairOfValues | None = None
    contact_ratio: Value | None = None

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
    def standard_centre_distance(self) -> Value:
        """Sum of the radii of the reference circles, in m."""
        return self.reference_radii[0] + self.reference_radii[1]

    @property
    def working_pressure_angle(self) -> Value:
        """alpha_wt in rad: from the centre distance, or from the sum of the profile shifts.

        cos(alpha_wt) = (r_b1 + r_b2) / a, and inv(alpha_wt) = inv(alpha_t) + 2 tan(alpha_n)
        (x_1 + x_2) / (z_1 + z_2).
        """
        if self.centre_distance is not None:
            cosine = (self.base_radii[0] + self.base_radii[1]) / self.centre_distance
            # Not a number where the base circles overlap; the rules of the lanes refuse it.
            with np.errstate(invalid="ignore"):
                return np.arccos(cosine)
        alpha = self.transverse_pressure_angle
        if self.profile_shift is None:
            return alpha
        shift = self.profile_shift[0] + self.profile_shift[1]
        more = 2.0 * np.tan(self.normal_pressure_angle) * shift / (self.teeth[0] + self.teeth[1])
        return angle_of_involute(np.tan(alpha) - alpha + more)

    @property
    def working_centre_distance(self) -> Value:
        """The centre distance a in m: as given, or (r_b1 + r_b2) / cos(alpha_wt)."""
        if self.centre_distance is not None:
            return self.centre_distance
        if self.profile_shift is None:
            return self.standard_centre_distance
        bases = self.base_radii[0] + self.base_radii[1]
        return bases / np.cos(self.working_pressure_angle)

    @property
    def tip_radii(self) -> PairOfValues:
        """Radii r_a of the tip circles, in m.

        By default r + m_n (1 + x + k), where k m_n = a - a_d - m_n (x_1 + x_2) shortens the teeth;
        without a profile shift r + m_n, at any centre distance.
        """
        if self.tip_diameters is not None:
            return self.tip_diameters[0] / 2.0, self.tip_diameters[1] / 2.0
        (radius_p, radius_g), module = self.reference_radii, self.normal_module
        if self.profile_shift is None:
            return radius_p + module, radius_g + module
        shift_p, shift_g = self.profile_shift
        apart = self.working_centre_distance - self.standard_centre_distance
        # x_1 + k = (a - a_d) / m_n - x_2
        return radius_p + module * (1.0 - shift_g) + apart, (
            radius_g + module * (1.0 - shift_p) + apart
        )

    @property
    def transverse_contact_ratio(self) -> Value:
        """eps_alpha: as given, or the length of the path of contact over p_bt."""
        if self.contact_ratio is not None:
            return self.contact_ratio
        reaches = [
            np.sqrt(tip**2 - base**2)
            for tip, base in zip(self.tip_radii, self.base_radii, strict=True)
        ]
        angle = self.working_pressure_angle
        between_base_circles = self.working_centre_distance * np.sin(angle)
        return (reaches[0] + reaches[1] - between_base_circles) / self.transverse_base_pitch

    @property
    def transverse_contact_rounding(self) -> Value:
        """Bound of the rounding error of eps_alpha.

        Each reach is the root of a difference of squares. A rounding error of the tip radius r_a
        by eps r_a changes it by eps r_a^2 / reach, which is larger than that of any other term;
        about ten operations round.
        """
        bound: Value = 0.0
        for tip, base in zip(self.tip_radii, self.base_radii, strict=True):
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


def angle_of_involute(involute: Value) -> Value:
    """Return the angle in rad with tan(angle) - angle of this value, not a number below 0."""
    value = np.where(np.asarray(involute) > 0.0, involute, np.nan)
    # Exact to second order at small angles, and Newton's method converges from above.
    angle: Floats = np.arctan(np.cbrt(3.0 * value) * (1.0 + 0.4 * np.cbrt(3.0 * value)))
    for _ in range(30):
        tangent = np.tan(angle)
        angle = angle - (tangent - angle - value) / tangent**2
    return angle if angle.ndim else float(angle)
