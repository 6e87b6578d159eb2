"""Figures 3 and 4: what the mesh imposes over one mesh period, its error and its stiffness."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from matplotlib.axes import Axes

from gearchaos.figures.page import Page, column, few_ticks
from gearchaos.figures.style import BLACK, BLUE, GREY, ORANGE
from gearchaos.gear.mesh_stiffness import series_table
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.our_numbers import contact_line_stiffness, printed_coefficients
from gearchaos.paper.published import published

CYCLE = np.arange(1001) / 1000
"""Mesh phases, in parts of the mesh period."""


def pitch_error_page(found: Reproduction) -> Page:
    """Draw one pitch error over one mesh cycle, with its two components (figure 3)."""
    amplitude = found.group("pitch_error_amplitude")
    beta = np.radians(found.group("base_helix_angle_deg"))
    error = amplitude * np.sin(2.0 * np.pi * CYCLE)  # eq. 14
    with _cycle(58.0, 0.0, r"Pitch error, $e/b\prime$ (dimensionless)") as (figure, axes):
        for label, share, look in (
            (r"$e$, along the line of action", 1.0, {"color": BLACK}),
            (r"$e\,\cos\beta_b$, transverse", np.cos(beta), {"color": BLUE, "dashes": (5, 2)}),
            (r"$e\,\sin\beta_b$, axial", np.sin(beta), {"color": ORANGE, "dashes": (1.5, 1.5)}),
        ):
            axes.plot(CYCLE, share * error, label=label, linewidth=1.0, **look)
        axes.legend(frameon=False, loc="upper right")
    return figure


def mesh_stiffness_page(found: Reproduction) -> Page:
    """Draw the mesh stiffness of the contact lines and its Fourier fit (figure 4)."""
    mean = published().numbers["mean_stiffness"].value
    scale = found.group("stiffness_variation_scale")
    points = CYCLE.size - 1
    tables = contact_line_stiffness().table(points), series_table(printed_coefficients(), points)
    trapezoid, series = (mean * np.append(table, table[0]) for table in tables)
    computed = mean + scale * (series - mean)
    with _cycle(62.0, mean, r"Mesh stiffness $k$ (N/(µm$\,$mm))") as (figure, axes):
        axes.annotate(
            "$k_m$", (0.985, mean), (0, 2), textcoords="offset points", ha="right", fontsize=7
        )
        for label, values, color, width, dashes in (
            ("contact lines (eqs 15–18)", trapezoid, BLACK, 0.8, ()),
            ("Fourier fit (Table 2)", series, BLUE, 1.2, (5, 2)),
            (f"as computed, variation times {scale:.3g}", computed, ORANGE, 1.0, (1.5, 1.5)),
        ):
            axes.plot(CYCLE, values, color=color, lw=width, dashes=dashes, label=label)
        axes.legend(
            frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1, borderpad=0.0
        )
    return figure


@contextmanager
def _cycle(height_mm: float, level: float, label: str) -> Iterator[tuple[Page, Axes]]:
    """Make a page with axes over one mesh cycle, and a line at the level about which it turns."""
    with column(height_mm) as figure:
        axes = figure.subplots()
        axes.axhline(level, color=GREY, linewidth=0.5)
        yield figure, axes
        axes.set(xlim=(0.0, 1.0), xlabel=r"Mesh cycle, $\Omega\tau/2\pi$", ylabel=label)
        axes.margins(y=0.08)
        few_ticks(axes, 5, 6)
