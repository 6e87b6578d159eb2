"""Files that are drawn over the figure of a result; those of another sweep are refused."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gearchaos.configuration.toml_text import flat_tables
from gearchaos.errors import FigureError
from gearchaos.figures.lanes import map_axes
from gearchaos.outputs.names import CONVERTED, axis_name
from gearchaos.results.files.boundary_file import BoundarySet
from gearchaos.results.files.boundary_reader import read_boundaries
from gearchaos.results.files.branch_file import BranchSet
from gearchaos.results.files.branch_reader import read_branches
from gearchaos.results.reading.result import Result, section_variables

OF_THE_RUN = (
    *("title", "unusual", "start", "sweep", "second_sweep"),
    *("integration", "outputs", "control"),
)
"""Tables of a configuration that do not describe the machine."""


def branches_over(
    path: str | Path,
    results: Sequence[Result],
    source: str | Path,
    variable: str | None = None,
    units: str | None = None,
) -> BranchSet:
    """Read the branches of ``--branches`` for the diagram of results; ``source``: their file.

    Raises FigureError if branches and diagram do not belong together.
    """
    found, axis = read_branches(path), results[0].axis
    if variable is None and not any(map(section_variables, results)):
        raise FigureError(
            f"--branches {path}: are drawn into the diagram of a section, which {source} does not "
            "hold; name states in outputs.section and run the sweep again, or plot the file of "
            "branches alone"
        )
    if found.parameter.name != axis:
        raise FigureError(
            f"--branches {path}: holds branches over {found.parameter.name}, and the diagram is "
            f"over {axis}; give the branches of this sweep"
        )
    for result in results:
        _require_same_machine(f"--branches {path}", found.metadata, result)
    if units == "physical":
        raise FigureError(
            "--branches: branches are dimensionless; leave --units physical out, or the branches"
        )
    return found


def boundaries_over(path: str | Path, result: Result, units: str | None = None) -> BoundarySet:
    """Read the boundaries of ``--boundaries`` for the map of a result.

    Raises FigureError if boundaries and map do not belong together.
    """
    found, axes = read_boundaries(path), map_axes(result)
    if {one.name for one in found.parameters} != {*axes}:
        raise FigureError(
            f"--boundaries {path}: holds curves over "
            f"{' and '.join(one.name for one in found.parameters)}, and the map is over "
            f"{' and '.join(axes)}; give the boundaries of this map"
        )
    _require_same_machine(f"--boundaries {path}", found.metadata, result)
    shown = result.physical() if units == "physical" else result
    if converted := shown.metadata.get(CONVERTED):
        axes_of_map = " and ".join(str(converted).split())
        raise FigureError(
            f"--boundaries: the curves are over {axes_of_map} as configured, "
            "and --units physical draws other units; leave it out, or the boundaries"
        )
    return found


def _require_same_machine(name: str, metadata: Mapping[str, Any], result: Result) -> None:
    """Raise FigureError if a file was computed from another machine than a result.

    ``metadata``: that of the file, whose configurations are compared; ``name``: the file in
    messages.
    """
    theirs, ours = _keys_of_machine(metadata), _keys_of_machine(result.metadata)
    for key, value in theirs.items():
        # A value of a swept parameter that was chosen with --at is fixed in the result.
        given = result.fixed.get(axis_name(key.removeprefix("groups.")), ours.get(key, value))
        if value != given:
            raise FigureError(
                f"{name}: was computed with {key} = {value}, and the figure is of "
                f"{key} = {given}; give the file that was computed from this result"
            )


def _keys_of_machine(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of the machine in the configuration of a file by dotted path, and values."""
    try:
        tables = tomllib.loads(str(metadata.get("configuration_resolved", "")))
    except tomllib.TOMLDecodeError:
        return {}
    flat = flat_tables({name: table for name, table in tables.items() if name not in OF_THE_RUN})
    swept = {
        sweep.get("parameter")
        for name in ("sweep", "second_sweep")
        if isinstance(sweep := tables.get(name), dict)
    }
    return {key: value for key, value in flat.items() if key.removeprefix("groups.") not in swept}


def of_map(axis: str) -> str:
    """Return the words for a map; ``axis``: one of its axes."""
    return f"a map; --at {axis}=VALUE makes a diagram of it"


def refuse_boundaries_of_diagram(path: str | Path) -> None:
    """Raise a FigureError: the diagram of one parameter has no boundaries."""
    raise FigureError(
        f"--boundaries {path}: are drawn over maps of two parameters, and here is a diagram of "
        "one; leave it out"
    )


def draws_alone(rule: str, page: str) -> str:
    """Return the end of the message for what only diagrams of sweeps support."""
    return f"only diagrams of sweeps {rule}, and here is {page}; leave it out"
