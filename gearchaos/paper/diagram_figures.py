"""Figure 7, shaded by the motions that the paper tells apart, and the two motions of its hop."""

from itertools import pairwise
from typing import Any

import numpy as np

from gearchaos.figures import bifurcation_page
from gearchaos.figures.page import Page, column, few_ticks
from gearchaos.figures.style import BLACK, BLUE, GREY, VERMILION
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.hop import HIGH, LOW, STARTS
from gearchaos.paper.published import published


def diagram_page(found: Reproduction) -> Page:
    """Draw bifurcation diagram and exponent; ticks where the paper has boundaries and the hop."""
    boundaries = [after.first for _, after in pairwise(published().stages)]
    places = [published().numbers["hop"].value, *boundaries]
    return bifurcation_page(found.sweep, stages=found.lanes, marked=("changes in Pan 2021", places))


def hop_page(found: Reproduction) -> Page:
    """Draw the section of the two coexisting motions over the pitch error, and where starts change.

    Not a figure of the paper.
    """
    hop = found.hop
    with column(66.0) as figure:
        axes = figure.subplots()
        for sweep, color, marker, label in (
            (hop.upwards, BLACK, "^", "swept upwards"),
            (hop.downwards, BLUE, "v", "swept downwards"),
        ):
            points = sweep[sweep.axis], sweep["section_delta_5"][:, -1]
            axes.plot(*points, marker, color=color, ms=1.8, mew=0.0, label=label)
        axes.axvspan(hop.first.value, hop.last.value, color=GREY, alpha=0.12, linewidth=0.0)
        middle = float(np.mean(axes.get_ylim()))
        places: list[tuple[str, float, str, tuple[int, ...]]] = [
            (STARTS[kind], change[1], BLACK, (4, 2)) for kind, change in hop.changes.items()
        ]
        places.append(("Pan 2021", published().numbers["hop"].value, VERMILION, ()))
        for text, place, color, dashes in places:
            axes.axvline(place, color=color, lw=0.7, dashes=dashes)
            side, aside = ("right", -2) if text == STARTS["rest"] else ("left", 2)
            look: dict[str, Any] = {"textcoords": "offset points", "rotation": 90, "fontsize": 7}
            look |= {"ha": side, "va": "center", "color": color}
            axes.annotate(f"{text}: {place:.2f}", (place, middle), (aside, 0), **look)
        axes.set(xlim=(LOW, HIGH), xlabel="Multiple of the pitch error, $P$")
        axes.set_ylabel(r"$\delta_5$ at the section (dimensionless)")
        few_ticks(axes, 8, 6)
        above: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 2}
        above |= {"borderpad": 0.0, "borderaxespad": 0.3, "handletextpad": 0.2}
        axes.legend(frameon=False, markerscale=2.0, **above)
    return figure
