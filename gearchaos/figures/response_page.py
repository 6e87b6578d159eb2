"""A page for one lane of a response: history, phase portrait, Poincare section and spectrum."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.ticker import AutoMinorLocator, MaxNLocator

from gearchaos.errors import ConfigurationError
from gearchaos.figures.labels import plain
from gearchaos.figures.page import Page
from gearchaos.figures.response import (
    amplitude_spectrum,
    phase_portrait,
    poincare_section,
    time_history,
)
from gearchaos.figures.response_lane import COORDINATE, coordinates_of, repeats_after
from gearchaos.figures.style import (
    DOUBLE_COLUMN_MM,
    MM_PER_INCH,
    SMALL_FONT_PT,
    STYLE,
)
from gearchaos.results.response_variables import TIME, acceleration_of
from gearchaos.results.result import Result

SIDE_BY_SIDE_MM = 120.0
"""Width from which on two panels stand side by side."""

SHOWN_PERIODS = 12
"""Mesh periods at the end of the record that the time history shows."""

_PANEL_HEIGHT_MM = 52.0


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
    any other with that of Hann.

    Parameters
    ----------
    result : Result
        A response.
    lane : int
        Number of the lane, from 0.
    coordinate : str, optional
        Such as ``"delta_1"``; default ``"delta_5"``, the torsion.
    width_mm, height_mm : float
        Size of the page; 180 mm is two columns of a journal, and at 85 mm, one column, the panels
        stand one above the other.

    Returns
    -------
    Page

    Raises
    ------
    ConfigurationError
        If the result is no response, has no such lane or coordinate, or the lane diverged.
    """
    coordinate = _known_coordinate(result, coordinate)
    columns = 2 if width_mm >= SIDE_BY_SIDE_MM else 1
    height = height_mm or _PANEL_HEIGHT_MM * 4 / columns
    with mpl.rc_context(STYLE):
        figure = Page(figsize=(width_mm / MM_PER_INCH, height / MM_PER_INCH), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(4 // columns, columns, squeeze=False)
        history, portrait, section, spectrum = panels.ravel()
        last = result[TIME][-1]
        between = (max(0.0, last - SHOWN_PERIODS), last)
        time_history(history, result, lane, coordinate, between=between)
        phase_portrait(portrait, result, lane, coordinate)
        poincare_section(section, result, lane, coordinate)
        amplitude_spectrum(
            spectrum,
            result,
            lane,
            acceleration_of(coordinate),
            window="rectangular" if repeats_after(result, lane) else "hann",
            logarithmic=True,
        )
        for axes, letter in zip(panels.ravel(), "abcd", strict=True):
            axes.set_title(f"({letter})", loc="left")
        for axes in (history, portrait, section):
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
                axis.set_minor_locator(AutoMinorLocator())
        points = result[f"section_{coordinate}"].shape[1]
        # A lane may have come to rest on its orbit within the longer of the two.
        for axes, words in (
            (history, lane_in_words(result, lane)),
            (portrait, f"last {round(float(last))} mesh periods"),
            (section, f"last {points} mesh periods"),
        ):
            axes.set_title(words, loc="right", fontsize=SMALL_FONT_PT, fontweight="normal")
        figure.align_ylabels(panels)
        # Ticks are made at the first drawing, in the style of that moment.
        figure.draw_without_rendering()
    return figure


def lane_in_words(result: Result, lane: int) -> str:
    """Return parameter and value of a lane, such as ``$P$ = 5.86``, and its start if several."""
    attributes = result.attributes(result.axis)
    name = str(attributes.get("symbol") or plain(result.axis))
    units = str(attributes["units"])
    text = f"{name} = {result[result.axis][lane]:.6g}{'' if units == '1' else f' {plain(units)}'}"
    return f"{text}, start {result['start'][lane]}" if "start" in result else text


def lane_in_a_name(result: Result, lane: int) -> str:
    """Return parameter and value of a lane for the name of a file: ``pitch_error_5.86``."""
    text = f"{result.axis}_{result[result.axis][lane]:.12g}"
    return f"{text}_start_{result['start'][lane]}" if "start" in result else text


def _known_coordinate(result: Result, coordinate: str | None) -> str:
    if coordinate is None:
        return COORDINATE
    known = coordinates_of(result)
    if known and coordinate not in known:
        raise ConfigurationError(
            f"no coordinate {coordinate!r} in the response; it has {', '.join(known)}"
        )
    return coordinate
