"""Every candidate that was tried, in memory and in a file."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import h5py
import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Array
from gearchaos.engine.lanes import axis_of
from gearchaos.errors import FileError
from gearchaos.identification.observations import Observation
from gearchaos.results.atomic_file import checksum_fits, reason
from gearchaos.results.result_file import write_result
from gearchaos.results.result_reader import SEARCH
from gearchaos.results.stored_dataset import UnfitError, datasets_of, scalars_of, text_of, values_of
from gearchaos.results.variables import STATUS, Variable, axis_name

CANDIDATE, OBSERVATION = "candidate", "observation"
MEANINGS = ("complete", "diverged")
"""Meanings of the status of a candidate: whether one of its lanes was not integrated to the end."""


Tried: TypeAlias = NDArray[np.void]
"""Candidates, in the order in which they were tried: an array with fields.

``run``: see `search`; ``values`` (parameters,), in their units; ``computed`` (observations,): what
was observed of them, NaN where there is no such thing; ``misfit``; ``status`` of `MEANINGS`.
"""


def tried_of(**fields: Array) -> Tried:
    """Put the fields of candidates together, the candidates first in each."""
    # One order, whoever gives them: NumPy joins no others.
    types = [(name, fields[name].dtype, fields[name].shape[1:]) for name in sorted(fields)]
    tried = np.empty(len(fields["run"]), types)
    for name, field in fields.items():
        tried[name] = field
    return tried


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

    def column(
        name: str, values: Array, text: str, *dims: str, units: str = "1", **more: Any
    ) -> Variable:
        return Variable(name, dims, str(values.dtype), units, text, values=values, **more)

    names = tuple("_".join(one.name.split()) for one in observations)
    numbers, candidates = (np.arange(size, dtype=np.int32) for size in (len(names), len(tried)))
    wanted, width = np.array([(one.wanted, one.width) for one in observations]).T
    which = "number of the observation, which its meaning names"
    what = "run of the search, 0 drawn evenly, -1 steps away from the best candidate"
    dims, row, axes = (CANDIDATE,), (OBSERVATION,), map(axis_of, keys, tried["values"].T)
    variables = [
        column(CANDIDATE, candidates, "number of the candidate", *dims),
        column(OBSERVATION, numbers, which, *row, flags=names),
        column("wanted", wanted, "observed number", *row),
        column("width", width, "unit of its misfit", *row),
        column("run", tried["run"], what, *dims),
        *(
            column(a.name, a.values, a.long_name, *dims, units=a.units, symbol=a.symbol)
            for a in axes
        ),
        column("computed", tried["computed"], "computed number", *dims, *row, fill_value=np.nan),
        column("misfit", tried["misfit"], "misfit of all observations together", *dims),
        column(STATUS, tried["status"], "status of the candidate", *dims, flags=MEANINGS),
    ]
    metadata = {**facts, "parameters_searched": " ".join(keys)}
    write_result(path, variables, [], {}, metadata, overwrite=True, schema=SEARCH)


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
            texts = {name: text_of(dataset) for name, dataset in datasets.items()}
            facts |= {name: text for name, text in texts.items() if text is not None}
            if facts.get("schema") != SEARCH or facts["parameters_searched"] != " ".join(keys):
                raise UnfitError("is no result of this search", "choose another --output")
            columns = [values_of(key, datasets[axis_name(key)]) for key in keys]
            others = ("run", "computed", "misfit", STATUS)
            fields = {name: values_of(name, datasets[name]) for name in others}
            return tried_of(**fields, values=np.stack(columns, axis=1)), facts
    except UnfitError as error:
        raise FileError(f"{name}: {error}") from error
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise FileError(
            f"{name}: cannot be read: {reason(error)}; choose another --output"
        ) from error
