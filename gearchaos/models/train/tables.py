"""The tables of a configuration that describe a gear train or a planetary set."""

# Keys end in the unit of their value.
# ruff: noqa: N815

from typing import Annotated, Literal, TypeAlias, get_args

from pydantic import Field

from gearchaos.configuration import run_tables
from gearchaos.configuration.keys import AS_LIST, Table, key
from gearchaos.configuration.run_tables import ONCE
from gearchaos.models.linear.tables import NAMED, Name
from gearchaos.models.stiffness_table import IN_N_PER_UM, StiffnessTable

Effect: TypeAlias = Literal[
    "stiffness_variation", "backlash", "transmission_error", "translation", "bearing_clearance"
]
EFFECTS: tuple[str, ...] = get_args(Effect)

Member: TypeAlias = Literal["sun", "ring", "carrier"]
MEMBERS: tuple[str, ...] = get_args(Member)


class Scene(run_tables.Scene):
    """Which effects exist; what is not listed is not computed."""

    effects: Annotated[tuple[Effect, ...], AS_LIST, ONCE] = key(
        "the effects that exist beside torsion and damping", default=EFFECTS
    )


class ModelTable(Table):
    """Which model the file describes."""

    kind: Literal["train"] = key("which model the file describes", default="train")


class Operation(Table):
    """How the train runs."""

    speed_rpm: float = key("speed of the input shaft", units="rpm", example=3000.0, gt=0, le=1e6)


class MeshStiffness(Table):
    """Stiffness, damping, backlash and error of a mesh, along its line of action."""

    stiffness_N_per_um: float | None = key(
        "mean mesh stiffness", units="N/um", example=400.0, default=None, gt=0
    )
    stiffness: StiffnessTable | None = key(default=None)
    """a table of the stiffness over the mesh period, instead of its mean and the contact ratio"""
    contact_ratio: float | None = key("contact ratio", example=1.6, default=None, ge=1, le=10)
    """mean number of tooth pairs in contact, to which the stiffness is in proportion; by default
    that of the gears if their modules are known, otherwise 1.6"""
    harmonics: int = key("harmonics of the stiffness that are kept", default=5, ge=1, le=40)
    damping_ratio: float = key("damping ratio of the mesh", default=0.05, ge=0, lt=1)
    damping_acts: Literal["always", "in_contact"] = key(default="always")
    """whether the mesh damper acts all the time, or only while teeth are in contact"""
    half_backlash_um: float = key("half backlash", units="um", default=0.0, ge=0, le=1e5)
    """half of the backlash along the line of action"""
    transmission_error_um: float = key("amplitude of the error", units="um", default=0.0)
    """amplitude of the unloaded transmission error, a sine once a mesh period"""
    phase_turns: float = key("mesh phase", units="1", default=0.0)
    """share of a mesh period by which this mesh is ahead"""

    @property
    def table_factor(self) -> float:
        """N/um per unit of the table of stiffness."""
        unit = None if self.stiffness is None else self.stiffness.unit
        return IN_N_PER_UM.get(unit or "", 1.0)

    @property
    def mean_stiffness(self) -> float:
        """Mean mesh stiffness in N/um."""
        if self.stiffness is not None:
            return self.table_factor * self.stiffness.series.mean
        return self.stiffness_N_per_um or 0.0

    @property
    def kept_harmonics(self) -> int:
        """Number of harmonics of the stiffness."""
        return self.harmonics if self.stiffness is None else self.stiffness.series.harmonics


class Shaft(Table):
    """A rigid shaft with its gears: one rotation, and two translations if it has a bearing."""

    inertia_kg_m2: float = key("moment of inertia", units="kg m2", example=0.002, gt=0)
    torque_Nm: float = key("external torque in the direction of rotation", units="N m", default=0.0)
    uniform: bool = key(default=False)
    """whether the shaft rotates uniformly under any load: the input shaft of a train"""
    mass_kg: float | None = key("mass", units="kg", default=None, gt=0)
    bearing_N_per_um: float | None = key("bearing stiffness", units="N/um", default=None, gt=0)
    """stiffness of the bearing in both directions; without it the shaft only rotates"""
    bearing_damping_ratio: float = key("damping ratio of the bearing", default=0.02, ge=0, lt=1)
    bearing_half_clearance_um: float = key("bearing clearance", units="um", default=0.0, ge=0)
    """half of the radial clearance of the bearing, in each of the two directions"""


