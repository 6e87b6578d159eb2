"""A page for one lane of a response: history, phase portrait, Poincare section and spectrum."""

from contextlib import suppress
from math import ceil, log10
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from gearchaos.errors import ConfigurationError
from gearchaos.figures import response
from gearchaos.figures.labels import form_in_words, in_words, place_of
from gearchaos.figures.page import Page, few_ticks, footnote, letter, page, remark
from gearchaos.figures.style import BLACK, BLUE, DOUBLE_COLUMN_MM, LEGEND, VERMILION
from gearchaos.models.gear_pair.outputs import MESH_ERROR
from gearchaos.outputs.names import acceleration_of
from gearchaos.results.reading.excitation import Excitation, excitation_of
from gearchaos.results.reading.result import Result

SIDE_BY_SIDE_MM = 120.0  # Least width of a page with two panels side by side.
SHOWN_PERIODS = 12  # Mesh periods at the end of the record that the time history shows.

SHOWN_REVOLUTIONS = 2
"""Revolutions of the driving gear at the end of the record that the time histories show."""

HIGHEST_ORDER = 3.5  # Highest mesh order of the spectrum where teeth have errors of their own.

MOST_TICKS = 120  # Most minor ticks of an axis.

_PANEL_HEIGHT_MM = 52.0

_HEIGHTS_MM = {"e": 32.0, "h": 48.0, "p": 56.0, "s": 56.0, "f": 56.0}
"""Heights of the panels of pitch error, history, portrait, section and spectrum."""

# Colour and width of lines of the spectrum: other, driven shaft, driving shaft, mesh.
_LOOKS = (("0.65", 0.4), (BLUE, 0.9), (VERMILION, 0.9), (BLACK, 0.9))


