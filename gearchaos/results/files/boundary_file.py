"""The file of the boundaries of a map: one HDF5 file that is also netCDF-4."""

import os
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gearchaos.outputs.names import SECTION, SECTION_POINT, STATE
from gearchaos.outputs.variable import Variable
from gearchaos.records.boundary import BOUNDARY_ENDS, BOUNDARY_KINDS, POINT_KINDS, Boundary
from gearchaos.results.files.branch_file import (
    complex_parts,
    joined,
    padded,
    real_numbers,
    sections_of,
    whole_numbers,
)
from gearchaos.results.files.result_file import (
    CONVENTIONS,
    create_all,
    new_file,
    write_metadata,
)

SCHEMA, SCHEMA_VERSION = "gearchaos-boundaries", "1.0"

POINT, BOUNDARY, SPECIAL = "point", "boundary", "codimension_2_point"
"""Dimensions of the file."""

OF_SPECIAL = "codimension_2_"
"""Beginning of the names of the variables of points of codimension 2."""

PARAMETERS, FLANKS = "parameters", "flanks"
"""Attributes with the names of both parameters, and with the flanks that numbers mean."""


class BoundarySet(NamedTuple):
    """The boundaries of a map, and how their numbers are worded.

    Attributes
    ----------
    parameters : tuple of Variable
        Descriptions of the two swept parameters.
    states : tuple of Variable
        Description of the section of each state.
    boundaries : tuple of Boundary
        The boundaries.
    metadata : dict of str to str, int or float
        Title, configuration and provenance.
    """

    parameters: tuple[Variable, ...]
    states: tuple[Variable, ...]
    boundaries: tuple[Boundary, ...]
    metadata: dict[str, str | int | float]


def write_boundaries(
    path: str | os.PathLike[str], found: BoundarySet, overwrite: bool = False
) -> None:
    """Write boundaries to a file, which appears complete or not at all.

    Parameters
    ----------
    path : path-like
        Name of the file.
    found : BoundarySet
        The boundaries.
    overwrite : bool
        Whether an existing file is replaced.

    Raises
    ------
    FileError
        If the file cannot be written, or exists and is not to be replaced.
    """
    facts = {
        **found.metadata,
        "Conventions": CONVENTIONS,
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        PARAMETERS: " ".join(one.name for one in found.parameters),
        FLANKS: "\n".join(_flanks(found)),
    }
    with new_file(path, overwrite=overwrite) as (file, _):
        write_metadata(file, facts)
        create_all(file, _variables(found), {})


def _flanks(found: BoundarySet) -> list[str]:
    """Return the flanks that boundaries name, each once."""
    return sorted({one.flank for one in found.boundaries if one.flank})


def _variables(found: BoundarySet) -> list[Variable]:
    """Return all variables of the file with their values."""
    boundaries = found.boundaries
    periods = max((one.period for one in boundaries), default=1)
    lengths = {
        POINT: sum(one.arclength.size for one in boundaries),
        SPECIAL: sum(len(one.points) for one in boundaries),
        BOUNDARY: len(boundaries),
        SECTION_POINT: periods,
    }
    counts = [
        whole_numbers(dim, (dim,), np.arange(size), f"number of the {dim.replace('_', ' ')}")
        for dim, size in lengths.items()
    ]
    names = tuple(variable.name.removeprefix(SECTION) for variable in found.states)
    numbers = np.arange(len(names))
    states = Variable(STATE, (STATE,), "int32", "1", "state", flags=names, values=numbers)
    return [
        *counts,
        states,
        *_of_boundaries(found),
        *_of_points(found, periods),
        *_of_specials(found),
    ]


def _of_boundaries(found: BoundarySet) -> list[Variable]:
    """Return the variables of whole boundaries."""
    boundaries, dims, flanks = found.boundaries, (BOUNDARY,), ["", *_flanks(found)]
    ends = np.array([[BOUNDARY_ENDS.index(end) for end in one.ends] for one in boundaries])
    first, last = ends.reshape(-1, 2).T
    kinds = [BOUNDARY_KINDS.index(one.kind) for one in boundaries]
    periods = [one.period for one in boundaries]
    numbers = [flanks.index(one.flank) for one in boundaries]
    text = f"flank that grazes: line of the attribute {FLANKS}, 0 for none"
    why = "why the boundary ends at its"
    return [
        whole_numbers("kind", dims, kinds, "kind of the boundary", BOUNDARY_KINDS),
        whole_numbers("period", dims, periods, "period in excitation periods"),
        whole_numbers("flank", dims, numbers, text),
        whole_numbers("first_end", dims, first, f"{why} first point", BOUNDARY_ENDS),
        whole_numbers("last_end", dims, last, f"{why} last point", BOUNDARY_ENDS),
    ]


def _of_points(found: BoundarySet, periods: int) -> list[Variable]:
    """Return the variables of the points of all boundaries; ``periods``: the longest period."""
    boundaries, states = found.boundaries, len(found.states)
    numbers = np.repeat(np.arange(len(boundaries)), [one.arclength.size for one in boundaries])
    values = joined([one.values for one in boundaries], 2)
    multipliers = joined([one.multipliers for one in boundaries], states)
    sections = joined([padded(one.section, periods) for one in boundaries], periods, states)
    lengths = joined(one.arclength for one in boundaries)
    return [
        *(
            replace(one, dims=(POINT,), values=values[:, number])
            for number, one in enumerate(found.parameters)
        ),
        whole_numbers("boundary_of_point", (POINT,), numbers, "number of the boundary of a point"),
        real_numbers("arclength", (POINT,), lengths, "arclength"),
        *complex_parts("multiplier", (POINT, STATE), multipliers, "Floquet multiplier"),
        *sections_of(found.states, "", POINT, sections),
    ]


def _of_specials(found: BoundarySet) -> list[Variable]:
    """Return the variables of the points of codimension 2."""
    listed = [(at, one) for at, each in enumerate(found.boundaries) for one in each.points]
    points = [one for _, one in listed]
    kinds = [POINT_KINDS.index(one.kind) for one in points]
    values = joined([one.values[np.newaxis] for one in points], 2)
    multipliers = joined([one.multipliers[np.newaxis] for one in points], len(found.states))
    dims, start = (SPECIAL,), OF_SPECIAL
    lengths = [one.arclength for one in points]
    return [
        whole_numbers(f"{start}kind", dims, kinds, "kind of the point", POINT_KINDS),
        *(
            replace(one, name=start + one.name, dims=dims, values=values[:, number])
            for number, one in enumerate(found.parameters)
        ),
        whole_numbers(
            f"{start}boundary", dims, [at for at, _ in listed], "number of the boundary of a point"
        ),
        real_numbers(f"{start}arclength", dims, lengths, "arclength of a point on its boundary"),
        *complex_parts(f"{start}multiplier", (SPECIAL, STATE), multipliers, "Floquet multiplier"),
    ]
