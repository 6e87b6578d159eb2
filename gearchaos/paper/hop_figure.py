"""Not a figure of the paper: both motions of the hop, and where starts change over."""

from __future__ import annotations

import numpy as np

from gearchaos.figures.page import Page, column, few_ticks
from gearchaos.figures.style import BLACK, BLUE, GREY, VERMILION
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.hop import HIGH, LOW
from gearchaos.paper.published import Published

STARTS = {"rest": "at rest", "contact": "contact flank"}


def hop_page(printed: Published, found: Reproduction) -> Page:
    """Draw the section of the two coexisting motions over the pitch error."""
    hop = found.hop
    with column(66.0) as figure:
        axes = figure.subplots()
        if hop is None:
            axes.text(0.5, 0.5, "no coexisting motions found", ha="center")
            return figure
        for sweep, color, marker, label in (
            (hop.upwards, BLACK, "^", "swept upwards"),
            (hop.downwards, BLUE, "v", "swept downwards"),
        ):
            axes.plot(
                sweep[sweep.axis],
                sweep["section_delta_5"][:, -1],
                marker,
                color=color,
                markersize=1.8,
                markeredgewidth=0.0,
                label=label,
            )
        axes.axvspan(hop.first, hop.last, color=GREY, alpha=0.12, linewidth=0.0)
        middle = float(np.mean(axes.get_ylim()))
        places: list[tuple[str, float, str, tuple[int, ...]]] = [
            (STARTS[kind], change.after, BLACK, (4, 2)) for kind, change in hop.changes.items()
        ]
        places.append(("Pan 2021", printed.numbers["hop"].value, VERMILION, ()))
        for text, place, color, dashes in places:
            left = text == STARTS["rest"]
            axes.axvline(place, color=color, lw=0.7, dashes=dashes)
            axes.annotate(
                f"{text}: {place:.2f}",
                (place, middle),
                (-2 if left else 2, 0),
                textcoords="offset points",
                rotation=90,
                ha="right" if left else "left",
                va="center",
                fontsize=7,
                color=color,
            )
        axes.set(xlim=(LOW, HIGH), xlabel="Multiple of the pitch error, $P$")
        axes.set_ylabel(r"$\delta_5$ at the section (dimensionless)")
        few_ticks(axes, 8, 6)
        axes.legend(
            frameon=False,
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=2,
            markerscale=2.0,
            borderpad=0.0,
            borderaxespad=0.3,
            handletextpad=0.2,
        )
    return figure
