"""Colours of interactive charts: stages as boxes behind a diagram."""

from bokeh.models import BoxAnnotation
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from gearchaos.figures.lanes import swept_axes
from gearchaos.figures.stages import shade_stages
from gearchaos.outputs.names import DIRECTION, LABELS
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
        look = {"fill_color": colour, "fill_alpha": 1.0, "line_alpha": 0.0, "level": "underlay"}
        boxes.append(BoxAnnotation(left=left, right=left + one.get_width(), **look))
        kinds[str(one.get_label())] = colour
    return boxes, kinds
