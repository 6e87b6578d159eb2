"""A page about a controller: section and input over time, capture times, and phase portraits."""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from gearchaos.arrays import Floats
from gearchaos.figures.labels import symbol_of
from gearchaos.figures.page import Page, letter, page, remark
from gearchaos.figures.style import BLACK, BLUE, DOUBLE_COLUMN_MM, GREY, LEGEND, ORANGE, VERMILION
from gearchaos.outputs.variable import Variable
from gearchaos.records.control import ControlledMotion

SHOWN_STARTS = 4
"""Number of starts whose section and input are drawn."""

MOST_LINES = 16
"""Most section points of a target that are drawn as lines; those of a longer one over time."""

COLOURS = (BLACK, BLUE, ORANGE, VERMILION)


class ControlDrawing(NamedTuple):
    """The contents of a page about a controller.

    Attributes
    ----------
    motion : ControlledMotion
        Motions with control from many starts.
    scale : float
        Factor of the inputs in the figure, such as 100 over the load.
    words : str
        Label of the axis of the inputs.
    target : array, shape (mesh periods, states)
        The section points of the target orbit.
    repeats : int
        Mesh periods after which the excitation repeats; the orbit may be followed from any of them.
    free, held : array, shape (samples, states)
        A motion without control, and one that the controller has captured.
    states : (Variable, Variable)
        Descriptions of the first state and of its rate.
    periods : str
        The word for the periods of the excitation.
    """

    motion: ControlledMotion
    scale: float
    words: str
    target: Floats
    repeats: int
    free: Floats
    held: Floats
    states: tuple[Variable, Variable]
    periods: str

    @property
    def time_label(self) -> str:
        """Label of the axes of time."""
        return f"{self.periods.capitalize()} with control"


def control_page(shown: ControlDrawing) -> Page:
    """Draw a page about a controller.

    Parameters
    ----------
    shown : ControlDrawing
        The contents of the page.

    Returns
    -------
    Page
        Four panels: the section of some starts over time with the target orbit, the input, the
        distribution of capture times, and the motion in the plane of the first state and its rate,
        before and after.

    Examples
    --------
    >>> from gearchaos.controlling.trial import try_controller
    >>> figure = figures.control_page(try_controller(controller, 10, 300).drawing())
    """
    with page(DOUBLE_COLUMN_MM, 110.0) as figure:
        panels = figure.subplots(2, 2)
        draw_section(panels[0, 0], shown)
        draw_inputs(panels[1, 0], shown)
        draw_capture_times(panels[0, 1], shown)
        draw_portraits(panels[1, 1], shown)
        letter((panels[0, 0], panels[0, 1], panels[1, 0], panels[1, 1]))
    return figure


def draw_section(axes: Axes, shown: ControlDrawing) -> None:
    """Draw the first state on the section over time, for some starts."""
    section = shown.motion.section[:SHOWN_STARTS, :, 0]
    time = np.arange(1, section.shape[1] + 1)
    for values, colour in zip(section, COLOURS, strict=False):
        axes.plot(time, values, ".", color=colour, markersize=1.5, markeredgewidth=0.0)
    target = shown.target[:, 0]
    if shown.repeats == 1 or target.size <= MOST_LINES:
        lines = [axes.axhline(point, linewidth=0.6, linestyle=(0, (4, 2))) for point in target]
    else:
        # The motion may follow the orbit from the beginning of any of its excitation periods.
        begins = np.arange(0, target.size, shown.repeats)
        places = target[(time[:, np.newaxis] + begins) % target.size]
        lines = axes.plot(time, places, linewidth=0.4, zorder=0.5)
    for line in lines:
        line.set_color(GREY)
    lines[0].set_label("target orbit")
    axes.set_xlim(0, shown_periods(shown.motion))
    axes.set_xlabel(shown.time_label)
    axes.set_ylabel(f"Section {symbol_of(shown.states[0])}")
    axes.legend(loc="upper right", **LEGEND)
    remark(axes, f"{len(section)} of {len(shown.motion.section)} starts")


def shown_periods(motion: ControlledMotion) -> int:
    """Return how many mesh periods to show of some starts: until all are captured, and a bit."""
    whole = int(motion.inputs.shape[1])
    times = motion.capture_time[:SHOWN_STARTS]
    if (times < 0).any():
        return whole
    return min(whole, int(1.3 * float(times.max())) + 20)


def draw_inputs(axes: Axes, shown: ControlDrawing) -> None:
    """Draw the input over time, for the same starts."""
    inputs = shown.scale * shown.motion.inputs[:SHOWN_STARTS]
    time = np.arange(inputs.shape[1])
    for values, colour in zip(inputs, COLOURS, strict=False):
        axes.plot(time, values, color=colour, linewidth=0.5, drawstyle="steps-post")
    axes.set_xlim(0, shown_periods(shown.motion))
    axes.set_xlabel(shown.time_label)
    axes.set_ylabel(shown.words)


def draw_capture_times(axes: Axes, shown: ControlDrawing) -> None:
    """Draw the share of the starts that is captured after some time."""
    motion = shown.motion
    times = np.sort(motion.capture_time[motion.captured])
    whole = motion.inputs.shape[1]
    share = 100.0 * np.arange(1, times.size + 1) / len(motion.captured)
    axes.step([0, *times, whole], [0.0, *share, *share[-1:]] if times.size else [0.0, 0.0],
              where="post", color=BLUE)  # fmt: skip
    axes.set_xlim(0, whole)
    axes.set_ylim(0, 103)
    axes.set_xlabel(shown.time_label)
    axes.set_ylabel("Captured starts (%)")
    remark(axes, f"{times.size} of {len(motion.captured)} captured")


def draw_portraits(axes: Axes, shown: ControlDrawing) -> None:
    """Draw the motion in the plane of the first state and its rate, before and after."""
    axes.plot(*shown.free[:, :2].T, color=GREY, linewidth=0.25, alpha=0.7, label="without control")
    axes.plot(*shown.held[:, :2].T, color=VERMILION, linewidth=1.0, label="with control")
    axes.set_xlabel(symbol_of(shown.states[0]))
    axes.set_ylabel(symbol_of(shown.states[1]))
    # Room for the legend above the motion.
    axes.margins(y=0.2)
    axes.legend(loc="upper right", **LEGEND)
