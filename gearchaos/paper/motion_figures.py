"""Figures 5, 6 and 8 to 15: accelerations, spectra, and the motion at six pitch errors."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.figures import phase_portrait, poincare_section, time_history
from gearchaos.figures.page import Page, column, few_ticks, letter, remark
from gearchaos.figures.panel import legend_above
from gearchaos.figures.response import COORDINATE, coordinates_of, samples_per_period
from gearchaos.figures.style import BLACK, BLUE, FONT_PT, SMALL_FONT_PT, VERMILION
from gearchaos.paper.computation import Reproduction, lane_of, largest_acceleration
from gearchaos.paper.published import Printed, published
from gearchaos.records.amplitude_spectrum import spectral_lines
from gearchaos.results.response_variables import TIME, acceleration_of
from gearchaos.results.result import Result

HIGHEST_ORDER = 8
TIME_LABEL = r"Time in mesh periods, $\Omega\tau/2\pi$"
PANEL_MM = 24.0
SHOWN_PERIODS = 4.0
"""Mesh periods of the histories of figures 5 and 14."""

LONG_HISTORY = 16.0
"""Mesh periods of the histories of figures 8 to 13."""

Curves: TypeAlias = Sequence[tuple[float, str, float]]
"""Pitch errors, the colours of their curves, and how far the lines of their spectra step aside."""

WITHOUT_AND_WITH: Curves = ((0.0, BLUE, -0.07), (1.0, VERMILION, 0.07))
"""What figures 5 and 6 compare."""


def accelerations_page(found: Reproduction, *, growing: bool = False) -> Page:
    """Draw the accelerations of all coordinates without and with pitch error (figure 5).

    If ``growing``, the torsional one at growing pitch errors (figure 14).
    """
    response = found.response
    with _stack(response, growing, 0.0) as (figure, panels):
        for axes, name, curves in panels:
            for p, color, _ in curves:
                place = response, lane_of(response, p), acceleration_of(name)
                drawn = time_history(axes, *place, between=(0.0, SHOWN_PERIODS))
                drawn.set(color=color, linewidth=0.9, label=f"$P$ = {p:g}")
                if growing:
                    largest = largest_acceleration(response, p)
                    axes.axhline(largest, color=VERMILION, linewidth=0.6, dashes=(4, 2))
                    remark(axes, f"$P$ = {p:g}, largest value {largest:.3f}")
            few_ticks(axes)
        if not growing:
            legend_above(figure.axes[0], figure.axes[0].lines)
        letter(figure.axes)
        axes.set_xlabel(TIME_LABEL)
        figure.supylabel("Acceleration (dimensionless)", fontsize=FONT_PT)
    return figure


def spectra_page(found: Reproduction, *, growing: bool = False) -> Page:
    """Draw the amplitude spectra of those accelerations (figures 6 and 15)."""
    response = found.response
    with _stack(response, growing, 6.0) as (figure, panels):
        for at, (axes, name, curves) in zip("abcdefgh", panels, strict=False):
            inside: dict[str, Any] = {"transform": axes.transAxes, "va": "top"}
            for p, color, shift in curves:
                _stems(axes, response, p, name, color, shift).set_label(f"$P$ = {p:g}")
                if growing:
                    text = f"$P$ = {p:g}"
                    axes.text(0.985, 0.93, text, ha="right", fontsize=SMALL_FONT_PT, **inside)
            axes.set_yscale("log")
            axes.text(0.02, 0.94, f"({at})", fontweight="bold", **inside)
        first, *_ = figure.axes
        if not growing:
            first.legend(frameon=False, loc="upper right", ncols=2, handletextpad=0.0)
        # The paper's frequency is in cycles per unit of tau.
        period = float(response["mesh_period"][0])
        to_and_fro = (lambda order: order / period, lambda frequency: frequency * period)
        first.tick_params(axis="x", which="both", top=False)
        above = first.secondary_xaxis("top", functions=to_and_fro)
        above.set_xlabel(r"Frequency in cycles per unit of $\tau$")
        axes.set_xlabel("Frequency over mesh frequency")
        figure.supylabel("Amplitude of the acceleration (dimensionless)", fontsize=FONT_PT)
    return figure


def motion_page(found: Reproduction, shown: Printed) -> Page:
    """Draw history, phase portrait and Poincare section at one pitch error (figures 8 to 13)."""
    at_rest, from_contact = found.motions_at(shown.pitch_error)
    result, label = found.motions, at_rest
    # Unless only the start from the contact flank comes to the motion that the paper shows.
    if at_rest != shown.motion == from_contact:
        result, label = found.motions_from_contact, f"{from_contact}, from the contact flank"
    lane = lane_of(result, shown.pitch_error)
    with column(86.0) as figure:
        look: dict[str, Any] = {"height_ratios": (0.8, 1.0), "gridspec_kw": {"wspace": 0.1}}
        history, portrait, section = figure.subplot_mosaic("hh;ps", **look).values()
        end = float(result[TIME][-1])
        time_history(history, result, lane, between=(max(0.0, end - LONG_HISTORY), end))
        phase_portrait(portrait, result, lane)
        poincare_section(section, result, lane)
        history.set(xlabel=TIME_LABEL, ylabel=r"$\delta_5$ (dimensionless)")
        few_ticks(history, 8, 5)
        for axes in (portrait, section):
            axes.set(xlabel=r"$\delta_5$", ylabel=r"$\delta_5'$")
            few_ticks(axes, 5, 6)
        letter((history, portrait, section))
        remark(history, f"$P$ = {shown.pitch_error:g}, {label}")
        remark(section, f"{result['section_delta_5'].shape[1]} points")
    return figure


@contextmanager
def _stack(
    response: Result, growing: bool, margin_mm: float
) -> Iterator[tuple[Page, list[tuple[Axes, str, Curves]]]]:
    """Make panels one above another, each with the coordinate and the curves that it is to show.

    Those are all without and with pitch error, or the torsional one at growing ones.
    """
    shown: list[tuple[str, Curves]] = [(n, WITHOUT_AND_WITH) for n in coordinates_of(response)]
    if growing:
        steps = published().increments.pitch_errors
        shown = [(COORDINATE, [(p, BLACK, 0.0)]) for p in steps]
    height_mm = PANEL_MM * len(shown) + margin_mm + (8.0 if growing else 12.0)
    with column(height_mm) as figure:
        panels = figure.subplots(len(shown), 1, sharex=True, sharey=growing)
        yield figure, [(axes, *one) for axes, one in zip(panels, shown, strict=True)]
        for axes, (name, _) in zip(panels, shown, strict=True):
            axes.set_ylabel(response.attributes(acceleration_of(name))["symbol"])
            axes.label_outer()
        figure.align_ylabels(panels)


def _stems(
    axes: Axes, result: Result, pitch_error: float, name: str, color: str, shift: float
) -> Line2D:
    """Draw an amplitude spectrum as lines with heads, which are returned."""
    values = result[acceleration_of(name)][lane_of(result, pitch_error), :-1]
    lines = spectral_lines(values, samples_per_period(result))
    top = float(lines.amplitude[1:].max())
    seen = (lines.order > 0.0) & (lines.order <= HIGHEST_ORDER) & (lines.amplitude > 1e-4 * top)
    order, amplitude = lines.order[seen] + shift, lines.amplitude[seen]
    axes.vlines(order, 1e-12, amplitude, color=color, linewidth=0.9)
    (heads,) = axes.plot(order, amplitude, "o", color=color, ms=2.2, mew=0.0)
    # Logarithms of the common scale of a panel: three decades below its highest line.
    bottom, highest = axes.get_ylim() if len(axes.lines) > 1 else (top, top)
    axes.set_ylim(min(bottom, 3e-4 * top), max(highest, 4.0 * top))
    axes.set_xlim(0.0, HIGHEST_ORDER + 0.5)
    return heads
