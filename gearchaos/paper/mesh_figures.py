"""Figures 3 and 4: what the mesh imposes over one mesh period, its error and its stiffness."""

from __future__ import annotations

import numpy as np

from gearchaos.figures.page import Page, column, few_ticks
from gearchaos.figures.style import BLACK, BLUE, GREY, ORANGE
from gearchaos.gear import pitch_error
from gearchaos.gear.mesh_stiffness import FloatArray
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.our_numbers import contact_line_stiffness, printed_series
from gearchaos.paper.published import Published

POINTS_OF_A_CURVE = 1000
CYCLE_LABEL = r"Mesh cycle, $\Omega\tau/2\pi$"


def pitch_error_page(printed: Published, found: Reproduction) -> Page:
    """Draw one pitch error over one mesh cycle, with its two components (figure 3)."""
    del printed
    amplitude = found.group("pitch_error_amplitude")
    beta = np.radians(found.group("base_helix_angle_deg"))
    cycle = np.linspace(0.0, 1.0, POINTS_OF_A_CURVE + 1)
    error = pitch_error.error(cycle, mesh_frequency=2.0 * np.pi, amplitude=amplitude)
    with column(58.0) as figure:
        axes = figure.subplots()
        axes.axhline(0.0, color=GREY, linewidth=0.5)
        for label, share, color, dashes in (
            (r"$e$, along the line of action", 1.0, BLACK, ()),
            (r"$e\,\cos\beta_b$, transverse", np.cos(beta), BLUE, (5, 2)),
            (r"$e\,\sin\beta_b$, axial", np.sin(beta), ORANGE, (1.5, 1.5)),
        ):
            axes.plot(cycle, share * error, label=label, color=color, linewidth=1.0, dashes=dashes)
        axes.set_xlim(0.0, 1.0)
        axes.margins(y=0.08)
        axes.set_xlabel(CYCLE_LABEL)
        axes.set_ylabel("Pitch error, $e/b'$ (dimensionless)")
        few_ticks(axes, 5, 6)
        axes.legend(frameon=False, loc="upper right")
    return figure


def mesh_stiffness_page(printed: Published, found: Reproduction) -> Page:
    """Draw the mesh stiffness of the contact lines and its Fourier fit (figure 4)."""
    mean = printed.numbers["mean_stiffness"].value
    scale = found.group("stiffness_variation_scale")
    cycle = np.arange(POINTS_OF_A_CURVE + 1) / POINTS_OF_A_CURVE

    def closed(table: FloatArray) -> FloatArray:
        return mean * np.append(table, table[0])

    trapezoid = closed(contact_line_stiffness(printed).table(POINTS_OF_A_CURVE))
    series = closed(printed_series(printed).table(POINTS_OF_A_CURVE))
    computed = mean + scale * (series - mean)
    with column(62.0) as figure:
        axes = figure.subplots()
        axes.axhline(mean, color=GREY, linewidth=0.5)
        axes.annotate(
            "$k_m$", (0.985, mean), (0, 2), textcoords="offset points", ha="right", fontsize=7
        )
        for label, values, color, width, dashes in (
            ("contact lines (eqs 15–18)", trapezoid, BLACK, 0.8, ()),
            ("Fourier fit (Table 2)", series, BLUE, 1.2, (5, 2)),
            (f"as computed, variation times {scale:.3g}", computed, ORANGE, 1.0, (1.5, 1.5)),
        ):
            axes.plot(cycle, values, color=color, lw=width, dashes=dashes, label=label)
        axes.set_xlim(0.0, 1.0)
        axes.margins(y=0.08)
        axes.set_xlabel(CYCLE_LABEL)
        axes.set_ylabel(r"Mesh stiffness $k$ (N/(µm$\,$mm))")
        few_ticks(axes, 5, 6)
        axes.legend(
            frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1, borderpad=0.0
        )
    return figure
