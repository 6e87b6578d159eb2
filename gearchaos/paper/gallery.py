"""The figures of the gallery in the paper's order, each with its name and its caption."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from gearchaos.figures import bifurcation_page
from gearchaos.figures.page import Page
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.hop_figure import hop_page
from gearchaos.paper.mesh_figures import mesh_stiffness_page, pitch_error_page
from gearchaos.paper.motion_figures import (
    accelerations_page,
    growing_accelerations_page,
    growing_spectra_page,
    motion_page,
    spectra_page,
)
from gearchaos.paper.published import Published, published


@dataclass(frozen=True)
class Picture:
    """One figure: the name of its files without ending, its title, its caption, and its drawing."""

    name: str
    title: str
    caption: str
    draw: Callable[[Published, Reproduction], Page]


def staged_page(printed: Published, found: Reproduction) -> Page:
    """Draw bifurcation diagram and Lyapunov chart with the stages behind them (figure 7)."""
    del printed
    return bifurcation_page(found.sweep, stages=True)


def pictures() -> tuple[Picture, ...]:
    """Return all figures, in the paper's order."""
    shown = published().motions
    return (
        Picture(
            "figure_03",
            "Figure 3",
            "One pitch error e(τ), *P* = 1, over one mesh cycle, and its components along the "
            "transverse and the axial direction.",
            pitch_error_page,
        ),
        Picture(
            "figure_04",
            "Figure 4",
            "Mesh stiffness over one mesh cycle: the trapezoid of the contact lines, its Fourier "
            "fit, and the variation with which everything below is computed.",
            mesh_stiffness_page,
        ),
        Picture(
            "figure_05",
            "Figure 5",
            "Accelerations without (*P* = 0) and with one pitch error (*P* = 1), dimensionless: "
            "(a) torsional; transverse of (b) the driving and (c) the driven gear; axial of "
            "(d) the driving and (e) the driven gear.",
            accelerations_page,
        ),
        Picture(
            "figure_06",
            "Figure 6",
            "Single-sided amplitude spectra of the accelerations of figure 5, dimensionless, "
            "rectangular window over whole mesh periods; the lines of the two are drawn 0.07 to "
            "the left and to the right of their frequency.",
            spectra_page,
        ),
        Picture(
            "figure_07",
            "Figure 7",
            "Bifurcation diagram (a) and largest Lyapunov exponent (b) over the pitch error in "
            "multiples of e(τ), shaded by the motion; every lane starts at rest.",
            staged_page,
        ),
        Picture(
            "figure_07_hop",
            "The hop of figure 7",
            "Both motions of period 1 where they coexist (grey), by sweeps that carry their state "
            "upwards and downwards; dashed, where starts at rest and on the contact flank change "
            "from one to the other. Not a figure of the paper.",
            hop_page,
        ),
        *(
            Picture(
                f"figure_{motion.figure:02d}",
                f"Figure {motion.figure}",
                f"Torsional motion at *P* = {motion.pitch_error:g}, dimensionless: time history "
                "(a), phase portrait with one point per mesh period (b), Poincaré section (c). "
                "At rest at the start, or on the contact flank where the figure says so. "
                f"In the paper: {motion.words}.",
                partial(motion_page, shown=motion),
            )
            for motion in shown
        ),
        Picture(
            "figure_14",
            "Figure 14",
            "Torsional acceleration at growing pitch errors, dimensionless, on one scale; dashed, "
            "the largest value, of which the table gives the increments.",
            growing_accelerations_page,
        ),
        Picture(
            "figure_15",
            "Figure 15",
            "Single-sided amplitude spectra of the accelerations of figure 14, rectangular window "
            "over whole mesh periods, on one scale.",
            growing_spectra_page,
        ),
    )
