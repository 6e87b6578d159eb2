"""Reading a file of boundaries; any other file is refused with one sentence."""

import os
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from gearchaos.arrays import Array
from gearchaos.outputs.names import SECTION, STATE
from gearchaos.records.boundary import (
    BOUNDARY_ENDS,
    BOUNDARY_KINDS,
    POINT_KINDS,
    Boundary,
    BoundaryPoint,
)
from gearchaos.results.files import stored_dataset as stored
from gearchaos.results.files.boundary_file import (
    FLANKS,
    OF_SPECIAL,
    PARAMETERS,
    SCHEMA,
    SCHEMA_VERSION,
    BoundarySet,
)
from gearchaos.results.files.branch_reader import (
    FileKind,
    described_as,
    read_kind,
    schema_of,
    section_in,
)


def is_boundary_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file says of itself that it holds boundaries."""
    return schema_of(path) == SCHEMA


def read_boundaries(path: str | os.PathLike[str]) -> BoundarySet:
    """Read a file of boundaries.

    Parameters
    ----------
    path : path-like
        Name of the file.

    Returns
    -------
    BoundarySet
        The boundaries.

    Raises
    ------
    FileError
        If the file is missing or damaged, if it holds no boundaries, or if its format has another
        major version.
    """
    kind = FileKind("boundaries", "gearchaos boundaries", SCHEMA, SCHEMA_VERSION)
    return read_kind(path, kind, _read)


def _read(datasets: Mapping[str, h5py.Dataset], metadata: dict[str, Any]) -> BoundarySet:
    """Return the boundaries of a file that is open."""
    texts = {name: stored.text_of(one) for name, one in datasets.items()}
    metadata = metadata | {name: text for name, text in texts.items() if text is not None}
    arrays = {
        name: stored.values_of(name, one) for name, one in datasets.items() if texts[name] is None
    }
    notes = {name: stored.scalars_of(datasets[name]) for name in arrays}
    described = {name: described_as(name, datasets[name], notes[name], metadata) for name in arrays}
    names = str(metadata[PARAMETERS]).split()
    states = str(notes[STATE]["flag_meanings"]).split()
    boundaries = tuple(
        _boundary(arrays, metadata, (names, states), number)
        for number in range(arrays["period"].size)
    )
    sections = tuple(described[SECTION + state] for state in states)
    return BoundarySet(tuple(described[one] for one in names), sections, boundaries, metadata)


def _boundary(
    arrays: Mapping[str, Array],
    metadata: Mapping[str, Any],
    names: tuple[list[str], list[str]],
    number: int,
) -> Boundary:
    """Return a boundary by its number; ``names``: of the parameters, and of the states."""
    parameters, states = names
    flanks = ["", *str(metadata.get(FLANKS, "")).split("\n")]
    chosen = arrays["boundary_of_point"] == number
    period = int(arrays["period"][number])
    of_points = arrays[f"{OF_SPECIAL}boundary"]
    multipliers, special = (
        arrays[f"{start}multiplier_real"] + 1j * arrays[f"{start}multiplier_imaginary"]
        for start in ("", OF_SPECIAL)
    )
    values, places = (
        np.stack([arrays[start + name] for name in parameters], axis=1)
        for start in ("", OF_SPECIAL)
    )
    ends = [BOUNDARY_ENDS[arrays[f"{end}_end"][number]] for end in ("first", "last")]
    return Boundary(
        BOUNDARY_KINDS[arrays["kind"][number]],
        period,
        flanks[arrays["flank"][number]],
        values[chosen],
        arrays["arclength"][chosen],
        section_in(arrays, "", states, chosen, period),
        multipliers[chosen],
        tuple(
            BoundaryPoint(
                POINT_KINDS[arrays[f"{OF_SPECIAL}kind"][at]],
                places[at],
                float(arrays[f"{OF_SPECIAL}arclength"][at]),
                special[at],
            )
            for at in (of_points == number).nonzero()[0]
        ),
        (ends[0], ends[1]),
    )
