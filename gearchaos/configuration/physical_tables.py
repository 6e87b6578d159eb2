"""The tables that describe a gear pair in the terms of its drawing and its bearings."""

# The units are part of the keys, capitals and all.
# ruff: noqa: N815

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from gearchaos.configuration.keys import (
    NotNegativePair,
    Numbers,
    PositivePair,
    Table,
    TeethPair,
    key,
    keys_of,
)
from gearchaos.gear.geometry import STEEL_DENSITY
from gearchaos.gear.mesh_stiffness import DEFAULT_HARMONICS

_SHAPE = '"fourier" takes the coefficients, "trapezoid" takes rise, top, fall, bottom, half_height'


class Pair(Table):
    """Catalogue data of the two gears; pairs of values are [driving, driven]."""

    teeth: TeethPair = key("numbers of teeth [driving, driven]", example=[21, 38])
    normal_module_mm: float = key("normal module", units="mm", example=2.166, gt=0)
    normal_pressure_angle_deg: float = key(
        "normal pressure angle", units="degree", example=20.0, gt=0, lt=90
    )
    helix_angle_deg: float = key(
        "helix angle on the reference circle, either hand",
        units="degree",
        default=0.0,
        example=20.0,
        ge=0,
        lt=90,
    )
    face_width_mm: float = key("face width", units="mm", example=15.0, gt=0)
    density_kg_m3: float = key(
        "density of the gears, taken as solid discs on the reference circle",
        units="kg/m3",
        default=STEEL_DENSITY,
        example=STEEL_DENSITY,
        gt=0,
    )
    masses_kg: PositivePair | None = key(
        "masses [driving, driven] instead of those of solid discs",
        units="kg",
        default=None,
        example=[0.217, 0.71],
    )
    inertias_kg_m2: PositivePair | None = key(
        "moments of inertia [driving, driven] instead of those of solid discs",
        units="kg m2",
        default=None,
        example=[6.35e-5, 6.8e-4],
    )


class Operation(Table):
    """The point of operation."""

    speed_rpm: float | None = key(
        "speed of the driving gear", units="rev/min", default=None, example=2000.0, gt=0
    )
    torque_Nm: float | None = key(
        "torque on the driving gear", units="N m", default=None, example=50.0
    )


class FourierStiffness(Table):
    """Mesh stiffness as a Fourier series over the mesh period (Pan 2021, eq. 19)."""

    shape: Literal["fourier"] = key(_SHAPE)
    cosine_N_per_um_mm: Numbers = key(
        "cosine coefficients of harmonics 1, 2, ...",
        units="N/(um mm)",
        example=[-1.202, 0.0],
        min_length=1,
        max_length=1000,
    )
    sine_N_per_um_mm: Numbers = key(
        "sine coefficients of harmonics 1, 2, ...",
        units="N/(um mm)",
        example=[1.203, 0.0],
        min_length=1,
        max_length=1000,
    )


class TrapezoidStiffness(Table):
    """Mesh stiffness as a trapezoid over the mesh period (Pan 2021, eqs 15-18)."""

    shape: Literal["trapezoid"] = key(_SHAPE)
    rise: float | None = key(
        "rising share of the mesh period; no shares: from the contact ratio of [pair]",
        units="1",
        default=None,
        example=0.25,
        ge=0,
        le=1,
    )
    top: float | None = key(
        "share of the mesh period at the top", units="1", default=None, example=0.25, ge=0, le=1
    )
    fall: float | None = key(
        "falling share of the mesh period", units="1", default=None, example=0.25, ge=0, le=1
    )
    bottom: float | None = key(
        "share of the mesh period at the bottom", units="1", default=None, example=0.25, ge=0, le=1
    )
    half_height: float | None = key(
        "half the height of the trapezoid relative to the mean stiffness",
        units="1",
        default=None,
        example=0.111,
        ge=0,
        lt=1,
    )
    harmonics: int = key(
        "number of harmonics kept of the trapezoid", default=DEFAULT_HARMONICS, ge=1, le=1000
    )


Stiffness: TypeAlias = Annotated[
    FourierStiffness | TrapezoidStiffness, Field(discriminator="shape")
]


class Mesh(Table):
    """Stiffness, damping and clearance of the mesh."""

    mean_stiffness_N_per_um_mm: float | None = key(
        "mean mesh stiffness per unit face width",
        units="N/(um mm)",
        default=None,
        example=13.3548,
        gt=0,
    )
    length_scale_um: float | None = key(
        "length that one unit of displacement stands for; without it the half backlash",
        units="um",
        default=None,
        example=50.0,
        gt=0,
    )
    half_backlash_um: float | None = key(
        "half the backlash", units="um", default=None, example=50.0, ge=0
    )
    damping_ratio: float | None = key(
        "mesh damping ratio", units="1", default=None, example=0.1, ge=0
    )
    damping_N_s_per_m: float | None = key(
        "mesh damping, instead of damping_ratio", units="N s/m", default=None, example=247.0, ge=0
    )
    stiffness: Stiffness | None = key(
        "variation of the mesh stiffness over the mesh period", default=None
    )


class PitchError(Table):
    """One pitch error e(t), a sine at mesh frequency (Pan 2021, eq. 14)."""

    amplitude_um: float | None = key(
        "amplitude of the pitch error", units="um", default=None, example=11.0
    )
    mean_um: float = key("mean of the pitch error", units="um", default=0.0, example=0.0)
    phase_deg: float = key("phase of the pitch error", units="degree", default=0.0, example=0.0)


class Bearings(Table):
    """The bearings; pairs of values are [driving, driven]."""

    transverse_stiffness_N_per_m: NotNegativePair | None = key(
        "transverse stiffness [driving, driven]", units="N/m", default=None, example=[1e9, 5e8]
    )
    transverse_damping_N_s_per_m: NotNegativePair | None = key(
        "transverse damping [driving, driven]", units="N s/m", default=None, example=[500.0, 500.0]
    )
    axial_stiffness_N_per_m: NotNegativePair | None = key(
        "axial stiffness [driving, driven]", units="N/m", default=None, example=[1e9, 5e8]
    )
    axial_damping_N_s_per_m: NotNegativePair | None = key(
        "axial damping [driving, driven]", units="N s/m", default=None, example=[500.0, 500.0]
    )


PHYSICAL_TABLES: dict[str, type[Table]] = {
    "pair": Pair,
    "operation": Operation,
    "mesh": Mesh,
    "pitch_error": PitchError,
    "bearings": Bearings,
}
"""The physical tables by name."""

PHYSICAL_KEYS = {
    key.path: key
    for name, table in PHYSICAL_TABLES.items()
    for key in keys_of(table, name)
    if not key.tables
}
"""Every value of the physical tables by its path."""
