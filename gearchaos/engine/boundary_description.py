"""The contents of a file of boundaries, from boundaries that have been followed."""

from collections.abc import Sequence

import numpy as np

from gearchaos.dynamics.boundaries import Located, TracedBoundary
from gearchaos.dynamics.boundary_equations import Equations
from gearchaos.engine.branching import flank_name
from gearchaos.engine.kept import variables_of
from gearchaos.engine.map_lines import Ranges
from gearchaos.engine.orbit_metadata import metadata_of, states_of
from gearchaos.engine.run_plan import RunPlan
from gearchaos.outputs import names as known
from gearchaos.records.boundary import BOUNDARY_KINDS, Boundary, BoundaryPoint
from gearchaos.results.files.boundary_file import BoundarySet
from gearchaos.results.reading.result import Result


def described(
    boundaries: Sequence[TracedBoundary],
    over: Ranges,
    run: RunPlan,
    longest: int,
    result: Result,
) -> BoundarySet:
    """Return boundaries as arrays with their descriptions.

    ``over`` and ``run``: ranges of the map, and how its orbits were computed; ``longest``: longest
    period that was looked for; ``result`` describes the parameters.
    """
    config = over.config
    if config.integration.method != run.config.integration.method:
        config = config.integrated_by(run.config.integration.method)
    order = sorted(boundaries, key=lambda one: (_rank(one.equations), one.ends[0]))
    named = {one.name: one for one in variables_of(run)} | dict(result.variables)
    parameters = tuple(named[known.axis_name(one)] for one in over.parameters)
    arrays = tuple(_arrays(one, over, run) for one in order)
    return BoundarySet(parameters, states_of(run), arrays, metadata_of(run, config, longest))


def _arrays(boundary: TracedBoundary, over: Ranges, run: RunPlan) -> Boundary:
    """Return a traced boundary as arrays."""
    points, equations = boundary.points, boundary.equations
    return Boundary(
        equations.kind,
        equations.periods,
        flank_name(run, equations.flank),
        over.values(boundary.shares),
        boundary.positions,
        np.array([one.section for one in points]),
        np.array([one.multipliers for one in points]),
        tuple(_point(boundary, one, over) for one in boundary.located),
        boundary.ends,
    )


def _point(boundary: TracedBoundary, located: Located, over: Ranges) -> BoundaryPoint:
    """Return a point of codimension 2 as it is stored."""
    return BoundaryPoint(
        located.kind,
        over.values(located.point.shares),
        float(boundary.positions[located.number]),
        located.point.multipliers,
    )


def _rank(equations: Equations) -> tuple[int, int, int]:
    """Return the order of a boundary in the file: by period, kind and flank."""
    return equations.periods, BOUNDARY_KINDS.index(equations.kind), equations.flank
