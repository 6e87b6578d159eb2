"""A page for one lane of a response: history, phase portrait, Poincare section and spectrum."""

from gearchaos.figures.labels import form_in_words, in_words, place_of
from gearchaos.figures.page import Page, few_ticks, footnote, letter, page, remark
from gearchaos.figures.response import (
    amplitude_spectrum,
    phase_portrait,
    poincare_section,
    time_history,
)
from gearchaos.figures.response_lane import COORDINATE, coordinates_of, repeats_after
from gearchaos.figures.style import DOUBLE_COLUMN_MM
from gearchaos.figures.teeth import teeth_page
from gearchaos.results.excitation import excitation_of
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
    any other with that of Hann. Where teeth have errors of their own, it is that of `teeth_page`.

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
    coordinate = COORDINATE if coordinate is None else coordinate
    whole = coordinate in coordinates_of(result)
    columns, count = 2 if width_mm >= SIDE_BY_SIDE_MM else 1, 4 if whole else 2
    if excitation_of(result.metadata).of_teeth:
        return teeth_page(result, lane, coordinate, columns, width_mm, height_mm)
    with page(width_mm, height_mm or _PANEL_HEIGHT_MM * count / columns) as figure:
        panels = figure.subplots(count // columns, columns, squeeze=False)
        history, *planes, spectrum = panels.ravel()
        last = result[TIME][-1]
        time_history(
            history, result, lane, coordinate, between=(max(0.0, last - SHOWN_PERIODS), last)
        )
        texts = [in_words(result, place_of(result, lane))]
        if whole:
            phase_portrait(planes[0], result, lane, coordinate)
            poincare_section(planes[1], result, lane, coordinate)
            points = result.lanes(f"section_{coordinate}").shape[1]
            # A lane may have come to rest on its orbit within the longer of the two records.
            texts += [f"last {periods} mesh periods" for periods in (round(float(last)), points)]
        amplitude_spectrum(
            spectrum,
            result,
            lane,
            acceleration_of(coordinate) if whole else coordinate,
            window="rectangular" if repeats_after(result, lane) else "hann",
            logarithmic=True,
        )
        letter(panels.ravel())
        for axes, words in zip((history, *planes), texts, strict=True):
            few_ticks(axes, 6, 6)
            remark(axes, words)
        footnote(figure, form_in_words(result))
        figure.align_ylabels(panels)
    return figure
