"""Figures drawn from result files alone: no kernel, no simulation, no pyplot."""

from gearchaos.figures.boundaries import add_boundaries, boundaries_page, draw_boundaries
from gearchaos.figures.branches import add_branches, branches_page, draw_branches
from gearchaos.figures.control import control_page
from gearchaos.figures.control_sweep import control_sweep_page
from gearchaos.figures.diagrams import bifurcation, lyapunov, waterfall
from gearchaos.figures.ensembles import basins, basins_page, fractions, shares, shares_page
from gearchaos.figures.maps import map_page, parameter_map
from gearchaos.figures.page import save_figure
from gearchaos.figures.response import (
    amplitude_spectrum,
    contact_strip,
    phase_portrait,
    poincare_section,
    time_history,
)
from gearchaos.figures.response_page import response_page
from gearchaos.figures.stages import shade_stages
from gearchaos.figures.sweep_page import bifurcation_page
