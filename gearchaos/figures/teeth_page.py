"""The page of a response of a pair whose teeth have errors of their own."""

from __future__ import annotations

import numpy as np

from gearchaos.figures.labels import form_in_words, in_words, place_of
from gearchaos.figures.page import SIDE_BY_SIDE_MM, Page, few_ticks, footnote, letter, page, remark
from gearchaos.figures.response import (
    amplitude_spectrum,
    phase_portrait,
    poincare_section,
    time_history,
)
from gearchaos.figures.response_lane import COORDINATE, coordinates_of, repeats_after
from gearchaos.figures.style import BLACK, DOUBLE_COLUMN_MM
from gearchaos.figures.teeth import FAINT, in_revolutions, in_shaft_orders
from gearchaos.results.excitation import excitation_of
from gearchaos.results.response_variables import MESH_ERROR, TIME, acceleration_of
from gearchaos.results.result import Result

SHOWN_REVOLUTIONS = 2
"""Revolutions of the driving gear at the end of the record that the time histories show."""

HIGHEST_ORDER = 3.5
"""Multiple of the mesh order up to which the spectrum goes."""

_HEIGHTS_MM = {"error": 32.0, "history": 48.0, "portrait": 56.0, "section": 56.0, "spectrum": 56.0}


def teeth_page(
    result: Result,
    lane: int,
    coordinate: str | None = None,
    width_mm: float = DOUBLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw pitch error, time history, phase portrait, section and spectrum of a lane.

    Pitch error and history share an axis in revolutions of the driving gear; the error is in um
    where the unit of lengths is known. Parameters and errors as for `response_page`.
    """
    coordinate = COORDINATE if coordinate is None else coordinate
    excitation = excitation_of(result.metadata)
    whole = coordinate in coordinates_of(result)
    planes = ["portrait", "section"] if whole else []
    rows = [[name] for name in ("error", "history", *planes, "spectrum")]
    if whole and width_mm >= SIDE_BY_SIDE_MM:
        rows = [["error"] * 2, ["history"] * 2, planes, ["spectrum"] * 2]
    heights = [_HEIGHTS_MM[row[0]] for row in rows]
    with page(width_mm, height_mm or sum(heights)) as figure:
        panels = figure.subplot_mosaic(rows, height_ratios=heights)
        last = float(result[TIME][-1])
        between = (max(0.0, last - SHOWN_REVOLUTIONS * excitation.driving_teeth), last)
        top, below = panels["error"], panels["history"]
        error = time_history(top, result, lane, MESH_ERROR, between=between)
        time_history(below, result, lane, coordinate, between=between)
        if excitation.length_scale_um:
            error.set_ydata(excitation.length_scale_um * np.asarray(error.get_ydata()))
            top.relim()
            top.autoscale_view(scalex=False)
            top.set_ylabel("Pitch error of\nthe mesh, $e$ (\N{MICRO SIGN}m)", linespacing=1.2)
        top.sharex(below)
        for axes, most in ((top, 4), (below, 6)):
            few_ticks(axes, None, most)
            in_revolutions(axes, excitation.driving_teeth, SHOWN_REVOLUTIONS)
        top.set_xlabel("")
        top.tick_params(labelbottom=False)
        remark(top, in_words(result, place_of(result, lane)))
        repeats, held, n = repeats_after(result, lane), round(last), excitation.excitation_period
        remark(below, f"excitation period: {n} mesh periods")
        foot = [form_in_words(result)]
        if whole:
            curve, _ = phase_portrait(panels["portrait"], result, lane, coordinate)
            curve.set(color=FAINT, linewidth=0.3, zorder=1, rasterized=True)
            shown = slice(np.searchsorted(result[TIME], between[0]), None)
            motion = (part[shown] for part in curve.get_data())
            panels["portrait"].plot(*motion, color=BLACK, linewidth=0.4)
            poincare_section(panels["section"], result, lane, coordinate)
            points = result.lanes(f"section_{coordinate}").shape[1]
            period = f"period {repeats // n} of the excitation, {repeats} mesh periods"
            late = f", black: last {SHOWN_REVOLUTIONS} revolutions" if between[0] else ""
            remark(panels["portrait"], f"last {held} mesh periods{late}")
            remark(panels["section"], period if repeats else f"last {points} mesh periods")
            foot.append("points once a mesh period (grey) and once an excitation period (red)")
        lines = amplitude_spectrum(
            panels["spectrum"],
            result,
            lane,
            acceleration_of(coordinate) if whole else coordinate,
            highest=HIGHEST_ORDER,
            window="rectangular" if 0 < repeats <= held else "hann",
            logarithmic=True,
        )
        in_shaft_orders(panels["spectrum"], lines, excitation, held)
        for name in planes:
            few_ticks(panels[name], 6, 6)
        letter(panels.values())
        footnote(figure, "\n".join(filter(None, foot)))
        figure.align_ylabels(list(panels.values()))
    return figure
