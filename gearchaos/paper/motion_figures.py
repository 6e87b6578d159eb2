"""Figures 5, 6 and 8 to 15: accelerations, spectra, and the motion at six pitch errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from gearchaos.figures.lanes import legend_above
from gearchaos.figures.page import Page
from gearchaos.figures.response import phase_portrait, poincare_section, time_history
from gearchaos.figures.response_lane import coordinates_of, samples_per_period
from gearchaos.figures.style import FONT_PT, POINTS
from gearchaos.paper.computation import Reproduction, lane_of, largest_acceleration
from gearchaos.paper.panels import (
    SHOWN_PERIODS,
    WITH_ERROR,
    WITHOUT_ERROR,
    few_ticks,
    letter,
    letter_inside,
    page,
    remark,
    remark_inside,
)
from gearchaos.paper.published import Published, ShownMotion
from gearchaos.paper.stages import motion_at
from gearchaos.records.amplitude_spectrum import spectral_lines
from gearchaos.results.response_variables import TIME, acceleration_of
from gearchaos.results.result import Result

HIGHEST_ORDER = 8
TIME_LABEL = r"Time in mesh periods, $\Omega\tau/2\pi$"
ORDER_LABEL = "Frequency over mesh frequency"
ACCELERATION_LABEL = "Acceleration (dimensionless)"
AMPLITUDE_LABEL = "Amplitude of the acceleration (dimensionless)"
PANEL_MM = 24.0
LONG_HISTORY = 16.0
"""Mesh periods of the histories of figures 8 to 13."""


def accelerations_page(printed: Published, found: Reproduction) -> Page:
    """Draw the accelerations of all coordinates without and with pitch error (figure 5)."""
    del printed
    result = found.response
    names = coordinates_of(result)
    with page(PANEL_MM * len(names) + 12.0) as figure:
        panels = figure.subplots(len(names), 1, sharex=True)
        for axes, name in zip(panels, names, strict=True):
            for p, color in ((0.0, WITHOUT_ERROR), (1.0, WITH_ERROR)):
                line = time_history(
                    axes,
                    result,
                    lane_of(result, p),
                    acceleration_of(name),
                    between=(0.0, SHOWN_PERIODS),
                )
                line.set(color=color, linewidth=0.9, label=f"$P$ = {p:g}")
            _label_small(axes, result, name)
        letter(panels)
        legend_above(panels[0], panels[0].lines)
        _close(figure, panels, TIME_LABEL, ACCELERATION_LABEL)
    return figure


def spectra_page(printed: Published, found: Reproduction) -> Page:
    """Draw the amplitude spectra of those accelerations (figure 6)."""
    del printed
    result = found.response
    names = coordinates_of(result)
    with page(PANEL_MM * len(names) + 18.0) as figure:
        panels = figure.subplots(len(names), 1, sharex=True)
        for axes, name in zip(panels, names, strict=True):
            for p, color, shift in ((0.0, WITHOUT_ERROR, -0.07), (1.0, WITH_ERROR, 0.07)):
                _stems(axes, result, lane_of(result, p), name, color, shift, f"$P$ = {p:g}")
            axes.set_yscale("log")
            _label_small(axes, result, name)
        _frequency_axis(panels, result)
        letter_inside(panels)
        panels[0].legend(frameon=False, loc="upper right", ncols=2, handletextpad=0.0)
        _close(figure, panels, ORDER_LABEL, AMPLITUDE_LABEL)
    return figure


def motion_page(printed: Published, found: Reproduction, shown: ShownMotion) -> Page:
    """Draw history, phase portrait and Poincare section at one pitch error (figures 8 to 13)."""
    del printed
    result, start = shown_response(found, shown)
    lane = lane_of(result, shown.pitch_error)
    label = motion_at(result, shown.pitch_error)
    with page(86.0) as figure:
        grid = figure.add_gridspec(2, 2, height_ratios=(0.8, 1.0))
        history = figure.add_subplot(grid[0, :])
        portrait, section = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
        end = float(result[TIME][-1])
        time_history(history, result, lane, between=(max(0.0, end - LONG_HISTORY), end))
        phase_portrait(portrait, result, lane)
        poincare_section(section, result, lane)
        history.set_xlabel(TIME_LABEL)
        history.set_ylabel(r"$\delta_5$ (dimensionless)")
        for axes in (portrait, section):
            axes.set_xlabel(r"$\delta_5$")
            axes.set_ylabel(r"$\delta_5'$")
            few_ticks(axes, 4, 5)
        few_ticks(history, 8, 5)
        letter((history, portrait, section))
        begun = "" if start == "rest" else ", from the contact flank"
        remark(history, f"$P$ = {shown.pitch_error:g}, {label}{begun}")
        points = result["section_delta_5"].shape[1]
        remark(section, f"{points} points")
    return figure


def shown_response(found: Reproduction, shown: ShownMotion) -> tuple[Result, str]:
    """Return the response that a figure shows, and the kind of its start.

    At rest as everywhere, unless only the start from the contact flank comes to the motion that
    the paper shows.
    """
    p = shown.pitch_error
    if motion_at(found.motions, p) != shown.motion == motion_at(found.motions_from_contact, p):
        return found.motions_from_contact, "contact"
    return found.motions, "rest"


def growing_accelerations_page(printed: Published, found: Reproduction) -> Page:
    """Draw the torsional acceleration at growing pitch errors (figure 14)."""
    result, values = found.response, printed.increments.pitch_errors
    with page(PANEL_MM * len(values) + 8.0) as figure:
        panels = figure.subplots(len(values), 1, sharex=True, sharey=True)
        for axes, p in zip(panels, values, strict=True):
            time_history(
                axes,
                result,
                lane_of(result, p),
                acceleration_of("delta_5"),
                between=(0.0, SHOWN_PERIODS),
            ).set_linewidth(0.9)
            largest = largest_acceleration(result, p)
            axes.axhline(largest, color=WITH_ERROR, linewidth=0.6, dashes=(4, 2))
            _label_small(axes, result, "delta_5")
            remark(axes, f"$P$ = {p:g}, largest value {largest:.3f}")
        letter(panels)
        _close(figure, panels, TIME_LABEL, ACCELERATION_LABEL)
    return figure


def growing_spectra_page(printed: Published, found: Reproduction) -> Page:
    """Draw the spectra of the torsional acceleration at growing pitch errors (figure 15)."""
    result, values = found.response, printed.increments.pitch_errors
    with page(PANEL_MM * len(values) + 14.0) as figure:
        panels = figure.subplots(len(values), 1, sharex=True, sharey=True)
        for axes, p in zip(panels, values, strict=True):
            _stems(axes, result, lane_of(result, p), "delta_5", POINTS, 0.0, "")
            axes.set_yscale("log")
            _label_small(axes, result, "delta_5")
            remark_inside(axes, f"$P$ = {p:g}")
        _frequency_axis(panels, result)
        letter_inside(panels)
        _close(figure, panels, ORDER_LABEL, AMPLITUDE_LABEL)
    return figure


def _stems(
    axes: Axes, result: Result, lane: int, name: str, color: str, shift: float, label: str
) -> None:
    values = result[acceleration_of(name)][lane, :-1]
    lines = spectral_lines(values, samples_per_period(result))
    top = float(lines.amplitude[1:].max())
    seen = (lines.order > 0.0) & (lines.order <= HIGHEST_ORDER) & (lines.amplitude > 1e-4 * top)
    order, amplitude = lines.order[seen] + shift, lines.amplitude[seen]
    axes.vlines(order, 1e-12, amplitude, color=color, linewidth=0.9)
    axes.plot(order, amplitude, "o", color=color, markersize=2.2, mew=0.0, label=label)
    # Logarithms of the common scale of a panel: three decades below its highest line.
    bottom, highest = axes.get_ylim() if len(axes.lines) > 1 else (top, top)
    axes.set_ylim(min(bottom, 3e-4 * top), max(highest, 4.0 * top))
    axes.set_xlim(0.0, HIGHEST_ORDER + 0.5)


def _label_small(axes: Axes, result: Result, name: str) -> None:
    symbol = result.attributes(acceleration_of(name))["symbol"]
    axes.set_ylabel(symbol)
    axes.set_xlabel("")


def _frequency_axis(panels: Sequence[Axes], result: Result) -> None:
    """Put the paper's frequency, in cycles per unit of tau, above the first panel."""
    period = float(result["mesh_period"][0])
    first = panels[0]
    first.tick_params(axis="x", which="both", top=False)

    def frequency(order: NDArray[np.float64]) -> NDArray[np.float64]:
        return order / period

    def order(frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        return frequency * period

    above = first.secondary_xaxis("top", functions=(frequency, order))  # type: ignore[arg-type]
    above.set_xlabel(r"Frequency in cycles per unit of $\tau$")


def _close(figure: Page, panels: Sequence[Axes], x_label: str, y_label: str) -> None:
    for axes in panels:
        logarithmic = axes.get_yscale() == "log"
        few_ticks(axes, None if logarithmic else 5, None if logarithmic else 4)
    panels[-1].set_xlabel(x_label)
    figure.supylabel(y_label, fontsize=FONT_PT)
    figure.align_ylabels(panels)
