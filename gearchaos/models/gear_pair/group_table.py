"""Every fact about the dimensionless groups of eq. 13, once."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from types import MappingProxyType

from gearchaos.configuration.ranges import Range


@dataclass(frozen=True)
class GroupRow:
    """One dimensionless group: its names, the effects that need it, and its valid values.

    Attributes
    ----------
    name : str
        Key in ``[groups]``, attribute of `Groups`, and name in the result file.
    mathtext, long_name : str
        Symbol, and wording for people.
    valid : Range
        Valid values.
    units : str
        ``"1"`` if dimensionless.
    default : float or None
        Value where the group is neither given nor derivable; None: it has to be known.
    effects : frozenset of str
        The group is needed when any of these acts; empty: always.
    is_list : bool
        Whether it has one entry per harmonic, which a sweep cannot vary.
    """

    name: str
    mathtext: str
    long_name: str
    valid: Range = field(default_factory=Range)
    units: str = "1"
    default: float | None = None
    effects: frozenset[str] = frozenset()
    is_list: bool = False

    @property
    def symbol(self) -> str:
        """The symbol as plain text, such as ``k_11``."""
        return re.sub(r"\\(var)?|[${}]", "", self.mathtext)

    def needed_by(self, effects: Iterable[str]) -> bool:
        """Whether a scene with these effects needs the group."""
        return not self.effects or not self.effects.isdisjoint(effects)


def _acting(*effects: str) -> frozenset[str]:
    return frozenset(effects)


GROUP_TABLE = (
    GroupRow("mesh_frequency", r"$\Omega$", "angular mesh frequency", valid=Range(gt=0.0)),
    GroupRow("load", r"$f_n$", "static load"),
    GroupRow("damping_ratio", r"$\xi$", "mesh damping ratio", valid=Range(ge=0.0)),
    GroupRow(
        "base_helix_angle_deg",
        r"$\beta_b$",
        "base helix angle",
        valid=Range(ge=0.0, lt=90.0),
        units="degree",
    ),
    GroupRow(
        "half_backlash", r"$b$", "half backlash", valid=Range(ge=0.0), effects=_acting("backlash")
    ),
    GroupRow(
        "pitch_error",
        r"$P$",
        "multiple of the pitch error",
        default=1.0,
        effects=_acting("pitch_error"),
    ),
    GroupRow(
        "pitch_error_amplitude",
        r"$e_r$",
        "amplitude of one pitch error",
        effects=_acting("pitch_error"),
    ),
    GroupRow(
        "pitch_error_mean",
        r"$e_0$",
        "mean of one pitch error",
        default=0.0,
        effects=_acting("pitch_error"),
    ),
    GroupRow(
        "pitch_error_phase_deg",
        r"$\varphi$",
        "phase of the pitch error",
        units="degree",
        default=0.0,
        effects=_acting("pitch_error"),
    ),
    GroupRow(
        "stiffness_variation_scale",
        r"$s$",
        "scale on the mesh stiffness variation",
        default=1.0,
        effects=_acting("stiffness_variation"),
    ),
    GroupRow(
        "stiffness_cosine",
        r"$a_n/k_m$",
        "cosine harmonics of the mesh stiffness relative to its mean",
        effects=_acting("stiffness_variation"),
        is_list=True,
    ),
    GroupRow(
        "stiffness_sine",
        r"$c_n/k_m$",
        "sine harmonics of the mesh stiffness relative to its mean",
        effects=_acting("stiffness_variation"),
        is_list=True,
    ),
    GroupRow(
        "mass_ratio_p",
        r"$m_e/m_p$",
        "equivalent mass over the mass of the driving gear",
        valid=Range(gt=0.0),
        effects=_acting("transverse", "axial"),
    ),
    GroupRow(
        "mass_ratio_g",
        r"$m_e/m_g$",
        "equivalent mass over the mass of the driven gear",
        valid=Range(gt=0.0),
        effects=_acting("transverse", "axial"),
    ),
    GroupRow(
        "transverse_stiffness_p",
        r"$k_{11}$",
        "transverse bearing stiffness of the driving gear",
        valid=Range(ge=0.0),
        effects=_acting("transverse"),
    ),
    GroupRow(
        "transverse_damping_p",
        r"$\eta_{11}$",
        "transverse bearing damping of the driving gear",
        valid=Range(ge=0.0),
        effects=_acting("transverse"),
    ),
    GroupRow(
        "transverse_stiffness_g",
        r"$k_{21}$",
        "transverse bearing stiffness of the driven gear",
        valid=Range(ge=0.0),
        effects=_acting("transverse"),
    ),
    GroupRow(
        "transverse_damping_g",
        r"$\eta_{21}$",
        "transverse bearing damping of the driven gear",
        valid=Range(ge=0.0),
        effects=_acting("transverse"),
    ),
    GroupRow(
        "axial_stiffness_p",
        r"$k_{12}$",
        "axial bearing stiffness of the driving gear",
        valid=Range(ge=0.0),
        effects=_acting("axial"),
    ),
    GroupRow(
        "axial_damping_p",
        r"$\eta_{12}$",
        "axial bearing damping of the driving gear",
        valid=Range(ge=0.0),
        effects=_acting("axial"),
    ),
    GroupRow(
        "axial_stiffness_g",
        r"$k_{22}$",
        "axial bearing stiffness of the driven gear",
        valid=Range(ge=0.0),
        effects=_acting("axial"),
    ),
    GroupRow(
        "axial_damping_g",
        r"$\eta_{22}$",
        "axial bearing damping of the driven gear",
        valid=Range(ge=0.0),
        effects=_acting("axial"),
    ),
    GroupRow(
        "friction_coefficient",
        r"$\mu$",
        "coefficient of friction between the teeth",
        valid=Range(ge=0.0, lt=1.0),
        effects=_acting("friction"),
    ),
    GroupRow(
        "friction_lever",
        r"$\lambda$",
        "lever of friction at the pitch point over that of the mesh force",
        valid=Range(ge=0.0),
        effects=_acting("friction"),
    ),
    GroupRow(
        "pitch_point_phase_deg",
        r"$\varphi_C$",
        "mesh phase at which the contact passes the pitch point",
        units="degree",
        default=0.0,
        effects=_acting("friction"),
    ),
)

GROUPS_BY_NAME = MappingProxyType({row.name: row for row in GROUP_TABLE})

SWEEPABLE_GROUPS = MappingProxyType({row.name: row for row in GROUP_TABLE if not row.is_list})
"""Groups that a sweep may vary, by name."""

HARMONICS = tuple(row.name for row in GROUP_TABLE if row.is_list)
"""The two lists of harmonics of the mesh stiffness."""
