"""Figures 3 and 4: what the mesh imposes over one mesh period, its error and its stiffness."""

from __future__ import annotations

import numpy as np

from gearchaos.configuration import groups_at
from gearchaos.figures.page import Page
from gearchaos.figures.style import EXPONENT, POINTS, POSITIVE, REFERENCE
from gearchaos.gear.mesh_stiffness import FloatArray
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.our_numbers import contact_line_stiffness, printed_series
from gearchaos.paper.panels import few_ticks, page
from gearchaos.paper.published import Published

POINTS_OF_A_CURVE = 1000
CYCLE_LABEL = r"Mesh cycle, $\Omega\tau/2\pi$"


def pitch_error_page(printed: Published, found: Reproduction) -> Page:
    """Draw one pitch error over one mesh cycle, with its two components (figure 3)."""
    del printed
    groups = groups_at(found.config, {})
    amplitude, angle = groups.pitch_error_amplitude, groups.base_helix_angle_deg
    cycle = np.linspace(0.0, 1.0, POINTS_OF_A_CURVE + 1)
    error = amplitude * np.sin(2.0 * np.pi * cycle)  # eq. 14
    with page(58.0) as figure:
        axes = figure.subplots()
        axes.axhline(0.0, color=REFERENCE, linewidth=0.5)
        beta = np.radians(angle)
        for label, share, color, dashes in (
            (r"$e$, along the line of action", 1.0, POINTS, ()),
            (r"$e\,\cos\beta_b$, transverse", np.cos(beta), EXPONENT, (5, 2)),
            (r"$e\,\sin\beta_b$, axial", np.sin(beta), POSITIVE, (1.5, 1.5)),
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
    scale = groups_at(found.config, {}).stiffness_variation_scale
    cycle = np.arange(POINTS_OF_A_CURVE + 1) / POINTS_OF_A_CURVE

    def closed(table: FloatArray) -> FloatArray:
        return mean * np.append(table, table[0])

    trapezoid = closed(contact_line_stiffness(printed).table(POINTS_OF_A_CURVE))
    series = closed(printed_series(printed).table(POINTS_OF_A_CURVE))
    with page(62.0) as figure:
        axes = figure.subplots()
        axes.axhline(mean, color=REFERENCE, linewidth=0.5)
        axes.annotate(
            "$k_m$", (0.985, mean), (0, 2), textcoords="offset points", ha="right", fontsize=7
        )
        axes.plot(cycle, trapezoid, color=POINTS, lw=0.8, label="contact lines (eqs 15–18)")
        axes.plot(
            cycle, series, color=EXPONENT, lw=1.2, dashes=(5, 2), label="Fourier fit (Table 2)"
        )
        axes.plot(
            cycle,
            mean + scale * (series - mean),
            color=POSITIVE,
            lw=1.0,
            dashes=(1.5, 1.5),
            label=f"as computed, variation times {scale:.3g}",
        )
        axes.set_xlim(0.0, 1.0)
        axes.margins(y=0.08)
        axes.set_xlabel(CYCLE_LABEL)
        axes.set_ylabel(r"Mesh stiffness $k$ (N/(µm$\,$mm))")
        few_ticks(axes, 5, 6)
        axes.legend(
            frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1, borderpad=0.0
        )
    return figure
