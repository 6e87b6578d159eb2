"""Colours of interactive charts: stages or basins as boxes behind a diagram."""

from itertools import pairwise

import numpy as np
from bokeh.models import BoxAnnotation
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from gearchaos.figures.ensembles import basin_patches
from gearchaos.figures.lanes import cell_edges, swept_axes
from gearchaos.figures.stages import shade_stages
from gearchaos.outputs.names import DIRECTION, LABELS
from gearchaos.results.reading.ensembles import Basins
from gearchaos.results.reading.result import Result

COLOURS = 256
"""Most colours of a map."""


def stage_boxes(
    result: Result, limits: tuple[float, float]
) -> tuple[list[BoxAnnotation], dict[str, str]]:
    """Return a box for each stage between limits, and the colour of each kind of stage.

    A result with two directions, two swept parameters or no labels has none.
    """
    if DIRECTION in result.axes or len(swept_axes(result)) != 1 or LABELS[0] not in result:
        return [], {}
    axes = Figure().subplots()
    axes.set_xlim(*limits)
    boxes, kinds = [], {}
    for one in shade_stages(axes, result, legend=False):
        colour, left = to_hex(one.get_facecolor()), one.get_x()
        boxes.append(_box(left, left + one.get_width(), colour))
        kinds[str(one.get_label())] = colour
    return boxes, kinds


def basin_boxes(found: Basins) -> tuple[list[BoxAnnotation], dict[str, str]]:
    """Return a box for every interval of starts that lead to one attractor, and their colours.

    ``found``: basins at one value, over one state of the starts.
    """
    (starts,), numbers = found.grid.values(), found.numbers[0]
    patches = basin_patches(found)
    colours = {
        one.number: to_hex(patch.get_facecolor())
        for one, patch in zip(found.basins, patches, strict=True)
    }
    edges = cell_edges(starts)
    ends = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), numbers.size]
    boxes = [
        _box(edges[first], edges[end], colours[numbers[first]]) for first, end in pairwise(ends)
    ]
    return boxes, {str(one.get_label()): to_hex(one.get_facecolor()) for one in patches}


def _box(left: float, right: float, colour: str) -> BoxAnnotation:
    look = {"fill_color": colour, "fill_alpha": 1.0, "line_alpha": 0.0, "level": "underlay"}
    return BoxAnnotation(left=float(left), right=float(right), **look)
