"""The table of the dimensionless groups: every fact about a group is written here, once."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

_GEARS = (("p", 1, "driving"), ("g", 2, "driven"))


LARGEST_VALUE = 1e300
"""What sweeps reach at most: sums and differences of such values are numbers, too."""


class Range(NamedTuple):
    """The valid numbers: finite, and greater than, at least, less than, at most these bounds."""

    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None

    @property
    def bounds(self) -> str:
        """The bounds in words, such as ``> 0 and < 90``; empty where there are none."""
        signs = zip((">", ">=", "<", "<="), self, strict=True)
        return " and ".join(f"{sign} {bound:.12g}" for sign, bound in signs if bound is not None)

    @property
    def rule(self) -> str:
        """The whole range in words, such as ``finite and >= 0``."""
        return f"finite and {self.bounds}" if self.bounds else "finite"

    def admits(self, value: npt.ArrayLike) -> bool:
        """Whether every entry of a value is valid."""
        values = np.asarray(value, dtype=np.float64)
        valid = np.isfinite(values)
        tests = zip((np.greater, np.greater_equal, np.less, np.less_equal), self, strict=True)
        for test, bound in tests:
            if bound is not None:
                valid = valid & test(values, bound)
        return bool(np.all(valid))


ANY_NUMBER = Range()


@dataclass(frozen=True)
class GroupRow:
    """One dimensionless group: its names, what needs it, which values it may take.

    ``name``: key in ``[groups]``, attribute of `Groups`, name in the result file; ``mathtext``: its
    symbol; ``long_name``, ``units``: for people and files, ``"1"`` is dimensionless; ``default``:
    where the group is neither given nor derivable, None: it has to be known; ``effects``: it is
    needed when any of these is on, empty: always; ``is_list``: one entry per harmonic, which a
    sweep cannot vary.
    """

    name: str
    mathtext: str
    long_name: str
    valid: Range = ANY_NUMBER
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


def _bearing_rows(direction: str, digit: int) -> Iterable[GroupRow]:
    for gear, number, words in _GEARS:
        for kind, letter in (("stiffness", "k"), ("damping", r"\eta")):
            yield GroupRow(
                f"{direction}_{kind}_{gear}",
                f"${letter}_{{{number}{digit}}}$",
                f"{direction} bearing {kind} of the {words} gear",
                Range(ge=0.0),
                effects=frozenset({direction}),
            )


_ERROR = frozenset({"pitch_error"})
_STIFFNESS = frozenset({"stiffness_variation"})

GROUP_TABLE: tuple[GroupRow, ...] = (
    GroupRow("mesh_frequency", r"$\Omega$", "angular mesh frequency", Range(gt=0.0)),
    GroupRow("load", "$f_n$", "static load"),
    GroupRow("damping_ratio", r"$\xi$", "mesh damping ratio", Range(ge=0.0)),
    GroupRow(
        "base_helix_angle_deg",
        r"$\beta_b$",
        "base helix angle",
        Range(ge=0.0, lt=90.0),
        units="degree",
    ),
    GroupRow(
        "half_backlash", "$b$", "half backlash", Range(ge=0.0), effects=frozenset({"backlash"})
    ),
    GroupRow("pitch_error", "$P$", "multiple of the pitch error", default=1.0, effects=_ERROR),
    GroupRow("pitch_error_amplitude", "$e_r$", "amplitude of one pitch error", effects=_ERROR),
    GroupRow("pitch_error_mean", "$e_0$", "mean of one pitch error", default=0.0, effects=_ERROR),
    GroupRow(
        "pitch_error_phase_deg",
        r"$\varphi$",
        "phase of the pitch error",
        units="degree",
        default=0.0,
        effects=_ERROR,
    ),
    GroupRow(
        "stiffness_variation_scale",
        "$s$",
        "scale on the mesh stiffness variation",
        default=1.0,
        effects=_STIFFNESS,
    ),
    *(
        GroupRow(
            f"stiffness_{kind}",
            f"${letter}_n/k_m$",
            f"{kind} harmonics of the mesh stiffness relative to its mean",
            effects=_STIFFNESS,
            is_list=True,
        )
        for kind, letter in (("cosine", "a"), ("sine", "c"))
    ),
    *(
        GroupRow(
            f"mass_ratio_{gear}",
            f"$m_e/m_{gear}$",
            f"equivalent mass over the mass of the {words} gear",
            Range(gt=0.0),
            effects=frozenset({"transverse", "axial"}),
        )
        for gear, _, words in _GEARS
    ),
    *_bearing_rows("transverse", 1),
    *_bearing_rows("axial", 2),
)

GROUPS_BY_NAME = MappingProxyType({row.name: row for row in GROUP_TABLE})
