"""Outputs of the gear pair: its states, elements and signals, mesh forces and load factors."""

from gearchaos.models.gear_pair.derivation import FREQUENCY, LENGTH, SCALES, STIFFNESS
from gearchaos.outputs import catalogue, names
from gearchaos.outputs.entries import (
    LANE_AXES,
    Kind,
    Output,
    Part,
    Subject,
    motion_subjects,
    rearranged,
)
from gearchaos.outputs.listing import Catalogue
from gearchaos.outputs.scales import BaseScale, Quantity, scales_of

MESH_ERROR = "mesh_error"
MESH_FORCE = "mesh_force_"
"""Beginning of the names of mesh forces; the name of a direction follows."""
TRANSMISSION_ERROR = "transmission_error"

_COORDINATES = [
    motion_subjects("delta_5", r"\delta_5", "relative torsional {}"),
    motion_subjects("delta_1", r"\delta_1", "transverse {} of the driving gear"),
    motion_subjects("delta_2", r"\delta_2", "transverse {} of the driven gear"),
    motion_subjects("delta_3", r"\delta_3", "axial {} of the driving gear"),
    motion_subjects("delta_4", r"\delta_4", "axial {} of the driven gear"),
]
STATE_SUBJECTS = tuple(
    subject for displacement, rate, _ in _COORDINATES for subject in (displacement, rate)
)
"""All states in their order; a scene lacks those of the effects that it does not list."""
DEFAULT_VARIABLE = f"{names.SECTION}{STATE_SUBJECTS[0].name}"
"""The output that a diagram shows where none is chosen."""
ELEMENT_SUBJECTS = (
    Subject("tangential", "tangential", "$N_y$"),
    Subject("axial", "axial", "$N_z$"),
)
"""Directions in which the teeth have a clearance."""
DIRECTIONS = tuple(element.name for element in ELEMENT_SUBJECTS)

FORCES_PART = Part(
    "with loads, for each direction",
    (
        Output(f"{MESH_FORCE}largest_@", "largest mesh force, @", scale=Quantity.FORCE),
        Output(f"{MESH_FORCE}smallest_@", "smallest mesh force, @", scale=Quantity.FORCE),
        Output(f"{MESH_FORCE}mean_@", "mean mesh force, @", scale=Quantity.FORCE),
        Output(f"{MESH_FORCE}rms_@", "root mean square of the mesh force, @", scale=Quantity.FORCE),
    ),
    repeated_for=(Kind.ELEMENT,),
)
LOADS_PART = Part(
    "with loads",
    (
        Output("load_factor_largest", "largest tangential mesh force over the static one"),
        Output(
            "load_factor_rms", "root mean square of the tangential mesh force over the static one"
        ),
        Output(f"{TRANSMISSION_ERROR}_mean", "mean transmission error", scale=Quantity.LENGTH),
        Output(
            f"{TRANSMISSION_ERROR}_peak_to_peak",
            "transmission error, peak to peak",
            scale=Quantity.LENGTH,
        ),
        Output(
            f"{TRANSMISSION_ERROR}_rms",
            "root mean square of the transmission error about its mean",
            scale=Quantity.LENGTH,
        ),
    ),
)
MESH_IN_TIME_PART = Part(
    "in a response",
    (
        Output(
            MESH_ERROR,
            "pitch error of the mesh",
            "$e$",
            dims=(LANE_AXES, names.TIME),
            scale=Quantity.LENGTH,
        ),
        Output(
            TRANSMISSION_ERROR,
            "transmission error",
            r"$\delta_5 + e$",
            dims=(LANE_AXES, names.TIME),
            scale=Quantity.LENGTH,
        ),
    ),
    in_time=True,
)
FORCES_IN_TIME_PART = Part(
    "in a response, for each direction",
    (
        Output(
            f"{MESH_FORCE}@",
            "@ mesh force",
            "@",
            dims=(LANE_AXES, names.TIME),
            scale=Quantity.FORCE,
        ),
        *catalogue.CONTACT_IN_TIME_PART.outputs,
    ),
    repeated_for=(Kind.ELEMENT,),
    in_time=True,
)

CATALOGUE = Catalogue(
    parts=rearranged(
        catalogue.PARTS,
        {
            catalogue.CONTACT_PART: (catalogue.CONTACT_PART, FORCES_PART, LOADS_PART),
            catalogue.CONTACT_IN_TIME_PART: (MESH_IN_TIME_PART, FORCES_IN_TIME_PART),
        },
    ),
    subjects={
        Kind.STATE: STATE_SUBJECTS,
        Kind.ACCELERATION: tuple(acceleration for *_, acceleration in _COORDINATES),
        Kind.ELEMENT: ELEMENT_SUBJECTS,
        Kind.SIGNAL: (Subject(TRANSMISSION_ERROR, "transmission error", scale=Quantity.LENGTH),),
    },
    scales=scales_of(
        BaseScale(LENGTH, SCALES[LENGTH][2].strip("$")),
        BaseScale(FREQUENCY, SCALES[FREQUENCY][2].strip("$")),
        BaseScale(STIFFNESS, SCALES[STIFFNESS][2].strip("$")),
        "give [pair] and [mesh] with mean_stiffness_N_per_um_mm and length_scale_um",
    ),
    parameters={"mesh_frequency": Quantity.MESH_FREQUENCY},
    units={Quantity.TORQUE: "N m"},
    long_names={
        names.REALISATION: "drawn gear pair",
        "contact_@": "contact in the @ direction",
        names.CROSSINGS: (
            "clearance boundaries crossed per mesh period, tangential and axial together"
        ),
    },
)
"""All outputs of the gear pair."""
