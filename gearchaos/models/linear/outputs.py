"""Outputs of a machine, named after its coordinates and its clearance elements."""

from gearchaos.models.linear.machine import Kinds
from gearchaos.outputs import catalogue
from gearchaos.outputs.entries import (
    LANE_AXES,
    Kind,
    Output,
    Part,
    Subject,
    motion_of,
    rearranged,
)
from gearchaos.outputs.listing import Catalogue
from gearchaos.outputs.names import TIME

FORCE, GAP = "force_", "gap_"
"""Beginnings of the names of forces and gaps; the name of an element follows."""

FORCES_PART = Part(
    "with loads, for each element",
    (
        Output("force_largest_@", "largest force, @"),
        Output("force_smallest_@", "smallest force, @"),
        Output("force_mean_@", "mean force, @"),
        Output("force_rms_@", "root mean square of the force, @"),
        Output("gap_mean_@", "mean gap, @"),
        Output("gap_peak_to_peak_@", "gap, peak to peak, @"),
        Output("gap_rms_@", "root mean square of the gap about its mean, @"),
    ),
    repeated_for=(Kind.ELEMENT,),
)
FORCES_IN_TIME_PART = Part(
    "in a response, for each element",
    (
        Output(f"{FORCE}@", "force, @", "@", dims=(LANE_AXES, TIME)),
        *catalogue.CONTACT_IN_TIME_PART.outputs,
    ),
    repeated_for=(Kind.ELEMENT,),
    in_time=True,
)


def catalogue_of(kinds: Kinds) -> Catalogue:
    """Return the outputs of machines with these coordinates and elements."""
    motions = [motion_of(name, symbol_of(name), f"{{}} {name}") for name in kinds.coordinates]
    elements = tuple(
        Subject(name, name.replace("_", " "), rf"$F_{{\mathrm{{{_plain(name)}}}}}$")
        for name in kinds.elements
    )
    return Catalogue(
        parts=rearranged(
            catalogue.PARTS,
            {
                catalogue.CONTACT_PART: (catalogue.CONTACT_PART, FORCES_PART),
                catalogue.CONTACT_IN_TIME_PART: (FORCES_IN_TIME_PART,),
            },
        ),
        subjects={
            Kind.STATE: tuple(one for motion in motions for one in motion[:2]),
            Kind.ACCELERATION: tuple(motion[2] for motion in motions),
            Kind.ELEMENT: elements,
            Kind.SIGNAL: tuple(
                Subject(f"{GAP}{one.name}", f"gap, {one.long_name}") for one in elements
            ),
        },
    )


def symbol_of(name: str) -> str:
    """Return the TeX symbol of a coordinate: its first letter, with the rest as an index."""
    first, rest = name[0], name[1:].strip("_")
    return rf"{first}_{{\mathrm{{{_plain(rest)}}}}}" if rest else first


def _plain(text: str) -> str:
    """Return a name as TeX text."""
    return text.replace("_", r"\ ")
