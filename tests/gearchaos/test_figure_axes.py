"""A diagram has one parameter as its axis; for several axes it names the slice that it shows."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gearchaos.errors import ConfigurationError, FigureError
from gearchaos.figures import bifurcation, bifurcation_page, lyapunov, shade_stages
from gearchaos.figures.labels import axis_label, in_words
from gearchaos.figures.page import legend_below
from gearchaos.figures.panel import legend_above, mark_values
from gearchaos.figures.stages import HATCHES
from gearchaos.figures.style import OVERLAID
from gearchaos.plot import main
from gearchaos.results.reading.result import Result

from .test_result_axes import AXES, result_over

BOTH = result_over(AXES["two parameters"])
STARTS = result_over(AXES["several starts"])
STARTS["period"][:] = 1


@pytest.mark.parametrize("width", [85.0, 130.0, 180.0])
def test_a_legend_below_a_page_has_the_columns_that_fit(width):
    figure = Figure(figsize=(width / 25.4, 4.0), layout="constrained")
    handles = [Line2D([], [], label=f"entry {n} of a dozen long ones") for n in range(12)]
    legend = legend_below(figure, handles, None, 5)
    one = Figure().legend(handles=handles[:1]).get_window_extent().width
    assert legend.get_window_extent().width <= figure.bbox.width
    # The legend has at most five columns; with two more it would not fit.
    assert legend._ncols == 5 or (legend._ncols + 2) * one > figure.bbox.width
    assert figure.legends == [legend]


@pytest.mark.parametrize("draw", [bifurcation, lyapunov])
def test_two_swept_parameters_are_refused_with_their_names_and_the_remedy(draw):
    with pytest.raises(FigureError, match=r"load and pitch_error.*--at load=0\.1"):
        draw(Figure().subplots(), BOTH)


def test_a_slice_of_two_parameters_is_drawn_and_named():
    one = BOTH.sel(load=0.3, method="nearest")
    page = bifurcation_page(one)
    assert page.get_suptitle() == "$f_n$ = 0.3"
    axes = Figure().subplots()
    points = bifurcation(axes, one).points
    well = one["status"] == 0
    np.testing.assert_array_equal(points.get_ydata(), one["section_delta_5"][well].ravel())


def test_a_label_has_the_fewest_lines_and_of_those_the_shortest():
    """A first line filled up to 24 characters would leave a single word for the second line."""
    words = "one two three four five six"
    renamed = replace(BOTH.variables["lyapunov_exponent"], long_name=words, symbol="", units="m")
    variables = [renamed if v.name == renamed.name else v for v in BOTH.variables.values()]
    result = Result(BOTH.axes, variables, {name: BOTH[name] for name in BOTH}, {}, {})
    lines = axis_label(result, "lyapunov_exponent", 24).splitlines()
    assert lines == ["One two three", "four five six (m)"]


def test_a_slice_is_named_as_its_axis_was():
    speeds = replace(BOTH.variables["load"], units="rpm", long_name="speed", symbol="")
    variables = [*(BOTH.variables | {"load": speeds}).values()]
    both = Result(BOTH.axes, variables, {n: BOTH[n] for n in BOTH}, {}, BOTH.metadata)
    assert in_words(both.sel(load=0.3, method="nearest"), {"load": 0.3}) == "speed = 0.3 rpm"


@pytest.mark.parametrize("draw", [bifurcation, lyapunov])
def test_a_single_lane_is_no_diagram(draw):
    with pytest.raises(ConfigurationError, match="it has none: leave one in sel"):
        draw(Figure().subplots(), BOTH.sel("nearest", load=0.3, pitch_error=1.0))


def test_many_names_stay_on_the_page_and_beside_its_letter():
    several = [BOTH.sel(load=load, method="nearest") for load in BOTH["load"][:3]]
    names = [f"{number}, a pair with a name of its own" for number in range(len(several))]
    page = bifurcation_page(several, labels=names)
    page.canvas.draw()
    legend = page.axes[0].get_legend()
    box, letter = legend.get_window_extent(), page.axes[0]._left_title.get_window_extent()
    assert letter.x1 < box.x0 < box.x1 <= page.bbox.width
    for lines in (legend.legend_handles, page.axes[0].lines):
        marks = [line.get_marker() for line in lines if line.get_label() in names]
        assert marks == [marker for _, marker in OVERLAID[: len(several)]]
    heights = [line.get_zorder() for line in page.axes[0].lines if line.get_label() in names]
    assert len(heights) > 1 and heights == sorted({*heights}, reverse=True)


def test_standard_errors_are_named_where_there_are_some():
    one = BOTH.sel(load=0.3, method="nearest")
    assert "standard errors" in lyapunov(Figure().subplots(), one).legend.get_texts()[0].get_text()
    one["lyapunov_exponent_standard_error"][:] = 0.0
    legend = lyapunov(Figure().subplots(), one).legend
    assert legend is None or "errors" not in str([text.get_text() for text in legend.get_texts()])


def test_the_diagram_shows_all_starts_and_the_stages_say_where_they_differ():
    page = bifurcation_page(STARTS, stages=True)
    (legend,) = page.legends
    motion = STARTS["motion"]
    same = (motion == motion[:, :1]).all(axis=1)
    assert same.any() and not same.all()
    for shade in shade_stages(page.axes[0], STARTS):
        low, high = shade.get_x(), shade.get_x() + shade.get_width()
        alike = same[(STARTS[STARTS.axis] > low) & (STARTS[STARTS.axis] < high)]
        several = shade.get_hatch() == HATCHES["several motions"]
        assert alike.size and (not alike.any() if several else alike.all())
    assert "several motions" in [text.get_text() for text in legend.get_texts()]
    points = bifurcation(Figure().subplots(), STARTS).points
    assert points.get_xdata().size == np.count_nonzero(STARTS["status"] == 0) * 6


def test_stages_are_those_of_one_axis():
    for axes in ("two parameters", "two parameters, several starts"):
        with pytest.raises(FigureError, match=r"load and pitch_error.*result\.sel"):
            shade_stages(Figure().subplots(), result_over(AXES[axes]))


@pytest.mark.parametrize(
    ("axes", "at", "name"),
    [
        ("two parameters", ["load=0.28"], "r_load_0.3"),
        ("two parameters", ["pitch_error=3"], "r_pitch_error_3"),
        ("several starts", ["start=2"], "r_start_2"),
        ("several starts", ["2"], "r_start_2"),
        ("two parameters, several starts", ["load=0.1", "start=1"], "r_load_0.1_start_1"),
    ],
)
def test_the_command_draws_the_slice_it_names(axes, at, name, tmp_path, capsys):
    result_over(AXES[axes]).save(tmp_path / "r.h5")
    asked = [word for value in at for word in ("--at", value)]
    assert main([str(tmp_path / "r.h5"), "--format", "png", "--dpi", "50", *asked]) == 0
    out, err = capsys.readouterr()
    assert out == f"{tmp_path / name}.png\n"
    assert all(f" {value.split('=')[0]} = " in err for value in at if "=" in value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--at", "load"], "'load' is not a finite number"),
        (["--at", "load=much"], "'much' is not a finite number"),
        (["--at", "torque=3"], "torque: is no axis of the result"),
        (["--at", "load=0.1", "--at", "pitch_error=1"], "nothing is left to draw against"),
    ],
)
def test_a_slice_that_cannot_be_drawn_is_reported(arguments, message, tmp_path, capsys):
    BOTH.save(tmp_path / "r.h5")
    assert main([str(tmp_path / "r.h5"), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and message in err
    assert len(list(tmp_path.iterdir())) == 1


def test_of_several_files_the_map_is_the_one_that_is_refused(tmp_path, capsys):
    result_over(AXES["one start"]).save(tmp_path / "one.h5")
    BOTH.save(tmp_path / "both.h5")
    assert main([str(tmp_path / "one.h5"), str(tmp_path / "both.h5")]) == 2
    assert (
        "both.h5: only diagrams of sweeps are drawn over each other, and here is a map"
        in capsys.readouterr().err
    )


def test_marks_of_values_leave_the_names_of_areas_in_the_legend():
    axes = Figure().subplots()
    legend_above(axes, [axes.fill_between([0.0, 1.0], 0.0, 1.0, label="directions differ")])
    mark_values([axes], "jumps", [0.5])
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert named == ["jumps", "directions differ"]
