"""The figures of the paper: mesh cycle, accelerations, spectra, diagram and hop, motions."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes

from gearchaos.arrays import Floats
from gearchaos.figures import bifurcation_page
from gearchaos.figures.page import Page, column, few_ticks, letter, remark
from gearchaos.figures.panel import legend_above
from gearchaos.figures.response import (
    COORDINATE,
    coordinates_of,
    phase_portrait,
    poincare_section,
    samples_per_period,
    time_history,
)
from gearchaos.figures.style import BLACK, BLUE, FONT_PT, GREY, ORANGE, VERMILION
from gearchaos.models.gear_pair.contact_lines import series_table
from gearchaos.outputs.names import TIME, acceleration_of
from gearchaos.paper.computation import Reproduction, lane_of, largest_acceleration
from gearchaos.paper.published import (
    Printed,
    contact_line_stiffness,
    printed_coefficients,
    published,
)
from gearchaos.records.amplitude_spectrum import spectral_lines
from gearchaos.results.reading.result import Result

CYCLE = np.arange(1001) / 1000  # Mesh phases, relative to the mesh period.

HIGHEST_ORDER = 8
TIME_LABEL = r"Time in mesh periods, $\Omega\tau/2\pi$"
PANEL_MM = 27.0
SHOWN_PERIODS = 4.0  # Mesh periods of the histories of figures 5 and 14.
LONG_HISTORY = 16.0  # Mesh periods of the histories of figures 8 to 13.

Curves: TypeAlias = Sequence[tuple[float, str, float]]
"""Pitch errors, the colours of their curves, and the horizontal shifts of their spectra."""

WITHOUT_AND_WITH: Curves = ((0.0, BLUE, -0.07), (1.0, VERMILION, 0.07))
"""The curves that figures 5 and 6 compare."""


def pitch_error_page(found: Reproduction) -> Page:
    """Draw one pitch error over one mesh cycle, with its two components (figure 3)."""
    beta = np.radians(found.group("base_helix_angle_deg"))
    error = found.group("pitch_error_amplitude") * np.sin(2.0 * np.pi * CYCLE)  # eq. 14
    curves = {
        r"$e$, along the line of action": error,
        r"$e\,\cos\beta_b$, transverse": np.cos(beta) * error,
        r"$e\,\sin\beta_b$, axial": np.sin(beta) * error,
    }
    return _over_a_cycle(58.0, 0.0, r"Pitch error, $e/b\prime$ (dimensionless)", curves)


def mesh_stiffness_page(found: Reproduction) -> Page:
    """Draw the mesh stiffness of the contact lines and its Fourier fit (figure 4)."""
    mean = published().numbers.mean_stiffness.value
    scale, points = found.group("stiffness_variation_scale"), CYCLE.size - 1
    tables = contact_line_stiffness().table(points), series_table(printed_coefficients(), points)
    trapezoid, series = (mean * np.append(table, table[0]) for table in tables)
    curves = {
        "contact lines (eqs 15–18)": trapezoid,
        "Fourier fit (Table 2)": series,
        f"as computed, variation times {scale:.3g}": mean + scale * (series - mean),
    }
    return _over_a_cycle(62.0, mean, r"Mesh stiffness $k$ (N/(µm$\,$mm))", curves, "$k_m$")


def _over_a_cycle(
    height_mm: float, level: float, label: str, curves: dict[str, Floats], level_name: str = ""
) -> Page:
    """Draw curves over one mesh cycle, and a line at their mean level."""
    looks = (BLACK, 0.8, ()), (BLUE, 1.2, (5, 2)), (ORANGE, 1.0, (1.5, 1.5))
    with column(height_mm) as figure:
        axes = figure.subplots()
        axes.axhline(level, color=GREY, linewidth=0.5)
        look: dict[str, Any] = {"textcoords": "offset points", "ha": "right", "fontsize": 7}
        axes.annotate(level_name, (0.985, level), (0, 2), **look)
        for (name, values), (color, width, dashes) in zip(curves.items(), looks, strict=True):
            axes.plot(CYCLE, values, color=color, lw=width, dashes=dashes, label=name)
        axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), borderpad=0.0)
        axes.set(xlim=(0.0, 1.0), xlabel=r"Mesh cycle, $\Omega\tau/2\pi$", ylabel=label)
        axes.margins(y=0.08)
        few_ticks(axes, 5, 6)
    return figure


def accelerations_page(found: Reproduction, *, growing: bool = False) -> Page:
    """Draw the accelerations of all coordinates without and with pitch error (figure 5).

    If ``growing``, draw the torsional acceleration at growing pitch errors (figure 14).
    """
    response = found.response
    with _stack(response, growing, "Acceleration") as (figure, panels):
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
        axes.set_xlabel(TIME_LABEL)
    return figure


def spectra_page(found: Reproduction, *, growing: bool = False) -> Page:
    """Draw the amplitude spectra of the curves of `accelerations_page` (figures 6 and 15)."""
    response = found.response
    with _stack(response, growing, "Amplitude of the acceleration") as (figure, panels):
        for axes, name, curves in panels:
            tops = []
            for p, color, shift in curves:
                values = response[acceleration_of(name)][lane_of(response, p), :-1]
                order, amplitude = spectral_lines(values, samples_per_period(response))
                tops.append(float(amplitude[1:].max()))
                seen = (order > 0.0) & (order <= HIGHEST_ORDER) & (amplitude > 1e-4 * tops[-1])
                place = order[seen] + shift, amplitude[seen]
                axes.vlines(place[0], 1e-12, place[1], color=color, linewidth=0.9)
                axes.plot(*place, "o", color=color, ms=2.2, mew=0.0, label=f"$P$ = {p:g}")
                if growing:
                    remark(axes, f"$P$ = {p:g}")
            axes.set(xlim=(0.0, HIGHEST_ORDER + 0.5), yscale="log")
            # Three decades below the highest line.
            axes.set_ylim(3e-4 * min(tops), 4.0 * max(tops))
        axes.set_xlabel("Frequency over mesh frequency")
        # The paper's frequency is in cycles per unit of tau.
        period = float(response["mesh_period"][0])
        to_and_fro = (lambda order: order / period, lambda frequency: frequency * period)
        below = axes.secondary_xaxis(-0.55, functions=to_and_fro)
        below.set_xlabel(r"Frequency in cycles per unit of $\tau$")
    return figure


@contextmanager
def _stack(
    response: Result, growing: bool, label: str
) -> Iterator[tuple[Page, list[tuple[Axes, str, Curves]]]]:
    """Make stacked panels, and yield each with its coordinate and its curves.

    Without ``growing``, one panel per coordinate without and with pitch error; otherwise one panel
    of the torsion per pitch error.
    """
    shown: list[tuple[str, Curves]] = [(n, WITHOUT_AND_WITH) for n in coordinates_of(response)]
    if growing:
        steps = published().increments.pitch_errors
        shown = [(COORDINATE, [(p, BLACK, 0.0)]) for p in steps]
    with column(PANEL_MM * len(shown) + 10.0) as figure:
        panels = figure.subplots(len(shown), 1, sharex=True, sharey=growing)
        yield figure, [(axes, *one) for axes, one in zip(panels, shown, strict=True)]
        for axes, (name, _) in zip(panels, shown, strict=True):
            axes.set_ylabel(response.attributes(acceleration_of(name))["symbol"])
            axes.label_outer()
        if not growing:
            legend_above(panels[0], panels[0].lines)
        letter(panels)
        figure.supylabel(f"{label} (dimensionless)", fontsize=FONT_PT)
        figure.align_ylabels(panels)


def diagram_page(found: Reproduction) -> Page:
    """Draw bifurcation diagram and exponent, with ticks at the paper's boundaries and hop."""
    boundaries = [after.first for _, after in pairwise(published().stages)]
    places = [published().numbers.hop.value, *boundaries]
    return bifurcation_page(found.sweep, stages=found.lanes, marked=("changes in Pan 2021", places))


def hop_page(found: Reproduction) -> Page:
    """Draw the two coexisting motions of the hop, with ticks where starts change between them.

    This is not a figure of the paper.
    """
    places = [after for _, after in found.hop.changes.values()]
    words = f"starts change at {', '.join(f'{place:.2f}' for place in places)}"
    return bifurcation_page(found.hop.sweeps, marked=(words, places))


def motion_page(found: Reproduction, shown: Printed) -> Page:
    """Draw history, phase portrait and Poincare section at one pitch error (figures 8 to 13)."""
    result, lane = found.motions, lane_of(found.motions, shown.pitch_error)
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
        remark(history, f"$P$ = {shown.pitch_error:g}, {found.motion_at(shown.pitch_error)}")
        remark(section, f"{result['section_delta_5'].shape[1]} points")
    return figure
