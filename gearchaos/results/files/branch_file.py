"""The file of the branches of a sweep: one HDF5 file that is also netCDF-4."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gearchaos.arrays import Array, Floats
from gearchaos.outputs.names import SECTION, SECTION_POINT, STATE
from gearchaos.outputs.variable import Variable
from gearchaos.records.branch import BRANCH_ENDS, SPECIAL_KINDS, PeriodicBranch, SpecialPoint
from gearchaos.results.files.result_file import (
    CONVENTIONS,
    create_all,
    new_file,
    write_metadata,
)

SCHEMA, SCHEMA_VERSION = "gearchaos-branches", "1.0"

POINT, BRANCH, SPECIAL = "point", "branch", "special_point"
"""Dimensions of the file."""

OF_SPECIAL = "special_"
"""Beginning of the names of the variables of special points."""

FLANKS = "flanks"
"""Attribute with the flanks that the numbers of ``special_flank`` mean."""


class BranchSet(NamedTuple):
    """The branches of a sweep, and how their numbers are worded.

    Attributes
    ----------
    parameter : Variable
        Description of the swept parameter.
    states : tuple of Variable
        Description of the section of each state.
    branches : tuple of PeriodicBranch
        The branches.
    metadata : dict of str to str, int or float
        Title, configuration and provenance.
    quantities : tuple of Variable
        Description of the contact and the loads of the orbits.
    """

    parameter: Variable
    states: tuple[Variable, ...]
    branches: tuple[PeriodicBranch, ...]
    metadata: dict[str, str | int | float]
    quantities: tuple[Variable, ...] = ()

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states in the order of the arrays."""
        return tuple(variable.name.removeprefix(SECTION) for variable in self.states)


