"""The motion of a lane in panels to look into, which show what the figures draw."""

from typing import Any

import numpy as np
from bokeh.models import Range1d
from bokeh.plotting import figure
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from gearchaos.explorer.charts import plain_text
from gearchaos.figures import response as figures
from gearchaos.figures.response_page import SHOWN_PERIODS
from gearchaos.results.response_variables import MESH_FORCE, TIME, acceleration_of
from gearchaos.results.result import Result

FORCE = f"{MESH_FORCE}tangential"
LOOK = {
    "height": 290,
    "sizing_mode": "stretch_width",
    "tools": "box_zoom,pan,wheel_zoom,reset,hover",
}


def panels(motion: Result, coordinate: str) -> list[Any]:
    """Show the lane of a response: time history, phase portrait with section, spectrum, mesh force.

    Raises FigureError if it diverged.
    """
    history, portrait, spectrum, force = drawn = Figure().subplots(1, 4)
    late: Any = {"between": (max(0.0, motion[TIME][-1] - SHOWN_PERIODS), None)}
    figures.time_history(history, motion, 0, coordinate, **late)
    figures.phase_portrait(portrait, motion, 0, coordinate)
    figures.poincare_section(portrait, motion, 0, coordinate)
    window = "rectangular" if figures.repeats_after(motion, 0) else "hann"
    look: Any = {"window": window, "logarithmic": True}
    figures.amplitude_spectrum(spectrum, motion, 0, acceleration_of(coordinate), **look)
    figures.time_history(force, motion, 0, FORCE, **late)
    figures.contact_strip(force, motion, 0, FORCE)
    return [_panel(axes) for axes in drawn]


def _panel(axes: Axes) -> Any:
    """Show what was drawn into axes of matplotlib."""
    labels = {"x_axis_label": axes.get_xlabel(), "y_axis_label": axes.get_ylabel()}
    words = {name: plain_text(label) for name, label in labels.items()}
    shown = figure(y_axis_type=axes.get_yscale(), tooltips="$x, $y", **LOOK, **words)
    shown.toolbar.logo, shown.toolbar.autohide = None, True
    shown.axis.axis_label_text_font_style = "normal"
    shown.extra_y_ranges = {"strip": Range1d(0.0, 1.0)}
    one: Any
    for one in axes.lines:
        draw = shown.scatter if one.get_linestyle() == "None" else shown.line
        draw(*one.get_data(), color=to_hex(one.get_color()))
    shown.x_range.renderers = [*shown.renderers]
    for one in axes.collections:
        boxes = [path.get_extents().extents for path in one.get_paths()]
        left, bottom, right, top = np.reshape(boxes, (-1, 4)).T
        color = to_hex(one.get_edgecolor()[0])
        if isinstance(one, LineCollection):
            shown.segment(left, bottom, right, top, color=color)
        else:
            place = {"y_range_name": "strip", "legend_label": str(one.get_label())}
            shown.quad(left, right, top, bottom, color=color, **place)
    for legend in shown.legend:
        legend.orientation, legend.padding, legend.border_line_width = "horizontal", 0, 0
        shown.add_layout(legend, "above")
    return shown
