"""Pages explain the scales that their labels name as units."""

import pytest

from gearchaos.figures import bifurcation_page
from gearchaos.figures.labels import axis_label
from gearchaos.figures.page import page
from gearchaos.figures.units import explained_units

from .test_figure_lines import steps


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("Displacement (unit $b\\prime$)", "$b\\prime$: length scale"),
        (
            "Velocity (unit $b\\prime\\omega_h$)",
            "$b\\prime$: length scale, $\\omega_h$: scaling frequency",
        ),
        (
            "Exponent (per unit of $\\tau$)",
            "$\\omega_h$: scaling frequency, $\\tau$: $\\omega_h t$",
        ),
        ("$\\Omega$ = 4 $\\omega_h$", "$\\omega_h$: scaling frequency"),
        ("$P$ = 1.04", ""),
        ("Displacement (\N{MICRO SIGN}m)", ""),
        ("Share of starts", ""),
    ],
)
def test_the_symbols_of_units_are_explained_at_the_foot(label, words):
    with page(85.0, 60.0) as figure:
        figure.subplots().set_xlabel(label)
    assert explained_units(figure) == words
    assert (figure.get_supxlabel() or "") == words


def test_labels_of_results_use_these_symbols():
    result = steps()
    assert "(unit $b" in axis_label(result, "section_delta_5").replace("\n", " ")
    drawn = bifurcation_page(result)
    assert "length scale" in drawn.get_supxlabel() and "scaling frequency" in drawn.get_supxlabel()


def test_the_legend_of_stages_carries_the_explanation():
    drawn = bifurcation_page(steps(), stages=True)
    (legend,) = drawn.legends
    assert "length scale" in legend.get_title().get_text()
    assert not drawn.get_supxlabel()
