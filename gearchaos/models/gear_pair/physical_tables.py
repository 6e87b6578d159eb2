"""The tables that describe a gear pair in the terms of its drawing and its bearings."""

# The units are part of the keys, capitals and all.
# ruff: noqa: N815

from functools import partial
from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Field

from gearchaos.configuration.keys import AS_LIST, Numbers, Table, key
from gearchaos.models.stiffness_table import StiffnessTable

_Teeth: TypeAlias = Annotated[int, Field(ge=1, le=100_000)]
_NotNegative: TypeAlias = Annotated[float, Field(ge=0)]
_Positive: TypeAlias = Annotated[float, Field(gt=0)]
Harmonics: TypeAlias = Annotated[
    tuple[float, ...], Field(strict=False, min_length=1, max_length=1000)
]
PositivePair: TypeAlias = Annotated[tuple[_Positive, _Positive], AS_LIST]
NumberPair: TypeAlias = Annotated[tuple[float, float], AS_LIST]
NotNegativePair: TypeAlias = Annotated[tuple[_NotNegative, _NotNegative], AS_LIST]
TeethPair: TypeAlias = Annotated[tuple[_Teeth, _Teeth], AS_LIST]

_SHAPE = '"fourier" takes coefficients, "trapezoid" the contact ratio of [pair], "table" a table'
_KIND = '"sine": at mesh frequency, "teeth": as measured, "grade": drawn by an accuracy grade'
_optional = partial(key, default=None)
_mean = partial(key, "mean of the pitch error", "um", 0.0, default=0.0)
_smoothing = partial(
    key, "share of the mesh period in which teeth take their load", "1", default=0.1, ge=0.01, le=1
)


class Pair(Table):
    """Catalogue data of the two gears; pairs of values are [driving, driven]."""

    teeth: TeethPair = key("numbers of teeth [driving, driven]", example=[21, 38])
    normal_module_mm: float = key("normal module", "mm", 2.166, gt=0)
    normal_pressure_angle_deg: float = key("normal pressure angle", "degree", 20.0, gt=0, lt=90)
    helix_angle_deg: float = key(
        "helix angle on the reference circle, either hand", "degree", 20.0, default=0.0, ge=0, lt=90
    )
    face_width_mm: float = key("face width", "mm", 15.0, gt=0)
    profile_shift: NumberPair | None = _optional(
        "profile shift coefficients x [driving, driven]", "1", [0.3, 0.1]
    )
    centre_distance_mm: float | None = _optional(
        "centre distance, by default that without backlash", "mm", 68.0, gt=0
    )
    tip_diameters_mm: PositivePair | None = _optional(
        "diameters of the tip circles [driving, driven], by default for an addendum of one module",
        "mm",
        [52.7, 91.9],
    )
    contact_ratio: float | None = _optional(
        "transverse contact ratio, instead of the one of the tip circles", "1", 1.5, gt=0, le=10
    )
    density_kg_m3: float = key(
        "density of the gears, taken as solid discs on the reference circle",
        "kg/m^3",
        7850.0,
        default=7850.0,
        gt=0,
    )
    masses_kg: PositivePair | None = _optional(
        "masses [driving, driven] instead of those of solid discs", "kg", [0.217, 0.71]
    )
    inertias_kg_m2: PositivePair | None = _optional(
        "moments of inertia [driving, driven] instead of those of solid discs",
        "kg m^2",
        [6.35e-5, 6.8e-4],
    )


class Operation(Table):
    """The point of operation."""

    speed_rpm: float | None = _optional("speed of the driving gear", "rpm", 2000.0, gt=0)
    torque_Nm: float | None = _optional("torque on the driving gear", "N m", 50.0)


class FourierStiffness(Table):
    """Mesh stiffness as a Fourier series over the mesh period (Pan 2021, eq. 19)."""

    shape: Literal["fourier"] = key(_SHAPE, example="fourier")
    cosine_N_per_um_mm: Harmonics = key(
        "cosine coefficients of harmonics 1, 2, ...", "N/(um mm)", [-1.202, 0.0]
    )
    sine_N_per_um_mm: Harmonics = key(
        "sine coefficients of harmonics 1, 2, ...", "N/(um mm)", [1.203, 0.0]
    )


class TrapezoidStiffness(Table):
    """Mesh stiffness as a trapezoid over the mesh period (Pan 2021, eqs 15-18)."""

    shape: Literal["trapezoid"] = key(_SHAPE, example="fourier")
    harmonics: int = key("number of harmonics kept of the trapezoid", default=6, ge=1, le=1000)


