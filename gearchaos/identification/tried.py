"""Every candidate that was tried, in memory and in a file."""

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Array
from gearchaos.errors import FileError
from gearchaos.identification.observations import Observation
from gearchaos.results.atomic_file import reason, replacing
from gearchaos.results.variables import STATUS

Tried: TypeAlias = NDArray[np.void]
"""Candidates, in the order in which they were tried: an array with fields.

``run``: see `search`; ``values`` (parameters,), in their units; ``computed`` (observations,): what
was observed of them, NaN where there is no such thing; ``misfit``; ``status``: 1 where one of the
lanes was not integrated to the end.
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
    """Write all candidates as CSV; the file appears complete or not at all, and replaces another.

    A row per candidate: its run, the parameters by their ``keys``, what was observed, misfit and
    status. The first line is a comment: the facts, as JSON. Raises FileError if it cannot be
    written.
    """
    columns = {
        "run": tried["run"],
        **dict(zip(keys, tried["values"].T, strict=True)),
        **{one.name: row for one, row in zip(observations, tried["computed"].T, strict=True)},
        "misfit": tried["misfit"],
        STATUS: tried[STATUS],
    }
    rows, body = np.column_stack([*columns.values()]), StringIO()
    np.savetxt(body, rows, "%.17g", ",", header=",".join(columns), comments="")
    wanted = {one.name: {"wanted": one.wanted, "width": one.width} for one in observations}
    told = {**facts, "observations": wanted, "sha256": _checksum(body.getvalue())}
    with replacing(path, overwrite=True) as partial:
        partial.write_text(f"# {json.dumps(told)}\n{body.getvalue()}", encoding="utf-8")


def read_tried(path: str | os.PathLike[str], keys: Sequence[str]) -> tuple[Tried, dict[str, Any]]:
    """Read the candidates of a file, and the facts in its first line.

    Raises FileError if it is missing, damaged or no file of a search.
    """
    try:
        first, _, body = Path(path).read_text("utf-8").partition("\n")
        facts: dict[str, Any] = json.loads(first.removeprefix("# "))
        if facts["sha256"] != _checksum(body):
            raise ValueError("its checksum does not fit")
        rows = np.loadtxt(StringIO(body), delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise FileError(
            f"{os.fspath(path)}: is damaged or no file of a search ({reason(error)}); choose "
            "another --output"
        ) from error
    values, computed = np.split(rows[:, 1:-2], [len(keys)], axis=1)
    run, misfit, status = rows[:, 0].astype(np.int32), rows[:, -2], rows[:, -1].astype(np.uint8)
    return tried_of(run=run, values=values, computed=computed, misfit=misfit, status=status), facts


def _checksum(body: str) -> str:
    return hashlib.sha256(body.encode()).hexdigest()