class Gear(Table):
    """A gear of a shaft, by its base radius or by its normal module."""

    shaft: Name = key("name of the shaft", example="input")
    teeth: int = key("number of teeth", example=25, ge=4, le=10_000)
    base_radius_mm: float | None = key("base radius", units="mm", example=35.2, default=None, gt=0)
    normal_module_mm: float | None = key(
        "normal module instead of the base radius", units="mm", default=None, gt=0
    )
    normal_pressure_angle_deg: float = key(
        "normal pressure angle", units="deg", default=20.0, gt=0, lt=60
    )
    helix_angle_deg: float = key(
        "helix angle on the reference circle", units="deg", default=0.0, ge=0, lt=60
    )
    face_width_mm: float | None = key("face width", units="mm", default=None, gt=0)
    """face width, from which the overlap of helical gears follows; without it they have none"""
    profile_shift: float = key("profile shift coefficient", units="1", default=0.0)
    tip_diameter_mm: float | None = key(
        "diameter of the tip circle, by default for an addendum of one module",
        units="mm",
        default=None,
        gt=0,
    )


class Mesh(MeshStiffness):
    """A mesh of two gears; the first one drives."""

    gears: Annotated[tuple[Name, ...], AS_LIST, Field(min_length=2, max_length=2)] = key(
        "names of the driving and the driven gear", example=["pinion", "wheel"]
    )
    line_angle_deg: float = key("direction of the line of action", units="deg", default=90.0)
    """direction in which the driving tooth pushes, from the x axis"""
    centre_distance_mm: float | None = key(
        "centre distance of gears with a module, by default that without backlash",
        units="mm",
        default=None,
        gt=0,
    )


class MemberTable(Table):
    """Sun, ring or carrier of a planetary set."""

    mass_kg: float = key("mass", units="kg", example=0.4, gt=0)
    inertia_kg: float = key("inertia over the square of the base radius", units="kg", gt=0)
    bearing_N_per_um: float = key("bearing stiffness", units="N/um", example=100.0, gt=0)
    rotation_N_per_um: float = key("stiffness against rotation", units="N/um", default=0.0, ge=0)
    """stiffness against rotation of a fixed member, at its base circle; 0: it does not rotate"""


class Planet(Table):
    """The planets, all alike."""

    mass_kg: float = key("mass", units="kg", example=0.66, gt=0)
    inertia_kg: float = key("inertia over the square of the base radius", units="kg", gt=0)
    bearing_N_per_um: float = key("bearing stiffness", units="N/um", example=100.0, gt=0)


class Planetary(Table):
    """A planetary set with equally spaced planets (Lin and Parker 1999)."""

    planets: int = key("number of planets", example=3, ge=1, le=12)
    sun_teeth: int = key("number of teeth of the sun", example=27, ge=4)
    planet_teeth: int = key("number of teeth of a planet", example=35, ge=4)
    ring_teeth: int = key("number of teeth of the ring", example=99, ge=4)
    sun_base_radius_mm: float = key("base radius of the sun", units="mm", example=38.7, gt=0)
    pressure_angle_deg: float = key(
        "working pressure angle", units="deg", default=20.0, gt=0, lt=60
    )
    input: Member = key("the member that rotates uniformly", default="sun")
    fixed: Member = key("the member that does not rotate", default="ring")
    loaded: Member = key("the member that a torque holds back", default="carrier")
    torque_Nm: float = key("torque on the input member", units="N m", example=100.0)
    """a negative torque turns the set the other way"""
    damping_ratio: float = key("damping ratio of the bearings", default=0.02, ge=0, lt=1)
    """damping over critical damping of the bearings at their mean eigenfrequency"""
    sun: MemberTable = key("the sun")
    ring: MemberTable = key("the ring")
    carrier: MemberTable = key("the carrier")
    planet: Planet = key("the planets")
    sun_mesh: MeshStiffness = key("the meshes of the sun")
    ring_mesh: MeshStiffness = key("the meshes of the ring")


Shafts: TypeAlias = Annotated[dict[Name, Shaft], NAMED]
Gears: TypeAlias = Annotated[dict[Name, Gear], NAMED]
Meshes: TypeAlias = Annotated[dict[Name, Mesh], NAMED]
