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
from gearchaos.results.response_variables import MESH_ERROR, MESH_FORCE, TIME, acceleration_of
from gearchaos.results.result import Result
from gearchaos.results.scales import Excitation, excitation_of

SIDE_BY_SIDE_MM = 120.0
"""Width from which on two panels stand side by side."""

SHOWN_PERIODS = 12
"""Mesh periods at the end of the record that the time history shows."""

_PANEL_HEIGHT_MM = 52.0

SHOWN_REVOLUTIONS = 2
"""Revolutions of the driving gear at the end of the record that the time histories show."""

HIGHEST_ORDER = 3.5
"""Multiple of the mesh order up to which the spectrum goes."""

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

    Parameters
    ----------
    result : Result
        A response.
    lane : int
        Number of the lane, from 0, all axes of the result flattened.
    coordinate : str, optional
        Such as ``"delta_1"``; default ``"delta_5"``, the torsion. Of what is no coordinate, such
        as ``"mesh_force_tangential"``, the page has the time history and its own spectrum.
    width_mm, height_mm : float
        Size of the page; 180 mm is two columns of a journal, and at 85 mm, one column, the panels
        stand one above the other.

    Raises
    ------
    FigureError
        If the result is no response, has no such lane or variable, or the lane diverged.
    """
    coordinate = response.COORDINATE if coordinate is None else coordinate
    response.motion_of(result, lane, coordinate)
    whole = coordinate in response.coordinates_of(result)
    if excitation_of(result.metadata).of_teeth:
        return _teeth_page(result, lane, coordinate, (width_mm, height_mm))
    columns, count = 2 if width_mm >= SIDE_BY_SIDE_MM else 1, 4 if whole else 2
    with page(width_mm, height_mm or _PANEL_HEIGHT_MM * count / columns) as figure:
        panels = figure.subplots(count // columns, columns, squeeze=False)
        history, *planes, spectrum = panels.ravel()
        last = result[TIME][-1]
        shown = (max(0.0, last - SHOWN_PERIODS), last)
        response.time_history(history, result, lane, coordinate, between=shown)
        if coordinate.startswith(MESH_FORCE):
            response.contact_strip(history, result, lane, coordinate)
        texts = [in_words(result, place_of(result, lane))]
        if whole:
            response.phase_portrait(planes[0], result, lane, coordinate)
            response.poincare_section(planes[1], result, lane, coordinate)
            points = result.lanes(f"section_{coordinate}").shape[1]
            # A lane may have come to rest on its orbit within the longer of the two records.
            texts += [f"last {periods} mesh periods" for periods in (round(float(last)), points)]
        variable = acceleration_of(coordinate) if whole else coordinate
        response.amplitude_spectrum(spectrum, result, lane, variable, logarithmic=True)
        letter(panels.ravel())
        for axes, words in zip((history, *planes), texts, strict=True):
            few_ticks(axes, 6, 6)
            remark(axes, words)
        footnote(figure, form_in_words(result))
        figure.align_ylabels(panels)
    return figure


def _teeth_page(
    result: Result, lane: int, coordinate: str, size_mm: tuple[float, float | None]
) -> Page:
    """Draw the page of a lane whose teeth have errors of their own."""
    excitation = excitation_of(result.metadata)
    teeth, n = excitation.driving_teeth, excitation.excitation_period
    with suppress(ConfigurationError):
        result = result.physical(MESH_ERROR)
    whole = coordinate in response.coordinates_of(result)
    side_by_side = size_mm[0] >= SIDE_BY_SIDE_MM
    layout = ("ee;hh;ps;ff" if side_by_side else "e;h;p;s;f") if whole else "e;h;f"
    heights = [_HEIGHTS_MM[row[0]] for row in layout.split(";")]
    with page(size_mm[0], size_mm[1] or sum(heights)) as figure:
        panels = [*figure.subplot_mosaic(layout, height_ratios=heights).values()]
        top, below, *planes, spectrum = panels
        time, foot = result[TIME], [form_in_words(result)]
        shown = (max(0.0, time[-1] - SHOWN_REVOLUTIONS * teeth), time[-1])
        response.time_history(top, result, lane, MESH_ERROR, between=shown)
        response.time_history(below, result, lane, coordinate, between=shown)
        if coordinate.startswith(MESH_FORCE):
            response.contact_strip(below, result, lane, coordinate)
        top.sharex(below)
        for axes, most in ((top, 4), (below, 6)):
            few_ticks(axes, None, most)
            _in_revolutions(axes, teeth)
        top.set_xlabel("")
        top.tick_params(labelbottom=False)
        remark(top, in_words(result, place_of(result, lane)))
        remark(below, f"excitation period: {n} mesh periods")
        held, repeats = round(float(time[-1])), response.repeats_after(result, lane)
        if whole:
            portrait, section = planes
            curve, _ = response.phase_portrait(portrait, result, lane, coordinate)
            response.poincare_section(section, result, lane, coordinate)
            late = f", black: last {SHOWN_REVOLUTIONS} revolutions" if shown[0] else ""
            remark(portrait, f"last {held} mesh periods{late}")
            portrait.plot(*np.array(curve.get_data())[:, time >= shown[0]], "k", linewidth=0.4)
            curve.set(color="0.85", linewidth=0.3, zorder=1, rasterized=True)
            if repeats:
                words = f"period {repeats // n} of the excitation, {repeats} mesh periods"
                remark(section, words)
            foot.append("points once a mesh period (grey) and once an excitation period (red)")
        variable = acceleration_of(coordinate) if whole else coordinate
        look: dict[str, Any] = {"highest": HIGHEST_ORDER, "logarithmic": True}
        lines = response.amplitude_spectrum(spectrum, result, lane, variable, **look)
        _in_shaft_orders(spectrum, lines, excitation, held >= n)
        for axes in planes:
            few_ticks(axes, 6, 6)
        letter(panels)
        footnote(figure, "\n".join(filter(None, foot)))
        figure.align_ylabels(panels)
    return figure


def _in_revolutions(axes: Axes, teeth: int) -> None:
    """Let an axis of mesh periods count revolutions of the driving gear, with ticks for its teeth.

    A record ends where tooth 0 comes into mesh again, at the last of the shown revolutions.
    """
    begin = float(axes.get_xlim()[1]) - SHOWN_REVOLUTIONS * teeth
    every = _ticks(axes.xaxis, teeth / 2, 1.0, begin)
    axes.xaxis.set_major_formatter(lambda x, _: f"{(x - begin) / teeth:.3g}")
    ticks = "a tick for each tooth" if every == 1 else f"a tick every {every} teeth"
    axes.set_xlabel(f"Revolutions of the driving gear, {ticks}")


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
