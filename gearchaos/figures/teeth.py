"""How panels of a response show teeth that each have an error of their own."""

from __future__ import annotations

from math import ceil, log10

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from gearchaos.figures.lanes import Floats
from gearchaos.figures.style import BLACK, BLUE, LEGEND, VERMILION
from gearchaos.results.excitation import Excitation

PALE, FAINT = "0.65", "0.85"
"""Greys of what is there as well: points once a mesh period, lines of no shaft; a whole motion."""

FAMILIES = (("other", PALE), ("driven", BLUE), ("driving", VERMILION), ("mesh", BLACK))
"""Lines of a spectrum and their colours, each before what it also contains."""

MOST_TICKS = 120


def other_points(axes: Axes, x: Floats, y: Floats) -> Line2D:
    """Mark the states once a mesh period, behind those once an excitation period."""
    (points,) = axes.plot(
        x, y, "o", markersize=1.2, markeredgewidth=0.0, color=PALE, zorder=2.5, rasterized=True
    )
    return points


def in_revolutions(axes: Axes, teeth: int, revolutions: float) -> None:
    """Let an axis of mesh periods count revolutions of the driving gear, with ticks for its teeth.

    The record ends where tooth 0 comes into mesh again, at the last of so many revolutions.
    """
    begin = float(axes.get_xlim()[1]) - revolutions * teeth
    every = _ticks(axes.xaxis, teeth / 2, 1.0, begin)
    axes.xaxis.set_major_formatter(lambda x, _: f"{(x - begin) / teeth:.3g}")
    ticks = "a tick for each tooth" if every == 1 else f"a tick every {every} teeth"
    axes.set_xlabel(f"Time in revolutions of the driving gear, {ticks}")


def in_shaft_orders(axes: Axes, lines: LineCollection, excitation: Excitation, held: int) -> None:
    """Let a spectrum over mesh orders count those of the driving shaft, and colour its lines.

    Ticks with a number are multiples of the mesh order; those between them are the sidebands of the
    driving shaft. A line has the colour of the shaft whose multiple it is, and is pale where it is
    that of neither: a combination of both, or of a longer period or none. Whole periods of the
    excitation are needed to tell; the record has ``held`` mesh periods.
    """
    driving, driven = excitation.driving_teeth, excitation.driven_teeth
    segments = np.array(lines.get_segments())
    order = segments[:, :1, 0]
    # Columns in the order of FAMILIES; of what a line is, the last one that holds is shown.
    multiples = order * np.array([driven, driving, 1])
    near = np.abs(multiples - np.rint(multiples)) < 1e-6
    resolved = held >= excitation.excitation_period
    near[:, :2] &= resolved
    family = np.max(near * np.arange(1, len(FAMILIES)), axis=1)
    at = np.argsort(family, kind="stable")
    colours = [colour for _, colour in FAMILIES]
    lines.set_segments(list(segments[at]))
    lines.set(color=[colours[n] for n in family[at]], linewidth=np.where(family[at] > 0, 0.9, 0.4))
    _ticks(axes.xaxis, 1.0, 1.0 / driving)
    axes.xaxis.set_major_formatter(lambda x, _: f"{x * driving:.6g}")
    axes.set_xlabel(f"Order of the driving shaft (mesh: {driving})")
    names = {
        "mesh": "mesh",
        "driving": "driving shaft",
        "driven": f"driven shaft, multiples of {driving}/{driven}",
        "other": "other" if resolved else "not resolved by so short a record",
    }
    handles = [
        Line2D([], [], color=colour, label=names[name])
        for number, (name, colour) in reversed([*enumerate(FAMILIES)])
        if number in family
    ]
    axes.legend(
        handles=handles,
        loc="upper right",
        **LEGEND | {"frameon": True, "borderpad": 0.4, "fancybox": False},
    )


def _ticks(axis: Axis, coarse: float, fine: float, begin: float = 0.0) -> int:
    """Set ticks at multiples of both, fine ones at every one, tenth or hundredth, as returned."""
    low, high = axis.get_view_interval()
    every = 10 ** max(0, ceil(log10((high - low) / fine / MOST_TICKS)))
    axis.set_major_locator(MultipleLocator(coarse, begin))
    axis.set_minor_locator(MultipleLocator(fine * every, begin))
    return int(every)
