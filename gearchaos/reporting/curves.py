"""Figures and tables of files of branches and of boundaries."""

import numpy as np

from gearchaos.figures import boundaries_page, branches_page
from gearchaos.reporting import markup
from gearchaos.reporting.parts import Parts
from gearchaos.results.files.boundary_file import BoundarySet
from gearchaos.results.files.branch_file import BranchSet
from gearchaos.results.reading.tables import unit_text


def branch_parts(found: BranchSet) -> Parts:
    """Draw branches, and list them and their special points."""
    unit = f"[{unit_text(found.parameter)}]"
    branches, points = [], []
    for number, one in enumerate(found.branches):
        ends = float(one.value.min()), float(one.value.max()), float(np.mean(one.stable))
        branches.append([number, one.period, *ends, one.value.size, *one.ends])
        points += [[number, special.kind, special.value, special.flank] for special in one.specials]
    headings = ["branch [1]", "period [1]", f"from {unit}", f"to {unit}"]
    headings += ["stable share of its points [1]", "points [1]", "begins at", "ends at"]
    tables = [markup.table("Branches", headings, branches)]
    if points:
        headings = ["branch [1]", "kind", f"{found.parameter.name} {unit}", "flank"]
        tables.append(markup.table("Special points", headings, points))
    figure = markup.picture_of(branches_page(found), "Branches of periodic orbits")
    return Parts([figure], tables, 0)


def boundary_parts(found: BoundarySet) -> Parts:
    """Draw boundaries, and list them and their points of codimension 2."""
    names = [f"{one.name} [{unit_text(one)}]" for one in found.parameters]
    ends = [f"{end} of {name}" for name in names for end in ("least", "greatest")]
    curves, points = [], []
    for number, one in enumerate(found.boundaries):
        extremes = np.stack([one.values.min(axis=0), one.values.max(axis=0)], axis=1)
        curves.append([number, one.kind, one.period, *extremes.ravel().tolist()])
        points += [[number, point.kind, *point.values.tolist()] for point in one.points]
    tables = [markup.table("Boundaries", ["curve [1]", "kind", "period [1]", *ends], curves)]
    if points:
        headings = ["curve [1]", "kind", *names]
        tables.append(markup.table("Points of codimension 2", headings, points))
    figure = markup.picture_of(boundaries_page(found), "Boundaries over two parameters")
    return Parts([figure], tables, 0)
