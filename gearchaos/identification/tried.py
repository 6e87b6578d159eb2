"""Every candidate that was tried, in memory and in a file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from gearchaos.engine.lanes import axis_of
from gearchaos.errors import FileError
from gearchaos.identification.observations import Observation
from gearchaos.results.atomic_file import reason
from gearchaos.results.checksum_line import checksum_fits
from gearchaos.results.result_file import write_result
from gearchaos.results.result_reader import SEARCH
from gearchaos.results.stored_dataset import UnfitError, datasets_of, scalars_of, values_of
from gearchaos.results.variables import STATUS, Variable, axis_name

Floats = NDArray[np.float64]

CANDIDATE, OBSERVATION = "candidate", "observation"
MEANINGS = ("complete", "diverged")
"""Meanings of the status of a candidate: whether all of its lanes were integrated to the end."""


class Tried(NamedTuple):
    """Candidates, in the order in which they were tried.

    ``run`` (candidates,): see `search`; ``values`` (candidates, parameters), in their units;
    ``computed`` (candidates, observations): what was observed of them, NaN where there is no such
    thing; ``misfit`` (candidates,); ``status`` (candidates,) of `MEANINGS`.
    """

    run: NDArray[np.int32]
    values: Floats
    computed: Floats
    misfit: Floats
    status: NDArray[np.uint8]

    def __len__(self) -> int:
        return int(self.run.size)

    def part(self, first: int, last: int) -> Tried:
        """Return the candidates ``first`` to ``last - 1``."""
        arrays: Any = (array[first:last] for array in self)
        return Tried(*arrays)


def joined(parts: Sequence[Tried]) -> Tried:
    """Join candidates that were tried one after the other."""
    arrays: Any = (np.concatenate(some) for some in zip(*parts, strict=True))
    return Tried(*arrays)


def write_tried(
    path: str | os.PathLike[str],
    tried: Tried,
    keys: Sequence[str],
    observations: Sequence[Observation],
    facts: Mapping[str, Any],
) -> None:
    """Write all candidates; the file appears complete or not at all, and replaces an earlier one.

    ``keys`` are those of the parameters. Raises FileError if it cannot be written.
    """
    arrays: dict[str, NDArray[Any]] = {
        "run": tried.run,
        **{axis_name(key): tried.values[:, number] for number, key in enumerate(keys)},
        "computed": tried.computed,
        "misfit": tried.misfit,
        STATUS: tried.status,
    }
    variables = _variables(len(tried), keys, observations)
    metadata = {**facts, "parameters_searched": " ".join(keys)}
    blocks = [(0, len(tried), arrays)]
    write_result(path, variables, blocks, {}, metadata, overwrite=True, schema=SEARCH)


def _variables(
    count: int, keys: Sequence[str], observations: Sequence[Observation]
) -> list[Variable]:
    dims, row = (CANDIDATE,), (OBSERVATION,)
    names = tuple("_".join(one.name.split()) for one in observations)
    numbers = (np.arange(size, dtype=np.int32) for size in (count, len(names)))
    wanted, width = (
        np.array([getattr(one, name) for one in observations]) for name in ("wanted", "width")
    )
    what = "run of the search, 0 drawn evenly, -1 steps away from the best candidate"
    return [
        Variable(CANDIDATE, dims, "int32", "1", "number of the candidate", values=next(numbers)),
        Variable(
            *(OBSERVATION, row, "int32", "1", "number of the observation, which its meaning names"),
            flags=names,
            values=next(numbers),
        ),
        Variable("wanted", row, "float64", "1", "observed number", values=wanted),
        Variable("width", row, "float64", "1", "unit of its misfit", values=width),
        Variable("run", dims, "int32", "1", what),
        *map(_parameter, keys),
        Variable("computed", (*dims, *row), "float64", "1", "computed number", "", np.nan),
        Variable("misfit", dims, "float64", "1", "misfit of all observations together"),
        Variable(STATUS, dims, "uint8", "1", "status of the candidate", flags=MEANINGS),
    ]


def _parameter(key: str) -> Variable:
    axis = axis_of(key, np.zeros(0))
    wording = axis.units, axis.long_name, axis.symbol
    return Variable(axis.name, (CANDIDATE,), "float64", *wording)


def read_tried(path: str | os.PathLike[str], keys: Sequence[str]) -> tuple[Tried, dict[str, Any]]:
    """Read the candidates of a file, and what it says about itself.

    Raises FileError if it is missing, damaged or no file of a search over these parameters.
    """
    name = os.fspath(path)
    try:
        if not checksum_fits(Path(name)):
            raise UnfitError("is damaged or no result of a search", "choose another --output")
        with h5py.File(name, "r") as file:
            facts = scalars_of(file)
            datasets = datasets_of(file)
            text = {n: d for n, d in datasets.items() if d.dtype.kind in "OS"}
            facts |= {n: d[()].decode("utf-8", "replace") for n, d in text.items()}
            if facts.get("schema") != SEARCH or facts["parameters_searched"] != " ".join(keys):
                raise UnfitError("is no result of this search", "choose another --output")
            columns = [values_of(key, datasets[axis_name(key)]) for key in keys]
            rest = ("computed", "misfit", STATUS)
            found = (values_of(variable, datasets[variable]) for variable in rest)
            run = values_of("run", datasets["run"])
            return Tried(run, np.stack(columns, axis=1), *found), facts
    except UnfitError as error:
        raise FileError(f"{name}: {error}") from error
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise FileError(
            f"{name}: cannot be read: {reason(error)}; choose another --output"
        ) from error
