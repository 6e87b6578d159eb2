"""Every candidate that was tried, in memory and in a file."""

import hashlib
import json
import os
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import FileError
from gearchaos.identification.loading import Problem
from gearchaos.outputs.names import STATUS
from gearchaos.results.files.atomic_file import reason, replacing

Tried: TypeAlias = NDArray[np.void]
"""Candidates, in the order in which they were tried: an array with the fields of `fields_of`."""


def fields_of(problem: Problem) -> np.dtype[np.void]:
    """Return the fields of a candidate, all of which are numbers.

    ``run``: see `search`; ``values`` (parameters,), in their units; ``computed`` (observations,):
    what was observed of it, NaN where there is no such thing; ``misfit``; ``status``: 1 where one
    of the lanes was not integrated to the end.
    """
    counts = {"values": len(problem.targets.parameter), "computed": len(problem.observations)}
    names = ("run", "values", "computed", "misfit", STATUS)
    return np.dtype([(n, np.float64, (counts[n],) if n in counts else ()) for n in names])


def write_tried(
    path: str | os.PathLike[str], tried: Tried, problem: Problem, facts: Mapping[str, Any]
) -> None:
    """Write all candidates as CSV; the file appears complete or not at all, and replaces another.

    A row per candidate: its run, the parameters by their keys, what was observed, misfit and
    status. The first line is a comment: the facts and the targets, as JSON. Raises FileError if it
    cannot be written.
    """
    targets, observations = problem.targets, problem.observations
    keys = [one.name for one in targets.parameter]
    names = ["run", *keys, *(one.name for one in observations), "misfit", STATUS]
    rows, body = tried.view(np.float64).reshape(len(tried), -1), StringIO()
    np.savetxt(body, rows, "%.17g", ",", header=",".join(names), comments="")
    wanted = {one.name: {"wanted": one.wanted, "width": one.width} for one in observations}
    told = {**facts, "title": targets.title, "targets": problem.text, "observations": wanted}
    told["sha256"] = _checksum(body.getvalue())
    with replacing(path, overwrite=True) as partial:
        partial.write_text(f"# {json.dumps(told)}\n{body.getvalue()}", encoding="utf-8")


def read_tried(path: str | os.PathLike[str], problem: Problem) -> tuple[Tried, dict[str, Any]]:
    """Read the candidates of a file, and the facts in its first line.

    Raises FileError if it is missing, damaged or no file of a search.
    """
    try:
        first, _, body = Path(path).read_text("utf-8").partition("\n")
        facts: dict[str, Any] = json.loads(first.removeprefix("# "))
        if facts["sha256"] != _checksum(body):
            raise ValueError("its checksum does not fit")
        rows = np.loadtxt(StringIO(body), delimiter=",", skiprows=1, ndmin=2)
        return rows.view(fields_of(problem))[:, 0], facts
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise FileError(
            f"{os.fspath(path)}: is damaged or no file of a search ({reason(error)}); choose "
            "another --output"
        ) from error


def _checksum(body: str) -> str:
    return hashlib.sha256(body.encode()).hexdigest()
