"""A page for one lane of a response: history, phase portrait, Poincare section and spectrum."""

from contextlib import suppress
from math import ceil, log10
from typing import Any

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
from gearchaos.models.gear_pair.outputs import MESH_ERROR, MESH_FORCE
from gearchaos.outputs.names import TIME, acceleration_of
from gearchaos.results.reading.excitation import Excitation, excitation_of
from gearchaos.results.reading.result import Result

SIDE_BY_SIDE_MM = 120.0  # Width from which on two panels stand side by side.
SHOWN_PERIODS = 12  # Mesh periods at the end of the record that the time history shows.

_PANEL_HEIGHT_MM = 52.0

SHOWN_REVOLUTIONS = 2
"""Revolutions of the driving gear at the end of the record that the time histories show."""

HIGHEST_ORDER = 3.5  # Multiple of the mesh order up to which the spectrum goes.

MOST_TICKS = 120

_HEIGHTS_MM = {"e": 32.0, "h": 48.0, "p": 56.0, "s": 56.0, "f": 56.0}
"""Of the panels of error, history, portrait, section and frequencies."""

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

    The spectrum is that of the acceleration: of a motion that repeats with a rectangular window, of
    any other with that of Hann. Where teeth have errors of their own, the page begins with the
    pitch error, in um where b' is known, over revolutions of the driving gear, and points once a
    mesh period stand behind those of the section.

    ``result``, ``lane`` and errors: as for `time_history`; ``coordinate``: such as ``"delta_1"``,
    by default ``"delta_5"``, the torsion. Of what is no coordinate, such as
    ``"mesh_force_tangential"``, the page has the time history and its own spectrum. ``width_mm``,
    ``height_mm``: size of the page; 180 mm is two columns of a journal, and at 85 mm, one column,
    the panels stand one above the other.
    """
    coordinate = response.COORDINATE if coordinate is None else coordinate
    response.motion_of(result, lane, coordinate)
    whole, side_by_side = coordinate in response.coordinates_of(result), width_mm >= SIDE_BY_SIDE_MM
    excitation, last = excitation_of(result.metadata), float(result[TIME][-1])
    teeth = excitation.driving_teeth if excitation.of_teeth else 0
    shown = (max(0.0, last - (SHOWN_REVOLUTIONS * teeth or SHOWN_PERIODS)), last)
    layout = ("hp;sf" if whole else "hf") if side_by_side else ("h;p;s;f" if whole else "h;f")
    heights = [_PANEL_HEIGHT_MM] * (layout.count(";") + 1)
    if teeth:
        with suppress(ConfigurationError):
            result = result.physical(MESH_ERROR)
        layout = ("ee;hh;ps;ff" if side_by_side else "e;h;p;s;f") if whole else "e;h;f"
        heights = [_HEIGHTS_MM[row[0]] for row in layout.split(";")]
    with page(width_mm, height_mm or sum(heights)) as figure:
        panels = figure.subplot_mosaic(layout, height_ratios=heights)
        history, spectrum = panels["h"], panels["f"]
        response.time_history(history, result, lane, coordinate, between=shown)
        if coordinate.startswith(MESH_FORCE):
            response.contact_strip(history, result, lane, coordinate)
        few_ticks(history, None if teeth else 6, 6)
        remark(panels["e" if teeth else "h"], in_words(result, place_of(result, lane)))
        foot = [form_in_words(result)]
        if whole:
            curve, _ = response.phase_portrait(panels["p"], result, lane, coordinate)
            points = response.poincare_section(panels["s"], result, lane, coordinate)
            late = f", black: last {SHOWN_REVOLUTIONS} revolutions" if teeth and shown[0] else ""
            remark(panels["p"], f"last {round(last)} mesh periods{late}")
            if teeth:
                repeats, n = response.repeats_after(result, lane), excitation.excitation_period
                period = f"period {repeats // n} of the excitation, {repeats} mesh periods"
                remark(panels["s"], period if repeats else "")
                late_curve = np.array(curve.get_data())[:, result[TIME] >= shown[0]]
                panels["p"].plot(*late_curve, "k", linewidth=0.4)
                curve.set(color="0.85", linewidth=0.3, zorder=1, rasterized=True)
                foot.append("points once a mesh period (grey) and once an excitation period (red)")
            else:
                # A lane may have come to rest on its orbit within the longer of the two records.
                remark(panels["s"], f"last {np.size(points.get_xdata())} mesh periods")
            for name in "ps":
                few_ticks(panels[name], 6, 6)
        variable = acceleration_of(coordinate) if whole else coordinate
        look: dict[str, Any] = {"highest": HIGHEST_ORDER} if teeth else {}
        lines = response.amplitude_spectrum(spectrum, result, lane, variable, **look)
        if teeth:
            _pitch_error_above(panels["e"], history, result, lane, excitation)
            resolved = round(last) >= excitation.excitation_period
            _in_shaft_orders(spectrum, lines, excitation, resolved)
        letter(panels.values())
        footnote(figure, "\n".join(filter(None, foot)))
        figure.align_ylabels([*panels.values()])
    return figure


def _pitch_error_above(
    top: Axes, history: Axes, result: Result, lane: int, excitation: Excitation
) -> None:
    """Draw the pitch error over the time history, and let both count revolutions.

    Of the driving gear, with ticks for its teeth. A record ends where tooth 0 comes into mesh
    again, at the last of the shown revolutions.
    """
    response.time_history(top, result, lane, MESH_ERROR, between=history.get_xlim())
    top.sharex(history)
    few_ticks(top, None, 4)
    teeth = excitation.driving_teeth
    begin = float(history.get_xlim()[1]) - SHOWN_REVOLUTIONS * teeth
    for axes in (top, history):
        every = _ticks(axes.xaxis, teeth / 2, 1.0, begin)
        axes.xaxis.set_major_formatter(lambda x, _: f"{(x - begin) / teeth:.3g}")
    ticks = "a tick for each tooth" if every == 1 else f"a tick every {every} teeth"
    history.set_xlabel(f"Revolutions of the driving gear, {ticks}")
    remark(history, f"excitation period: {excitation.excitation_period} mesh periods")
    top.set_xlabel("")
    top.tick_params(labelbottom=False)


def _in_shaft_orders(
    axes: Axes, lines: LineCollection, excitation: Excitation, resolved: bool
) -> None:
    """Let a spectrum over mesh orders count those of the driving shaft, and colour its lines.

    Ticks with a number are multiples of the mesh order, those between them sidebands of the driving
    shaft. A line has the colour of the shaft whose multiple it is, and is pale where it is that of
    neither, or of a record that does not hold a period of the excitation and resolves none.
    """
    period, driving, driven = excitation
    segments = np.array(lines.get_segments())
    multiples = segments[:, :1, 0] * np.array([driven, driving, 1])
    near = np.abs(multiples - np.rint(multiples)) < 1e-6
    # The last column that holds decides: the mesh is a multiple of both shafts. A gear without
    # errors has none in the period.
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
    """Set ticks at multiples of both, fine ones at every one, tenth or hundredth, as returned."""
    low, high = axis.get_view_interval()
    every = 10 ** max(0, ceil(log10((high - low) / fine / MOST_TICKS)))
    axis.set_major_locator(MultipleLocator(coarse, begin))
    axis.set_minor_locator(MultipleLocator(fine * every, begin))
    return int(every)
