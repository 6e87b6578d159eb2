"""Figures drawn from result files alone: no kernel, no simulation, no pyplot."""

from gearchaos.figures.bifurcation import BifurcationArtists, bifurcation
from gearchaos.figures.files import save_figure
from gearchaos.figures.lyapunov import LyapunovArtists, lyapunov
from gearchaos.figures.page import bifurcation_page

__all__ = [
    "BifurcationArtists",
    "LyapunovArtists",
    "bifurcation",
    "bifurcation_page",
    "lyapunov",
    "save_figure",
]