def response_page(
    result: Result,
    lane: int,
    coordinate: str | None = None,
    *,
    width_mm: float = DOUBLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw time history (a), phase portrait (b), Poincare section (c) and spectrum (d) of a lane.

    Parameters
    ----------
    result, lane
        As for `time_history`.
    coordinate : str, optional
        Such as ``"delta_1"``; by default the first one, ``"delta_5"`` of a gear pair. Another
        variable over time, such as ``"mesh_force_tangential"``, gives only time history and
        spectrum.
    width_mm, height_mm : float
        Size of the page. Below 120 mm, as in one column of a journal, the panels are stacked.

    Returns
    -------
    Page
        A figure unknown to pyplot.

    Raises
    ------
    FigureError
        As for `time_history`.

    Notes
    -----
    The spectrum is that of the acceleration: with a rectangular window if the motion repeats, with
    a Hann window otherwise. Where each tooth has its own error, the page begins with the pitch
    error over revolutions of the driving gear, in um where b' is known. The section then also shows
    the points once a mesh period.

    Examples
    --------
    >>> page = figures.response_page(gearchaos.open_result("response.h5"), lane=0)
    >>> len(page.axes)
    4
    """
    first = response.first_coordinate(result)
    motion = _motion(result, lane, first if coordinate is None else coordinate)
    layout, heights = _layout(motion, width_mm >= SIDE_BY_SIDE_MM)
    with page(width_mm, height_mm or sum(heights)) as figure:
        panels = figure.subplot_mosaic(layout, height_ratios=heights)
        _draw_panels(panels, motion)
        letter(panels.values())
        foot = [form_in_words(result)]
        if motion.whole and motion.teeth:
            foot.append("points once a mesh period (grey) and once an excitation period (red)")
        footnote(figure, "\n".join(filter(None, foot)))
        figure.align_ylabels([*panels.values()])
    return figure


class _Motion(NamedTuple):
    """The motion of one lane on a page.

    ``whole``: whether the variable is a coordinate, with velocity and acceleration; ``teeth``: of
    the driving gear, 0 if the teeth have no errors of their own; ``shown``: first and last mesh
    period of the time histories.
    """

    result: Result
    lane: int
    variable: str
    whole: bool
    teeth: int
    excitation: Excitation
    shown: tuple[float, float]


def _motion(result: Result, lane: int, variable: str) -> _Motion:
    """Check that the lane has the variable, and choose which periods to show."""
    response.motion_over_time(result, lane, variable)
    whole = variable in response.coordinates_of(result)
    excitation, last = excitation_of(result.metadata), float(response.mesh_periods(result)[-1])
    teeth = excitation.driving_teeth if excitation.of_teeth else 0
    shown = (max(0.0, last - (SHOWN_REVOLUTIONS * teeth or SHOWN_PERIODS)), last)
    if teeth:
        with suppress(ConfigurationError):
            result = result.physical(MESH_ERROR)
    return _Motion(result, lane, variable, whole, teeth, excitation, shown)


def _layout(motion: _Motion, side_by_side: bool) -> tuple[str, list[float]]:
    """Return the mosaic of the panels, named as in `_HEIGHTS_MM`, and the heights of its rows."""
    if motion.teeth:
        whole = "ee;hh;ps;ff" if side_by_side else "e;h;p;s;f"
        layout = whole if motion.whole else "e;h;f"
        return layout, [_HEIGHTS_MM[row[0]] for row in layout.split(";")]
    if side_by_side:
        layout = "hp;sf" if motion.whole else "hf"
    else:
        layout = "h;p;s;f" if motion.whole else "h;f"
    return layout, [_PANEL_HEIGHT_MM] * (layout.count(";") + 1)


def _draw_panels(panels: dict[str, Axes], motion: _Motion) -> None:
    """Draw all panels, those for teeth with errors of their own over orders of the shafts."""
    result, lane, variable = motion.result, motion.lane, motion.variable
    history = panels["h"]
    in_periods = motion.teeth > 0
    response.time_history(
        history, result, lane, variable, between=motion.shown, in_periods=in_periods
    )
    if response.element_of(result, variable):
        response.contact_strip(history, result, lane, variable, in_periods=in_periods)
    few_ticks(history, None if motion.teeth else 6, 6)
    remark(panels["e" if motion.teeth else "h"], in_words(result, place_of(result, lane)))
    if motion.whole:
        _draw_phase_plane(panels["p"], panels["s"], motion)
    transformed = acceleration_of(variable) if motion.whole else variable
    if motion.teeth:
        _pitch_error_above(panels["e"], history, motion)
        shaft_spectrum(panels["f"], result, lane, transformed)
    else:
        response.amplitude_spectrum(panels["f"], result, lane, transformed)


def _draw_phase_plane(portrait: Axes, section: Axes, motion: _Motion) -> None:
    """Draw phase portrait and Poincare section, and remark how long their records are."""
    result, lane = motion.result, motion.lane
    curve, _ = response.phase_portrait(portrait, result, lane, motion.variable)
    points = response.poincare_section(section, result, lane, motion.variable)
    first, last = motion.shown
    late = f", black: last {SHOWN_REVOLUTIONS} revolutions" if motion.teeth and first else ""
    remark(portrait, f"last {round(last)} {response.period_name(result)}s{late}")
    if motion.teeth:
        repeats = response.repeats_after(result, lane)
        number = repeats // motion.excitation.excitation_period
        period = f"period {number} of the excitation, {repeats} mesh periods"
        remark(section, period if repeats else "")
        late_curve = np.array(curve.get_data())[:, response.mesh_periods(result) >= first]
        portrait.plot(*late_curve, "k", linewidth=0.4)
        curve.set(color="0.85", linewidth=0.3, zorder=1, rasterized=True)
    else:
        # The section may be longer than the history: the lane may converge in between.
        kept = np.size(points.get_xdata())
        remark(section, f"last {kept} {response.period_name(result)}s")
    for axes in (portrait, section):
        few_ticks(axes, 6, 6)


def _pitch_error_above(top: Axes, history: Axes, motion: _Motion) -> None:
    """Draw the pitch error above the time history, both over revolutions of the driving gear.

    Minor ticks mark its teeth. A record ends where tooth 0 meshes again, at the end of the last
    revolution.
    """
    between = history.get_xlim()
    periods: dict[str, Any] = {"between": between, "in_periods": True}
    response.time_history(top, motion.result, motion.lane, MESH_ERROR, **periods)
    top.sharex(history)
    few_ticks(top, None, 4)
    teeth = motion.teeth
    begin = float(history.get_xlim()[1]) - SHOWN_REVOLUTIONS * teeth
    for axes in (top, history):
        every = _ticks(axes.xaxis, teeth / 2, 1.0, begin)
        axes.xaxis.set_major_formatter(lambda x, _: f"{(x - begin) / teeth:.3g}")
    ticks = "a tick for each tooth" if every == 1 else f"a tick every {every} teeth"
    history.set_xlabel(f"Revolutions of the driving gear, {ticks}")
    remark(history, f"excitation period: {motion.excitation.excitation_period} mesh periods")
    top.set_xlabel("")
    top.tick_params(labelbottom=False)


def shaft_spectrum(axes: Axes, result: Result, lane: int, variable: str) -> None:
    """Draw a spectrum over orders of the driving shaft, for teeth with errors of their own."""
    excitation = excitation_of(result.metadata)
    look: dict[str, Any] = {"highest": HIGHEST_ORDER, "in_orders": True}
    lines = response.amplitude_spectrum(axes, result, lane, variable, **look)
    resolved = round(response.mesh_periods(result)[-1]) >= excitation.excitation_period
    _in_shaft_orders(axes, lines, excitation, resolved)


def _in_shaft_orders(
    axes: Axes, lines: LineCollection, excitation: Excitation, resolved: bool
) -> None:
    """Label a spectrum with orders of the driving shaft, and colour its lines by shaft.

    Major ticks are multiples of the mesh order, minor ticks the sidebands of the driving shaft. A
    line at a multiple of a shaft's order has the colour of that shaft. Other lines are pale, and so
    are all but those of the mesh if the record is shorter than an excitation period.
    """
    period, driving, driven = excitation
    segments = np.array(lines.get_segments())
    multiples = segments[:, :1, 0] * np.array([driven, driving, 1])
    near = np.abs(multiples - np.rint(multiples)) < 1e-6
    # The last match decides, since a mesh order is a multiple of both shafts' orders. A gear
    # without errors does not contribute to the excitation period.
    shafts = [resolved and period % teeth == 0 for teeth in (driven, driving)]
    kind = np.max(near * [shafts[0], 2 * shafts[1], 3], axis=1)
    at = np.argsort(kind, kind="stable")
    colours, widths = zip(*(_LOOKS[number] for number in kind[at]), strict=True)
    lines.set_segments(list(segments[at]))
    lines.set(color=colours, linewidth=widths)
    _ticks(axes.xaxis, 1.0, 1.0 / driving)
    axes.xaxis.set_major_formatter(lambda x, _: f"{x * driving:.6g}")
    axes.set_xlabel(f"Order of the driving shaft (mesh: {driving})")
    names = (
        "other" if resolved else "not resolved by so short a record",
        f"driven shaft, multiples of {driving}/{driven}",
        "driving shaft",
        "mesh",
    )
    shown = [Line2D([], [], color=_LOOKS[n][0], label=names[n]) for n in (3, 2, 1, 0) if n in kind]
    # A decade more than the lines need has room for their legend.
    axes.set_ylim(top=10.0 * axes.get_ylim()[1])
    axes.legend(handles=shown, loc="upper right", ncols=2, **LEGEND | {"borderpad": 0.4})


def _ticks(axis: Axis, coarse: float, fine: float, begin: float = 0.0) -> int:
    """Set major and minor ticks; minor ones are thinned by the power of ten that is returned."""
    low, high = axis.get_view_interval()
    every = 10 ** max(0, ceil(log10((high - low) / fine / MOST_TICKS)))
    axis.set_major_locator(MultipleLocator(coarse, begin))
    axis.set_minor_locator(MultipleLocator(fine * every, begin))
    return int(every)
