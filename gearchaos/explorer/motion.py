"""The motion of a lane in interactive panels with the content of the figures."""

from typing import Any

import numpy as np
from bokeh.models import Legend, LegendItem, Range1d
from bokeh.plotting import figure
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from gearchaos.explorer.text import plain_text
from gearchaos.figures import response as figures
from gearchaos.figures.response_page import SHOWN_PERIODS, shaft_spectrum
from gearchaos.outputs.names import acceleration_of
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.result import Result

SCALES = ("linear", "linear", "log", "linear")
"""Vertical scales of the panels of `show`."""
LOOK = {
    "height": 290,
    "sizing_mode": "stretch_width",
    "tools": "box_zoom,pan,wheel_zoom,reset,hover",
}


def empty_panel(scale: str) -> Any:
    """Make a panel for `show`; ``scale`` of the vertical axis: "linear" or "log"."""
    panel = figure(y_axis_type=scale, tooltips="$x, $y", **LOOK)
    panel.toolbar.logo, panel.toolbar.autohide = None, True
    panel.axis.axis_label_text_font_style = "normal"
    panel.extra_y_ranges = {"strip": Range1d(0.0, 1.0)}
    panel.add_layout(Legend(orientation="horizontal", padding=0, border_line_width=0), "above")
    return panel


def show(shown: list[Any], motion: Result, coordinate: str) -> None:
    """Show the lane of a response: history, phase portrait with section, spectrum, first force.

    Parameters
    ----------
    shown : list
        Four panels from `empty_panel`, with `SCALES`.
    motion : Result
        A response with one lane.
    coordinate : str
        Such as ``"delta_5"``.

    Raises
    ------
    FigureError
        If the lane diverged.
    """
    history, portrait, spectrum, force = drawn = Figure().subplots(1, 4)
    late: Any = {"between": (max(0.0, figures.mesh_periods(motion)[-1] - SHOWN_PERIODS), None)}
    figures.time_history(history, motion, 0, coordinate, **late)
    figures.phase_portrait(portrait, motion, 0, coordinate)
    figures.poincare_section(portrait, motion, 0, coordinate)
    excitation, acceleration = excitation_of(motion.metadata), acceleration_of(coordinate)
    if excitation.of_teeth:
        shaft_spectrum(spectrum, motion, 0, acceleration)
    else:
        figures.amplitude_spectrum(spectrum, motion, 0, acceleration)
    for name in figures.forces_of(motion)[:1]:
        figures.time_history(force, motion, 0, name, **late)
        figures.contact_strip(force, motion, 0, name)
    for panel, axes in zip(shown, drawn, strict=True):
        # Orders of the driving shaft are multiples of those of the mesh.
        _show(panel, axes, excitation.driving_teeth or 1 if axes is spectrum else 1)


def _show(shown: Any, axes: Axes, times: int) -> None:
    """Replace the content of a panel by that of axes of matplotlib, with x in another unit."""
    shown.xaxis.axis_label = plain_text(axes.get_xlabel())
    shown.yaxis.axis_label = plain_text(axes.get_ylabel())
    shown.renderers, items = [], []
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
            ends = times * left, bottom, times * right, top
            edges: Any = one.get_edgecolor()
            items += _segments(shown, ends, [to_hex(edge) for edge in edges], axes)
        else:
            strip = shown.quad(left, right, top, bottom, color=color, y_range_name="strip")
            items.append(LegendItem(label=str(one.get_label()), renderers=[strip]))
    shown.above[0].items = items


def _segments(shown: Any, ends: Any, colours: list[str], axes: Axes) -> list[LegendItem]:
    """Draw lines of one colour, or of a colour each; return the entries of their legend."""
    each = np.broadcast_to(colours, ends[0].shape)
    drawn = {
        colour: shown.segment(*(end[each == colour] for end in ends), color=colour)
        for colour in dict.fromkeys(colours)
    }
    legend = axes.get_legend()
    handles: list[Any] = legend.legend_handles if legend else []
    return [
        LegendItem(label=str(one.get_label()), renderers=[drawn[to_hex(one.get_color())]])
        for one in handles
    ]
