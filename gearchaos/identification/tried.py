"""The computed candidates of a search, in memory and in a file."""

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
"""Candidates in the order of computation: an array with the fields of `fields_of`."""


def fields_of(problem: Problem) -> np.dtype[np.void]:
    """Return the fields of a candidate, all of type float64.

    Returns
    -------
    dtype
        ``run``: run number, see `search`; ``values`` (parameters,): parameters in their units;
        ``computed`` (observations,): computed observations, NaN where the candidate has none;
        ``misfit``; ``status``: 1 if a lane diverged, else 0.
    """
    counts = {"values": len(problem.targets.parameter), "computed": len(problem.observations)}
    names = ("run", "values", "computed", "misfit", STATUS)
    return np.dtype([(n, np.float64, (counts[n],) if n in counts else ()) for n in names])


def write_tried(
    path: str | os.PathLike[str], tried: Tried, problem: Problem, facts: Mapping[str, Any]
) -> None:
    """Write all candidates as CSV, complete or not at all; an existing file is replaced.

    Parameters
    ----------
    path : str or PathLike
        The file.
    tried : Tried
        The candidates. Each row has run, parameters, computed observations, misfit and status.
    problem : Problem
        The search problem.
    facts : mapping
        Facts to write with the targets, as JSON, into a comment in the first line.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    targets, observations = problem.targets, problem.observations
    keys = [one.name for one in targets.parameter]
    names = ["run", *keys, *(one.name for one in observations), "misfit", STATUS]
    rows, body = tried.view(np.float64).reshape(len(tried), -1), StringIO()
    np.savetxt(body, rows, "%.17g", ",", header=",".join(names), comments="")
    wanted = {one.name: {"wanted": one.wanted, "width": one.width} for one in observations}
    header = {**facts, "title": targets.title, "targets": problem.text, "observations": wanted}
    header["sha256"] = _checksum(body.getvalue())
    with replacing(path, overwrite=True) as partial:
        partial.write_text(f"# {json.dumps(header)}\n{body.getvalue()}", encoding="utf-8")


def read_tried(path: str | os.PathLike[str], problem: Problem) -> tuple[Tried, dict[str, Any]]:
    """Read the candidates of a file, and the facts in its first line.

    Parameters
    ----------
    path : str or PathLike
        A file from `write_tried`.
    problem : Problem
        The search problem, which determines the fields.

    Raises
    ------
    FileError
        If the file is missing, damaged or not from a search.
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
