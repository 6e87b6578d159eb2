"""Lines of figures break at jumps and have one width; editors can use texts and fonts."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from gearchaos.figures import bifurcation, bifurcation_page
from gearchaos.outputs.catalogue import DIMENSION_PART
from gearchaos.outputs.listing import GENERIC
from gearchaos.outputs.variable import coordinate
from gearchaos.plot import main
from gearchaos.records.label import MOTION_MEANINGS
from gearchaos.results.reading.result import Result

from .listed_variables import sweep_variables
from .test_plot import run

LANES = 40
JUMP, DOUBLED, CHAOTIC, DIVERGED = 10, 20, 30, 36
"""First lanes after a jump, of period 2 and of chaos, and the only lane that diverged."""


def steps(labels: bool = True) -> Result:
    """Make a sweep whose exponent rises, jumps within period 1, doubles, and becomes chaotic."""
    load = np.linspace(1.0, 2.0, LANES)
    exponent = 0.1 * load
    exponent[JUMP:] += 0.5
    lane = np.arange(LANES)
    motion = np.where(lane < CHAOTIC, 0, MOTION_MEANINGS.index("chaotic"))
    status = lane == DIVERGED
    variables = sweep_variables(
        [coordinate("load", "1", "load", "$f_n$", load)],
        states=("delta_5",),
        section=("delta_5",),
        section_points=2,
        lyapunov=True,
        status_meanings=("ok", "diverged"),
        motion_meanings=MOTION_MEANINGS if labels else (),
    )
    section = np.stack([load, load + 0.2 * (lane >= DOUBLED)], axis=1)
    data = {
        "section_delta_5": section,
        "lyapunov_exponent": exponent,
        "lyapunov_exponent_standard_error": np.zeros(LANES),
        "status": status,
        "diverged_period": np.where(status, 3, -1),
        "start_state": section[:, :1],
        "end_state": section[:, :1],
    }
    if labels:
        period = np.select([lane < DOUBLED, lane < CHAOTIC], [1, 2], 0)
        data |= {"motion": motion, "period": period, "bands": 0 * lane}
        data |= {"return_distance": 0.0 * load}
    return Result(["load"], variables, data, {}, {"title": "steps"})


def pieces(result: Result) -> list[int]:
    """Return the number of lanes of each piece of the line, except for pieces of one lane."""
    drawn = bifurcation(Figure().subplots(), result, "lyapunov_exponent", lines=True)
    there = np.isfinite(drawn.parts["line"].get_ydata())
    sizes = [len(piece) for piece in "".join("x" if one else " " for one in there).split()]
    return [size for size in sizes if size > 1]


def test_a_line_breaks_at_a_jump_and_where_the_motion_changes():
    assert pieces(steps()) == [JUMP, DOUBLED - JUMP, CHAOTIC - DOUBLED]


def test_without_labels_a_line_breaks_at_jumps_and_diverged_lanes():
    assert pieces(steps(labels=False)) == [JUMP, DIVERGED - JUMP, LANES - 1 - DIVERGED]


def test_chaotic_lanes_keep_their_dots_and_periodic_ones_have_none():
    drawn = bifurcation(Figure().subplots(), steps(), "lyapunov_exponent", lines=True)
    chaotic = LANES - CHAOTIC - 1
    assert len(drawn.points.get_xdata()) == chaotic
    plain = bifurcation(Figure().subplots(), steps(), "lyapunov_exponent")
    assert "line" not in plain.parts and len(plain.points.get_xdata()) == LANES - 1


def test_sections_stay_dots():
    drawn = bifurcation(Figure().subplots(), steps(), "section_delta_5", lines=True)
    assert "line" not in drawn.parts


def test_lines_of_several_results_have_one_width_and_differ_in_dashes():
    page = bifurcation_page([steps(), steps()], "lyapunov_exponent", lines=True, labels=["a", "b"])
    for axes in page.axes:
        lines = [one for one in axes.lines if len(one.get_xdata()) > 20]
        drawn = [one for one in lines if one.get_linestyle() != "None"]
        assert len(drawn) == 2
        assert len({one.get_linewidth() for one in drawn}) == 1
        assert len({one.get_linestyle() for one in drawn}) == 2
    legend = {one.get_label(): one for one in page.axes[0].get_legend().legend_handles}
    assert [legend[label].get_marker() for label in "ab"] == ["None", "None"]


@pytest.fixture
def path(tmp_path) -> Path:
    steps().save(tmp_path / "steps.h5")
    return tmp_path / "steps.h5"


def test_the_option_draws_lines_into_a_figure_of_its_own(path, capsys):
    asked = ["--variable", "lyapunov_exponent", "--format", "svg"]
    assert main([str(path), *asked]) == main([str(path), *asked, "--lines"]) == 0
    names = [Path(one).name for one in capsys.readouterr().out.splitlines()]
    assert names == ["steps_lyapunov_exponent.svg", "steps_lyapunov_exponent_lines.svg"]


def test_texts_stay_texts_in_svg_and_pdf_embeds_its_fonts(path):
    assert main([str(path), "--format", "svg,pdf"]) == 0
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", path.with_suffix(".svg").read_text())
    assert {"Relative torsional displacement", "diverged"} <= {*texts}
    pdf = path.with_suffix(".pdf").read_bytes()
    fonts = re.findall(rb"/Subtype /(Type0|Type3|Type1)", pdf)
    assert fonts and {*fonts} == {b"Type0"}
    assert pdf.count(b"/FontFile2") >= len(fonts) > 0


def test_a_matplotlibrc_file_changes_the_style(path, tmp_path):
    settings = tmp_path / "matplotlibrc"
    settings.write_text("font.family: DejaVu Sans\naxes.linewidth: 3.5\n")
    done = run(path, "--format", "svg", MATPLOTLIBRC=str(settings))
    assert done.returncode == 0, done.stderr
    drawn = path.with_suffix(".svg").read_text()
    assert "DejaVu Sans" in drawn and "stroke-width: 3.5" in drawn


def test_a_variable_with_standard_errors_has_bars_of_two():
    result, name = steps(), "kaplan_yorke_dimension"
    more = GENERIC.variables([result.variables["load"]], {DIMENSION_PART: True})[1:]
    data = {one: result[one] for one in result} | {name: np.ones(LANES)}
    data[f"{name}_standard_error"] = np.full(LANES, 0.1)
    found = Result(["load"], [*result.variables.values(), *more], data, {}, {})
    drawn = bifurcation(Figure().subplots(), found, name)
    ends = [one[:, 1] for one in drawn.parts["bars"].get_segments() if len(one)]
    np.testing.assert_allclose(ends, [[0.8, 1.2]] * (LANES - 1))  # One lane diverged.
    assert drawn.points.axes.get_ylim()[1] > 1.2
    assert any("standard errors" in one.get_text() for one in drawn.legend.get_texts())
