"""The table of the dimensionless groups: every fact about a group is written here, once."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

_MASSES = ("pair",)
_OMEGA_H = ("pair", "mesh.mean_stiffness_N_per_um_mm")
_LENGTH = ("mesh.length_scale_um or mesh.half_backlash_um",)
_SHAPE = ("mesh.stiffness",)


@dataclass(frozen=True, kw_only=True)
class GroupRow:
    """One dimensionless group: its names, what needs it, which values it may take.

    Attributes
    ----------
    name : str
        Key in ``[groups]``, attribute of `Groups`, name in the result file.
    symbol, mathtext : str
        The symbol as plain text and as matplotlib mathtext.
    long_name, units : str
        For people and for files; ``"1"`` is dimensionless.
    default : float or None
        Value where the group is neither given nor derivable; None: it has to be known.
    effects : frozenset of str
        The group is needed when any of these effects is on; empty: always.
    minimum, maximum : float or None
        Bounds of the valid range; None: unbounded (but finite).
    excludes_minimum, excludes_maximum : bool
        Whether the bound itself is invalid.
    sweepable : bool
        Whether a sweep may vary it.
    is_list : bool
        Whether it is a list with one entry per harmonic.
    derived_from : tuple of str
        Configuration keys from which the group is derived when it is not given.
    """

    name: str
    symbol: str
    mathtext: str
    long_name: str
    units: str = "1"
    default: float | None = None
    effects: frozenset[str] = frozenset()
    minimum: float | None = None
    excludes_minimum: bool = False
    maximum: float | None = None
    excludes_maximum: bool = False
    sweepable: bool = True
    is_list: bool = False
    derived_from: tuple[str, ...] = ()

    @property
    def rule(self) -> str:
        """The valid range in words, such as ``finite and >= 0``."""
        lower = "" if self.minimum is None else f"{'>' if self.excludes_minimum else '>='} "
        upper = "" if self.maximum is None else f"{'<' if self.excludes_maximum else '<='} "
        bounds = [
            f"{sign}{bound:g}"
            for sign, bound in ((lower, self.minimum), (upper, self.maximum))
            if bound is not None
        ]
        return " and ".join(["finite", *bounds])

    def admits(self, value: npt.ArrayLike) -> bool:
        """Whether every entry of a value lies in the valid range."""
        values = np.asarray(value, dtype=np.float64)
        low = -math.inf if self.minimum is None else self.minimum
        high = math.inf if self.maximum is None else self.maximum
        above = values > low if self.excludes_minimum else values >= low
        below = values < high if self.excludes_maximum else values <= high
        return bool(np.all(np.isfinite(values) & above & below))

    def needed_by(self, effects: Iterable[str]) -> bool:
        """Whether a scene with these effects needs the group."""
        return not self.effects or not self.effects.isdisjoint(effects)


def _bearing_rows(direction: str, digit: int) -> tuple[GroupRow, ...]:
    effects = frozenset({direction})
    rows = []
    for gear, row_digit, words in (("p", 1, "driving"), ("g", 2, "driven")):
        index = f"{row_digit}{digit}"
        for kind, symbol, mathtext, unit in (
            ("stiffness", "k", "k", "N_per_m"),
            ("damping", "eta", r"\eta", "N_s_per_m"),
        ):
            rows.append(
                GroupRow(
                    name=f"{direction}_{kind}_{gear}",
                    symbol=f"{symbol}_{index}",
                    mathtext=rf"${mathtext}_{{{index}}}$",
                    long_name=f"{direction} bearing {kind} of the {words} gear",
                    effects=effects,
                    minimum=0.0,
                    derived_from=(*_OMEGA_H, f"bearings.{direction}_{kind}_{unit}"),
                )
            )
    return tuple(rows)


GROUP_TABLE: tuple[GroupRow, ...] = (
    GroupRow(
        name="mesh_frequency",
        symbol="Omega",
        mathtext=r"$\Omega$",
        long_name="angular mesh frequency",
        minimum=0.0,
        excludes_minimum=True,
        derived_from=(*_OMEGA_H, "operation.speed_rpm"),
    ),
    GroupRow(
        name="load",
        symbol="f_n",
        mathtext=r"$f_n$",
        long_name="static load",
        derived_from=(*_OMEGA_H, "operation.torque_Nm", *_LENGTH),
    ),
    GroupRow(
        name="damping_ratio",
        symbol="xi",
        mathtext=r"$\xi$",
        long_name="mesh damping ratio",
        minimum=0.0,
        derived_from=("mesh.damping_ratio, or mesh.damping_N_s_per_m", *_OMEGA_H),
    ),
    GroupRow(
        name="base_helix_angle_deg",
        symbol="beta_b",
        mathtext=r"$\beta_b$",
        long_name="base helix angle",
        units="degree",
        minimum=0.0,
        maximum=90.0,
        excludes_maximum=True,
        derived_from=("pair",),
    ),
    GroupRow(
        name="half_backlash",
        symbol="b",
        mathtext="$b$",
        long_name="half backlash",
        effects=frozenset({"backlash"}),
        minimum=0.0,
        derived_from=("mesh.half_backlash_um",),
    ),
    GroupRow(
        name="pitch_error",
        symbol="P",
        mathtext="$P$",
        long_name="multiple of the pitch error",
        default=1.0,
        effects=frozenset({"pitch_error"}),
    ),
    GroupRow(
        name="pitch_error_amplitude",
        symbol="e_r",
        mathtext="$e_r$",
        long_name="amplitude of one pitch error",
        effects=frozenset({"pitch_error"}),
        derived_from=("pitch_error.amplitude_um", *_LENGTH),
    ),
    GroupRow(
        name="pitch_error_mean",
        symbol="e_0",
        mathtext="$e_0$",
        long_name="mean of one pitch error",
        default=0.0,
        effects=frozenset({"pitch_error"}),
        derived_from=("pitch_error.mean_um", *_LENGTH),
    ),
    GroupRow(
        name="pitch_error_phase_deg",
        symbol="phi",
        mathtext=r"$\varphi$",
        long_name="phase of the pitch error",
        units="degree",
        default=0.0,
        effects=frozenset({"pitch_error"}),
        derived_from=("pitch_error.phase_deg",),
    ),
    GroupRow(
        name="stiffness_variation_scale",
        symbol="s",
        mathtext="$s$",
        long_name="scale on the mesh stiffness variation",
        default=1.0,
        effects=frozenset({"stiffness_variation"}),
    ),
    GroupRow(
        name="stiffness_cosine",
        symbol="a_n/k_m",
        mathtext="$a_n/k_m$",
        long_name="cosine harmonics of the mesh stiffness relative to its mean",
        effects=frozenset({"stiffness_variation"}),
        sweepable=False,
        is_list=True,
        derived_from=_SHAPE,
    ),
    GroupRow(
        name="stiffness_sine",
        symbol="c_n/k_m",
        mathtext="$c_n/k_m$",
        long_name="sine harmonics of the mesh stiffness relative to its mean",
        effects=frozenset({"stiffness_variation"}),
        sweepable=False,
        is_list=True,
        derived_from=_SHAPE,
    ),
    *(
        GroupRow(
            name=f"mass_ratio_{gear}",
            symbol=f"m_e/m_{gear}",
            mathtext=f"$m_e/m_{gear}$",
            long_name=f"equivalent mass over the mass of the {words} gear",
            effects=frozenset({"transverse", "axial"}),
            minimum=0.0,
            excludes_minimum=True,
            derived_from=_MASSES,
        )
        for gear, words in (("p", "driving"), ("g", "driven"))
    ),
    *_bearing_rows("transverse", 1),
    *_bearing_rows("axial", 2),
)

GROUPS_BY_NAME = MappingProxyType({row.name: row for row in GROUP_TABLE})