def write_branches(path: str | os.PathLike[str], found: BranchSet, overwrite: bool = False) -> None:
    """Write branches to a file, which appears complete or not at all.

    Parameters
    ----------
    path : path-like
        Name of the file.
    found : BranchSet
        The branches.
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
        "parameter": found.parameter.name,
        FLANKS: "\n".join(_flanks(found)),
    }
    with new_file(path, overwrite=overwrite) as (file, _):
        write_metadata(file, facts)
        create_all(file, _variables(found), {})


def _flanks(found: BranchSet) -> list[str]:
    """Return the flanks that special points name, each once."""
    return sorted({one.flank for branch in found.branches for one in branch.specials if one.flank})


def _variables(found: BranchSet) -> list[Variable]:
    """Return all variables of the file with their values."""
    specials = [(at, one) for at, branch in enumerate(found.branches) for one in branch.specials]
    points = sum(branch.value.size for branch in found.branches)
    periods = max((branch.period for branch in found.branches), default=1)
    lengths = {POINT: points, SPECIAL: len(specials), BRANCH: len(found.branches)}
    counts = [
        whole_numbers(dim, (dim,), np.arange(size), f"number of the {dim.replace('_', ' ')}")
        for dim, size in {**lengths, SECTION_POINT: periods}.items()
    ]
    states = Variable(
        STATE,
        (STATE,),
        "int32",
        "1",
        "state",
        flags=found.state_names,
        values=np.arange(len(found.states)),
    )
    return [
        *counts,
        states,
        *_of_branches(found),
        *_of_points(found, periods),
        *_of_specials(found, [one for _, one in specials], [at for at, _ in specials], periods),
    ]


def whole_numbers(
    name: str, dims: tuple[str, ...], values: Any, long_name: str, flags: tuple[str, ...] = ()
) -> Variable:
    """Return a variable of whole numbers."""
    flags = tuple(flag.replace(" ", "_") for flag in flags)
    return Variable(name, dims, "int32", "1", long_name, flags=flags, values=np.asarray(values))


def real_numbers(name: str, dims: tuple[str, ...], values: Any, long_name: str) -> Variable:
    """Return a variable of dimensionless numbers."""
    return Variable(
        name, dims, "float64", "1", long_name, fill_value=np.nan, values=np.asarray(values)
    )


def _of_branches(found: BranchSet) -> list[Variable]:
    """Return the variables of whole branches."""
    ends = np.array([[BRANCH_ENDS.index(end) for end in one.ends] for one in found.branches])
    first, last = ends.reshape(-1, 2).T
    periods = [one.period for one in found.branches]
    return [
        whole_numbers("period", (BRANCH,), periods, "period in excitation periods"),
        whole_numbers(
            "first_end", (BRANCH,), first, "why the branch ends at its first point", BRANCH_ENDS
        ),
        whole_numbers(
            "last_end", (BRANCH,), last, "why the branch ends at its last point", BRANCH_ENDS
        ),
    ]


def joined(arrays: Iterable[Array], *sizes: int) -> Array:
    """Join arrays along their first axis; ``sizes`` of the others are those of an empty result."""
    return np.concatenate([np.zeros((0, *sizes)), *arrays])


def _of_points(found: BranchSet, periods: int) -> list[Variable]:
    """Return the variables of the points of all branches; ``periods``: the longest period."""
    branches, states = found.branches, len(found.states)
    numbers = np.repeat(np.arange(len(branches)), [one.value.size for one in branches])
    multipliers = joined([one.multipliers for one in branches], states)
    sections = joined([padded(one.section, periods) for one in branches], periods, states)
    listed = [
        replace(found.parameter, dims=(POINT,), values=joined(one.value for one in branches)),
        whole_numbers("branch_of_point", (POINT,), numbers, "number of the branch of a point"),
        real_numbers("arclength", (POINT,), joined(one.arclength for one in branches), "arclength"),
        whole_numbers(
            "stable", (POINT,), joined(one.stable for one in branches), "whether it is stable"
        ),
        real_numbers(
            "lyapunov_exponent",
            (POINT,),
            joined(one.exponent for one in branches),
            "largest Lyapunov exponent of the orbit",
        ),
        *complex_parts("multiplier", (POINT, STATE), multipliers, "Floquet multiplier"),
        *sections_of(found.states, "", POINT, sections),
    ]
    for variable in found.quantities:
        values = joined(one.quantities[variable.name] for one in branches)
        listed.append(
            replace(
                variable,
                dims=(POINT,),
                dtype="float64",
                flags=(),
                values=values,
                fill_value=np.nan,
                errors=(),
            )
        )
    return listed


def _of_specials(
    found: BranchSet, specials: Sequence[SpecialPoint], numbers: Sequence[int], periods: int
) -> list[Variable]:
    """Return the variables of the special points; ``numbers``: their branches."""
    states, flanks = len(found.states), ["", *_flanks(found)]
    kinds = [SPECIAL_KINDS.index(one.kind) for one in specials]
    multipliers = joined([one.multipliers[np.newaxis] for one in specials], states)
    sections = joined(
        [padded(one.section[np.newaxis], periods) for one in specials], periods, states
    )
    values = np.array([one.value for one in specials])
    name, dims = OF_SPECIAL + found.parameter.name, (SPECIAL,)
    return [
        whole_numbers(f"{OF_SPECIAL}kind", dims, kinds, "kind of the special point", SPECIAL_KINDS),
        replace(found.parameter, name=name, dims=dims, values=values),
        whole_numbers(
            f"{OF_SPECIAL}branch", dims, numbers, "number of the branch of a special point"
        ),
        real_numbers(
            f"{OF_SPECIAL}arclength",
            dims,
            [one.arclength for one in specials],
            "arclength of a special point on its branch",
        ),
        whole_numbers(
            f"{OF_SPECIAL}flank",
            dims,
            [flanks.index(one.flank) for one in specials],
            f"flank that grazes: line of the attribute {FLANKS}, 0 for none",
        ),
        *complex_parts(
            f"{OF_SPECIAL}multiplier", (SPECIAL, STATE), multipliers, "Floquet multiplier"
        ),
        *sections_of(found.states, OF_SPECIAL, SPECIAL, sections),
    ]


def padded(section: Floats, periods: int) -> Floats:
    """Fill a section (points, period, states) with NaN up to a number of periods."""
    more = periods - section.shape[1]
    return np.pad(section, ((0, 0), (0, more), (0, 0)), constant_values=np.nan)


def complex_parts(
    name: str, dims: tuple[str, ...], values: Array, long_name: str
) -> list[Variable]:
    """Return the real and the imaginary part of complex numbers as two variables."""
    parts = {"real": np.real(values), "imaginary": np.imag(values)}
    return [
        real_numbers(f"{name}_{part}", dims, array, f"{part} part of the {long_name}")
        for part, array in parts.items()
    ]


def sections_of(
    states: tuple[Variable, ...], start: str, dim: str, sections: Floats
) -> list[Variable]:
    """Return one variable for each state of sections (points, periods, states)."""
    return [
        replace(
            variable,
            name=start + variable.name,
            dims=(dim, SECTION_POINT),
            errors=(),
            values=sections[..., number],
        )
        for number, variable in enumerate(states)
    ]
