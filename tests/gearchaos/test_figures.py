"""Figures show the contents of a result, and name the parts that they leave out."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from gearchaos.errors import FigureError
from gearchaos.figures import bifurcation, bifurcation_page, lyapunov, save_figure
from gearchaos.figures.panel import robust_limits
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.outputs.variable import coordinate
from gearchaos.results.reading.result import Result, open_result

from .listed_variables import sweep_variables

POINTS = 60
LANES = 121


def logistic_sweep(
    values: Sequence[float] | np.ndarray,
    *,
    diverged: Sequence[int] = (),
    section: Sequence[str] = ("delta_5", "delta_1"),
    with_exponent: bool = True,
    starts: int = 1,
    symbol: str = "$r$",
    units: str = "1",
) -> Result:
    """Make a result of the logistic map, whose bifurcations and exponents are well known."""
    axes = [coordinate("growth", units, "growth rate", symbol, np.asarray(values, dtype=float))]
    axes += [CATALOGUE.axis("start", np.arange(starts))] if starts > 1 else []
    r = np.repeat(axes[0].values, starts)
    x = np.full(r.shape, 0.4)
    orbit, slopes = [], []
    for n in range(600 + POINTS):
        x = r * x * (1.0 - x)
        slopes.append(np.log(np.abs(r * (1.0 - 2.0 * x)) + 1e-300))
        if n >= 600:
            orbit.append(x)
    points = np.array(orbit).T
    blocks = np.array(slopes)[60:].reshape(20, -1, r.size).mean(axis=1)
    exponent, error = blocks.mean(axis=0), blocks.std(axis=0) / 19**0.5
    status = np.zeros(r.shape)
    status[list(diverged)] = 1
    for values_of_lane in (points, exponent, error):
        values_of_lane[list(diverged)] = np.nan
    variables = sweep_variables(
        axes,
        states=("delta_5",),
        section=section,
        section_points=POINTS,
        lyapunov=with_exponent,
        status_meanings=("ok", "diverged"),
    )
    data = {
        "section_delta_5": points,
        "section_delta_1": -points,
        "lyapunov_exponent": exponent,
        "lyapunov_exponent_standard_error": error,
        "status": status,
        "diverged_period": np.where(status == 1, 3, -1),
        "start_state": np.full((r.size, 1), 0.4),
        "end_state": points[:, -1:],
    }
    return Result([axis.name for axis in axes], variables, data, {}, {"title": "logistic map"})


@pytest.fixture
def result() -> Result:
    return logistic_sweep(np.linspace(2.8, 3.9, LANES))


@pytest.fixture
def axes():
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure.subplots()


def test_every_section_point_of_the_file_is_drawn(axes, result, tmp_path):
    result.save(tmp_path / "r.h5")
    stored = open_result(tmp_path / "r.h5")
    points = bifurcation(axes, stored, "section_delta_1").points
    assert points.axes is axes
    np.testing.assert_array_equal(points.get_xdata(), np.repeat(stored["growth"], POINTS))
    np.testing.assert_array_equal(points.get_ydata(), stored["section_delta_1"].ravel())
    assert points.get_rasterized()
    half = 1.1 / (LANES - 1) / 2.0
    assert axes.get_xlim() == pytest.approx((2.8 - half, 3.9 + half), rel=1e-15)


def test_the_torsional_section_is_drawn_unless_another_is_asked_for(axes, result):
    drawn = bifurcation(axes, result).points.get_ydata()
    np.testing.assert_array_equal(drawn, result["section_delta_5"].ravel())
    assert axes.get_ylabel().endswith("$\\delta_5$\n(unit $b\\prime$)")


def test_a_variable_the_result_lacks_is_named_with_those_it_has(axes, result):
    with pytest.raises(FigureError, match=r"'section_delta_2'.*section_delta_5"):
        bifurcation(axes, result, "section_delta_2")


def test_labels_come_from_the_file_and_name_units_only_where_there_are_some(axes):
    bifurcation(axes, logistic_sweep([3.0, 3.1], units="rpm"))
    assert axes.get_xlabel() == "Growth rate, $r$ (rpm)"
    lyapunov(axes, logistic_sweep([3.0, 3.1]))
    assert axes.get_xlabel() == "Growth rate, $r$"
    wording = r"Largest Lyapunov exponent, $\lambda_1$ (per unit of $\tau$)"
    assert axes.get_ylabel().replace("\n", " ") == wording
    bifurcation(axes, logistic_sweep([3.0, 3.1], units="N/(um mm)"))
    assert axes.get_xlabel() == "Growth rate, $r$ (N/(\N{MICRO SIGN}m mm))"


@pytest.mark.parametrize("symbol", [r"$\frac{$", "100 $", "$", r"$\nonsense$"])
def test_a_symbol_that_is_no_formula_is_shown_as_text(symbol, tmp_path):
    page = bifurcation_page(logistic_sweep([3.0, 3.1], symbol=symbol))
    save_figure(page, tmp_path / "page.png")
    assert page.axes[-1].get_xlabel() == "Growth rate, " + symbol.replace("$", r"\$")


def test_a_diverged_lane_is_marked_and_its_points_are_not_drawn(axes):
    result = logistic_sweep(np.linspace(2.8, 3.9, LANES), diverged=[7, 50])
    artists = bifurcation(axes, result)
    np.testing.assert_array_equal(artists.diverged.get_xdata(), result["growth"][[7, 50]])
    assert [text.get_text() for text in artists.legend.get_texts()] == ["diverged"]
    assert artists.points.get_xdata().size == (LANES - 2) * POINTS
    chart = lyapunov(axes, result)
    np.testing.assert_array_equal(chart.diverged.get_xdata(), result["growth"][[7, 50]])
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(chart.points.get_ydata())), [7, 50])


def test_values_left_over_in_a_diverged_lane_are_not_drawn(axes):
    result = logistic_sweep([3.0, 3.1, 3.2])
    result["status"][1] = 1
    assert 3.1 not in bifurcation(axes, result).points.get_xdata()
    assert np.isnan(lyapunov(axes, result).points.get_ydata()[1])


def test_nothing_is_marked_where_every_lane_is_well(axes, result):
    artists = bifurcation(axes, result)
    assert (artists.diverged, artists.off_scale, artists.legend) == (None, [], None)


def test_the_chart_shows_exponent_uncertainty_zero_and_positive_part(axes, result):
    chart = lyapunov(axes, result)
    exponent, error = (result[f"lyapunov_exponent{end}"] for end in ("", "_standard_error"))
    np.testing.assert_array_equal(chart.points.get_xdata(), result["growth"])
    np.testing.assert_array_equal(chart.points.get_ydata(), exponent)
    band = chart.parts["band"].get_paths()[0].vertices[:, 1]
    np.testing.assert_allclose(band.max(), (exponent + 2 * error).max())
    np.testing.assert_allclose(band.min(), (exponent - 2 * error).min())
    assert set(chart.parts["zero"].get_ydata()) == {0.0}
    heights = np.concatenate([path.vertices[:, 1] for path in chart.parts["positive"].get_paths()])
    assert heights.min() >= 0.0
    assert heights.max() == exponent.max() > 0.4
    assert axes.get_ylim()[0] < 0.0 < axes.get_ylim()[1]


def test_several_starts_of_one_value_are_not_joined_by_a_line(axes):
    result = logistic_sweep([3.0, 3.3, 3.9], starts=2)
    chart = lyapunov(axes, result)
    assert chart.points.get_linestyle() == "None"
    np.testing.assert_array_equal(chart.parts["dots"].get_xdata(), result.along("growth"))
    assert len(chart.parts["bars"].get_segments()) == 6
    assert bifurcation(axes, result).points.get_xdata().size == 6 * POINTS


def test_few_values_have_large_dots_however_many_starts_they_have(axes):
    few, many = logistic_sweep([3.0, 3.5, 3.9], starts=40), logistic_sweep(np.linspace(3, 3.9, 900))
    for draw, least in ((bifurcation, 0.8), (lyapunov, 1.0)):
        for result, size in ((few, 3.0), (many, least)):
            drawn = draw(axes, result)
            assert drawn.parts.get("dots", drawn.points).get_markersize() == size


def test_a_lane_between_diverged_ones_is_still_seen(axes):
    chart = lyapunov(axes, logistic_sweep([3.0, 3.1, 3.2, 3.3], diverged=[0, 2]))
    np.testing.assert_array_equal(chart.parts["dots"].get_xdata(), [3.1, 3.3])


def test_a_few_outlying_lanes_are_marked_and_do_not_flatten_the_rest(axes, result):
    result["lyapunov_exponent"][[30, 31]] = -400.0
    result["section_delta_5"][60, 5] = 1e4
    chart = lyapunov(axes, result)
    assert axes.get_ylim()[0] > -5.0
    np.testing.assert_array_equal(chart.off_scale[0].get_xdata(), result["growth"][[30, 31]])
    assert chart.off_scale[0].get_label() == "off scale (to \N{MINUS SIGN}400)"
    axes.clear()
    diagram = bifurcation(axes, result)
    assert axes.get_ylim()[1] < 1.1
    np.testing.assert_array_equal(diagram.off_scale[0].get_xdata(), result["growth"][[60]])


def test_a_second_result_widens_the_limits_and_every_lane_is_seen_or_marked(axes, result):
    other = logistic_sweep(np.linspace(2.0, 3.0, 41))
    other["section_delta_5"][:] -= 5.0
    result["section_delta_5"][60, 5] = 1e4
    first = bifurcation(axes, result, label="above")
    (outlier,) = first.off_scale
    second = bifurcation(axes, other, color="#0072B2", marker="^", label="below")
    left, right = axes.get_xlim()
    assert left < 2.0 and right > 3.9
    bottom, top = axes.get_ylim()
    points = np.concatenate([one.points.get_ydata() for one in (first, second)])
    assert np.count_nonzero((points < bottom) | (points > top)) == 1
    # The triangle is drawn again at the new edge, and the legend has all names.
    assert outlier.axes is None and first.off_scale[0].axes is axes
    np.testing.assert_array_equal(first.off_scale[0].get_xdata(), result["growth"][[60]])
    assert second.off_scale == []
    names = [text.get_text() for text in second.legend.get_texts()]
    assert names == ["above", "off scale (to 1e+04)", "below"]
    assert second.points.get_color() == "#0072B2" and second.points.get_marker() == "^"


def test_results_over_each_other_share_a_page_and_are_named(result):
    other = logistic_sweep(np.linspace(2.0, 3.0, 41), with_exponent=False)
    page = bifurcation_page([result, other], labels=["one", "other $"])
    upper, lower = page.axes
    assert upper.get_xlim() == lower.get_xlim()
    assert upper.get_xlim()[0] < 2.0
    assert [text.get_text() for text in upper.get_legend().get_texts()] == ["one", r"other \$"]
    with pytest.raises(FigureError, match="stages are drawn of one result"):
        bifurcation_page([result, other], stages=True)


def test_limits_hold_everything_where_nothing_lies_far_out():
    low, high = np.linspace(-1.0, 0.0, 400), np.linspace(0.0, 2.0, 400)
    bottom, top = robust_limits(low, high)
    assert -1.2 < bottom < -1.0
    assert 2.0 < top < 2.2


def test_limits_reach_half_of_the_inner_height_beyond_it():
    values = np.linspace(0.0, 1.0, 400)
    # The inner 94 % end near 1, so that values up to 1.5 are shown and values above it are not.
    values[[10, 11, 12]] = 1.4, 1.7, 10.0
    bottom, top = robust_limits(values, values)
    assert -0.2 < bottom < 0.0
    assert 1.4 < top < 1.6


def test_a_narrow_peak_on_a_level_line_is_no_outlier():
    exponent = np.full(400, -0.01) + 1e-6 * np.arange(400)
    exponent[200:206] = -0.003
    bottom, top = robust_limits(exponent, exponent, hold_zero=True)
    assert bottom < -0.01
    assert 0.0 < top < 0.001


def test_a_part_of_the_range_shows_its_lanes_only(axes, result):
    points = bifurcation(axes, result, between=(3.5, None)).points
    assert points.get_xdata().min() >= 3.5
    assert axes.get_xlim() == (3.5, 3.9 + (3.9 - points.get_xdata().min()) / 43 / 2.0)
    with pytest.raises(FigureError, match=r"growth from 5 to 6.*2\.8 to 3\.9"):
        lyapunov(axes, result, between=(5.0, 6.0))


def test_the_page_stacks_diagram_and_chart_on_one_axis(result):
    page = bifurcation_page(result)
    upper, lower = page.axes
    assert upper.get_shared_x_axes().joined(upper, lower)
    assert upper.get_position().y0 > lower.get_position().y1
    np.testing.assert_allclose(upper.get_position().intervalx, lower.get_position().intervalx)
    assert [axes.get_title("left") for axes in page.axes] == ["(a)", "(b)"]
    assert (upper.get_xlabel(), lower.get_xlabel()) == ("", "Growth rate, $r$")


@pytest.mark.parametrize(("width", "height"), [(85.0, None), (180.0, None), (85.0, 110.0)])
def test_the_page_has_the_asked_size_and_texts_a_journal_accepts(width, height):
    result = logistic_sweep(np.linspace(2.8, 3.9, LANES), diverged=[7])
    page = bifurcation_page(result, "section_delta_1", width_mm=width, height_mm=height)
    inches = page.get_size_inches()
    assert inches[0] * 25.4 == pytest.approx(width)
    assert height is None or inches[1] * 25.4 == pytest.approx(height)
    written = [text for text in page.findobj(Text) if text.get_text()]
    assert min(text.get_fontsize() for text in written) >= 7.0
    drawn = page.get_tightbbox()
    assert min(drawn.x0, drawn.y0) >= 0.0
    assert (drawn.x1 <= inches[0], drawn.y1 <= inches[1]) == (True, True)


def test_a_periodic_lane_is_a_black_line_and_chaos_is_grey():
    page = bifurcation_page(logistic_sweep(np.linspace(2.8, 3.9, 1101)), width_mm=85)
    page.set_dpi(300)
    page.canvas.draw()
    picture = np.asarray(page.canvas.buffer_rgba())[::-1, :, 0]
    for growth in (2.9, 2.95):
        x, y = page.axes[0].transData.transform((growth, 1.0 - 1.0 / growth)).astype(int)
        column = picture[y - 100 : y + 100, x]
        assert column.min() < 40
        assert 1 <= np.count_nonzero(column < 128) < 8
    left, right = (int(page.axes[0].transData.transform((g, 0.5))[0]) for g in (3.7, 3.8))
    bottom, top = (int(page.axes[0].transData.transform((3.7, y))[1]) for y in (0.4, 0.8))
    assert 60 < picture[bottom:top, left:right].mean() < 245


@pytest.mark.parametrize(
    ("result", "panels"),
    [
        (logistic_sweep([3.2]), 2),
        (logistic_sweep([3.2], diverged=[0]), 2),
        (logistic_sweep([3.0, 3.2, 3.4], diverged=[0, 1, 2]), 2),
        (logistic_sweep([0.0, 1e-9]), 2),
        (logistic_sweep([3.0, 3.2], section=[]), 1),
        (logistic_sweep([3.0, 3.2], section=["delta_1"], with_exponent=False), 1),
    ],
    ids=["one lane", "diverged", "all diverged", "all zero", "no section", "no exponent"],
)
def test_every_kind_of_result_gives_a_page(result, panels, tmp_path):
    page = bifurcation_page(result)
    save_figure(page, tmp_path / "page.png")
    assert len(page.axes) == panels


def test_a_panel_without_lanes_says_why(axes):
    chart = lyapunov(axes, logistic_sweep([3.0, 3.2], diverged=[0, 1]))
    assert [text.get_text() for text in chart.legend.get_texts()] == ["diverged"]


def test_a_result_with_nothing_to_draw_is_refused():
    with pytest.raises(FigureError, match="neither section points nor Lyapunov"):
        bifurcation_page(logistic_sweep([3.0], section=[], with_exponent=False))


def test_drawing_leaves_the_users_settings_alone(result, tmp_path):
    before = dict(mpl.rcParams)
    save_figure(bifurcation_page(result), tmp_path / "page.pdf")
    assert dict(mpl.rcParams) == before


def test_a_page_has_the_font_and_the_background_that_the_user_has_set(result):
    own = {"font.family": ["DejaVu Sans"], "figure.facecolor": "0.9", "savefig.bbox": "tight"}
    with mpl.rc_context(own):
        page = bifurcation_page(result)
    axes = page.axes[0]
    assert axes.xaxis.get_label().get_fontname() == "DejaVu Sans"
    assert page.get_facecolor() == pytest.approx((0.9, 0.9, 0.9, 1.0))
    assert bifurcation_page(result).axes[0].xaxis.get_label().get_fontname() == "STIXGeneral"


@pytest.mark.parametrize("kind", ["png", "pdf"])
def test_the_same_result_gives_the_same_bits(result, kind, tmp_path):
    names = [tmp_path / f"{n}.{kind}" for n in range(2)]
    for name in names:
        save_figure(bifurcation_page(result), name)
    assert names[0].read_bytes() == names[1].read_bytes()


def test_a_notebook_can_show_the_page(result):
    assert bifurcation_page(result)._repr_png_().startswith(b"\x89PNG")


def test_a_figure_of_another_format_is_refused(result, tmp_path):
    with pytest.raises(FigureError, match=r"\.png or \.pdf or \.svg"):
        save_figure(bifurcation_page(result), tmp_path / "page.gif")


def test_figures_need_neither_numba_nor_the_kernels_nor_pyplot(result, tmp_path):
    result.save(tmp_path / "r.h5")
    code = """
import sys
class Forbidden:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("numba", "gearchaos_kernels") or name == "matplotlib.pyplot":
            raise AssertionError(name)
sys.meta_path.insert(0, Forbidden())
from gearchaos.plot import main
sys.exit(main([sys.argv[1], "--quiet"]))
"""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code, str(tmp_path / "r.h5")],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert [Path(line).name for line in done.stdout.splitlines()] == ["r.png", "r.pdf"]