class Mesh(Table):
    """Stiffness, damping and clearance of the mesh."""

    mean_stiffness_N_per_um_mm: float | None = _optional(
        "mean mesh stiffness per unit face width", "N/(um mm)", 13.3548, gt=0
    )
    length_scale_um: float | None = _optional(
        "length of one unit of displacement, else the half backlash", "um", 50.0, gt=0
    )
    half_backlash_um: float | None = _optional(
        "half the backlash, b_n of Pan 2021: b_n cos(beta_b) along the transverse line of action",
        "um",
        50.0,
        ge=0,
    )
    circumferential_backlash_um: float | None = _optional(
        "circumferential backlash j_t at the reference circle, instead of half_backlash_um",
        "um",
        100.0,
        ge=0,
    )
    normal_backlash_um: float | None = _optional(
        "normal backlash j_bn, instead of half_backlash_um", "um", 90.0, ge=0
    )
    damping_ratio: float | None = _optional("mesh damping ratio", "1", 0.1, ge=0)
    damping_N_s_per_m: float | None = _optional(
        "mesh damping, instead of damping_ratio", "N s/m", 247.0, ge=0
    )
    damping_acts: Literal["always", "in_contact"] = key(default="always")
    """whether the damper of the mesh acts always, as in Pan 2021, or only while teeth touch"""
    friction_coefficient: float | None = _optional(
        "coefficient of friction between the teeth", "1", 0.06, ge=0, lt=1
    )
    stiffness: (
        Annotated[
            FourierStiffness | TrapezoidStiffness | StiffnessTable, Field(discriminator="shape")
        ]
        | None
    ) = _optional("variation of the mesh stiffness over the mesh period")


class SineError(Table):
    """One pitch error e(t), a sine at mesh frequency (Pan 2021, eq. 14)."""

    kind: Literal["sine"] = key(_KIND, default="sine")
    amplitude_um: float | None = _optional("amplitude of the pitch error", "um", 11.0)
    mean_um: float = _mean()
    phase_deg: float = key("phase of the pitch error", "degree", 0.0, default=0.0)


class GearDeviations(Table):
    """Pitch deviations of one gear as they were measured: a list, or a column of a file."""

    cumulative_um: Numbers | None = _optional("cumulative deviations of all teeth", "um")
    single_um: Numbers | None = _optional("single deviations: each from the tooth before it", "um")
    file: str | None = _optional("CSV file instead of a list, relative to the configuration")
    column: str | None = _optional("heading of the column to take", example="Fp")
    tooth_column: str | None = _optional(
        "heading of the tooth numbers, by default a column such as tooth, Zahn or No", example="No"
    )
    holds: Literal["cumulative", "single"] = key("content of the column", default="cumulative")
    counted: Literal["with_rotation", "against_rotation"] = key(default="with_rotation")
    """direction in which teeth are counted and deviations positive"""
    flank: Literal["right", "left"] | None = _optional("flank that was measured, for the record")


class TeethError(Table):
    """The pitch deviations of either gear or both, tooth by tooth."""

    kind: Literal["teeth"] = key(_KIND)
    mean_um: float = _mean()
    smoothing: float = _smoothing()
    driving: GearDeviations | None = _optional("deviations of the driving gear")
    driven: GearDeviations | None = _optional("deviations of the driven gear")


class GradeError(Table):
    """Pitch deviations of gears drawn at random that just pass an accuracy grade of ISO 1328-1."""

    kind: Literal["grade"] = key(_KIND)
    mean_um: float = _mean()
    smoothing: float = _smoothing()
    grade: float = key("accuracy grade of both gears", "1", 7, ge=0, le=12, multiple_of=1)
    edition: Literal[1995, 2013] = key("edition of ISO 1328-1", default=1995)
    seed: int = key("seed of the drawn gears", default=0, ge=0, le=2**32 - 1)
    realisations: int = key("number of drawn gear pairs", default=1, ge=1, le=1_000_000)
    first_realisation: int = key("number of the first of them", default=0, ge=0, le=2**32 - 1)
    eccentricity: float = key("share of an eccentricity", "1", default=0.5, ge=0, le=1)


PitchError: TypeAlias = Annotated[
    SineError | TeethError | GradeError,
    Field(discriminator="kind"),
    BeforeValidator(lambda given: {"kind": "sine", **given} if isinstance(given, dict) else given),
]
"""``[pitch_error]``; without a kind it is a sine."""


class Bearings(Table):
    """The bearings; pairs of values are [driving, driven]."""

    transverse_stiffness_N_per_m: NotNegativePair | None = _optional(
        "transverse stiffness [driving, driven]", "N/m", [1e9, 5e8]
    )
    transverse_damping_N_s_per_m: NotNegativePair | None = _optional(
        "transverse damping [driving, driven]", "N s/m", [500.0, 500.0]
    )
    axial_stiffness_N_per_m: NotNegativePair | None = _optional(
        "axial stiffness [driving, driven]", "N/m", [1e9, 5e8]
    )
    axial_damping_N_s_per_m: NotNegativePair | None = _optional(
        "axial damping [driving, driven]", "N s/m", [500.0, 500.0]
    )
