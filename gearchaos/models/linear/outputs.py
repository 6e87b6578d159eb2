"""Outputs of a machine, named after its coordinates and its clearance elements."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from gearchaos.models.linear.machine import Kinds
from gearchaos.outputs import catalogue
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
from gearchaos.outputs.names import TIME
from gearchaos.outputs.scales import Quantity

FORCE, GAP = "force_", "gap_"
"""Beginnings of the names of forces and gaps; the name of an element follows."""

FORCES_PART = Part(
    "with loads, for each element",
    (
        Output("force_largest_@", "largest force, @", scale=Quantity.FORCE),
        Output("force_smallest_@", "smallest force, @", scale=Quantity.FORCE),
        Output("force_mean_@", "mean force, @", scale=Quantity.FORCE),
        Output("force_rms_@", "root mean square of the force, @", scale=Quantity.FORCE),
        Output("gap_mean_@", "mean gap, @", scale=Quantity.LENGTH),
        Output("gap_peak_to_peak_@", "gap, peak to peak, @", scale=Quantity.LENGTH),
        Output("gap_rms_@", "root mean square of the gap about its mean, @", scale=Quantity.LENGTH),
    ),
    repeated_for=(Kind.ELEMENT,),
)
FORCES_IN_TIME_PART = Part(
    "in a response, for each element",
    (
        Output(f"{FORCE}@", "force, @", "@", dims=(LANE_AXES, TIME), scale=Quantity.FORCE),
        *catalogue.CONTACT_IN_TIME_PART.outputs,
    ),
    repeated_for=(Kind.ELEMENT,),
    in_time=True,
)

TERMS = MappingProxyType(
    {
        "mesh period": "excitation period",
        "mesh frequency": "excitation frequency",
        "driving flank": "upper side",
        "back flank": "lower side",
    }
)
"""Terms of a machine without gears: an element pushes where its gap is above or below its range."""


def catalogue_of(
    kinds: Kinds,
    units: Mapping[Quantity, str],
    angle: str = "",
    terms: Mapping[str, str] = MappingProxyType({}),
) -> Catalogue:
    """Return the outputs of machines with these coordinates and elements.

    ``units``: of each quantity, none for pure numbers; ``angle``: end of the names of coordinates
    that are angles; ``terms``: in place of those of gears.
    """
    motions = [_motion(name, bool(angle) and name.endswith(angle)) for name in kinds.coordinates]
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
                Subject(f"{GAP}{one.name}", f"gap, {one.long_name}", scale=Quantity.LENGTH)
                for one in elements
            ),
        },
        units=units,
        terms=terms,
    )


def _motion(name: str, is_angle: bool) -> tuple[Subject, Subject, Subject]:
    """Return displacement, velocity and acceleration of a coordinate as subjects."""
    subjects = motion_subjects(name, symbol_of(name), f"{{}} of {name.replace('_', ' ')}")
    if not is_angle:
        return subjects
    scales = (Quantity.ANGLE, Quantity.ANGULAR_SPEED, Quantity.ANGULAR_ACCELERATION)
    turned = [replace(one, scale=scale) for one, scale in zip(subjects, scales, strict=True)]
    return turned[0], turned[1], turned[2]


def symbol_of(name: str) -> str:
    """Return the TeX symbol of a coordinate: a letter with an index, such as x_1, or the name."""
    first, rest = name[0], name[1:].strip("_")
    if rest.isdecimal() or name[1:2] == "_":
        return rf"{first}_{{\mathrm{{{_plain(rest)}}}}}"
    return name if not rest else rf"\mathrm{{{_plain(name)}}}"


def _plain(text: str) -> str:
    """Return a name as TeX text."""
    return text.replace("_", r"\ ")
