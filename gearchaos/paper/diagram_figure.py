"""Figure 7: the sweep over the pitch error, shaded by the motions that the paper tells apart."""

from __future__ import annotations

from itertools import pairwise

from gearchaos.figures import bifurcation_page
from gearchaos.figures.page import Page
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.published import Published


def diagram_page(printed: Published, found: Reproduction) -> Page:
    """Draw bifurcation diagram and exponent; ticks where the paper has boundaries and the hop."""
    boundaries = [after.first for _, after in pairwise(printed.stages)]
    places = [printed.numbers["hop"].value, *boundaries]
    return bifurcation_page(
        found.sweep, stages=found.labelled(found.sweep), marked=("changes in Pan 2021", places)
    )
