"""The figures of a response show the data of its file."""

import re

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from gearchaos.errors import FigureError
from gearchaos.figures import (
    amplitude_spectrum,
    contact_strip,
    phase_portrait,
    poincare_section,
    response_page,
    time_history,
)
from gearchaos.figures.response import coordinates_of, is_response, repeats_after
from gearchaos.models.gear_pair.outputs import CATALOGUE, DIRECTIONS
from gearchaos.outputs.names import axis_name
from gearchaos.outputs.variable import coordinate
from gearchaos.plot import main
from gearchaos.results.reading.result import Result

from .listed_variables import sweep_variables

STEPS, PERIODS, POINTS = 40, 8, 60
STATES = ("delta_5", "delta_5_rate")
MEAN, FAST, SLOW = 0.5, 2.0, 0.6
TURN = 2.0 * np.pi


def known_response(diverged: tuple[int, ...] = (), swept: str = "pitch_error") -> Result:
    """Return a response of known waves: one motion has period 3, the other never repeats."""
    time = np.arange(-POINTS * STEPS, 0 + 1) / STEPS
    orders = np.array([[2.0 / 3.0], [np.sqrt(5.0) / 3.0]])
    waves = [
        MEAN + FAST * np.cos(TURN * time) + SLOW * np.sin(TURN * orders * time),
        -FAST * TURN * np.sin(TURN * time) + SLOW * TURN * orders * np.cos(TURN * orders * time),
        -FAST * TURN**2 * np.cos(TURN * time)
        - SLOW * (TURN * orders) ** 2 * np.sin(TURN * orders * time),
    ]
    for wave in waves:
        wave[list(diverged)] = np.nan
    motion = dict(zip((*STATES, "delta_5_acceleration"), waves, strict=True))
    record = {name: values[:, -PERIODS * STEPS - 1 :] for name, values in motion.items()}
    physical = "." in swept
    axis = coordinate(
        axis_name(swept),
        "rpm" if physical else "1",
        "speed of the driving gear" if physical else "multiple of the pitch error",
        "" if physical else "$P$",
        np.array([5.86, 12.5]),
    )
    variables = sweep_variables(
        [axis],
        states=STATES,
        section=STATES,
        section_points=POINTS,
        lyapunov=False,
        status_meanings=("ok", "diverged"),
    )
    instants = np.arange(PERIODS * STEPS + 1) / STEPS
    variables += CATALOGUE.motion([axis], instants, STATES, DIRECTIONS[:1])
    status = np.isin(np.arange(2), diverged)
    data = {
        **{f"section_{name}": motion[name][:, STEPS::STEPS] for name in STATES},
        "status": status,
        "diverged_period": np.where(status, 4, -1),
        "start_state": np.zeros((2, 2)),
        "end_state": np.stack([motion[name][:, -1] for name in STATES], axis=1),
        "mesh_period": np.full(2, 7.17),
        **record,
        "mesh_error": 0.0 * record["delta_5"],
        "transmission_error": 1.0 * record["delta_5"],
        "mesh_force_tangential": record["delta_5"],
        "contact_tangential": np.ones((2, PERIODS * STEPS + 1)),
    }
    return Result([axis.name], variables, data, {}, {"title": "waves"})


@pytest.fixture(scope="module")
def result() -> Result:
    return known_response()


@pytest.fixture
def axes():
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def test_a_response_is_known_by_its_motion(result):
    assert is_response(result)
    assert coordinates_of(result) == ("delta_5",)
    kept = [v for v in result.variables.values() if "time" not in v.dims]
    bare = Result(result.axes, kept, {v.name: result[v.name] for v in kept}, {}, {})
    assert not is_response(bare)
    with pytest.raises(FigureError, match="over time in the result; it has none"):
        time_history(Figure().add_subplot(), bare, 0)


def test_the_history_is_the_record_over_mesh_periods(axes, result):
    line = time_history(axes, result, 1, "mesh_force_tangential", between=(2.0, 5.0))
    x, y = line.get_data()
    assert (x[0], x[-1], x.size) == (2.0, 5.0, 3 * STEPS + 1)
    np.testing.assert_array_equal(y, result["mesh_force_tangential"][1, 2 * STEPS : 5 * STEPS + 1])
    assert axes.get_xlabel() == r"Time in mesh periods, $\Omega\tau/2\pi$"
    assert axes.get_ylabel() == "Tangential mesh\nforce, $N_y$ (unit $k_mb\\prime$)"


def test_a_periodic_portrait_closes_and_carries_a_point_for_each_mesh_period(axes, result):
    curve, points = phase_portrait(axes, result, 0)
    x, y = curve.get_data()
    np.testing.assert_allclose([x[-1], y[-1]], [x[-1 - 3 * STEPS], y[-1 - 3 * STEPS]], atol=1e-9)
    np.testing.assert_array_equal(points.get_xdata(), x[::STEPS])
    assert len(np.unique(np.round(points.get_xydata(), 6), axis=0)) == 3
    assert points.get_zorder() > curve.get_zorder()


def test_the_section_has_all_recorded_points_and_does_not_magnify_rounding(axes, result):
    points = poincare_section(axes, result, 0)
    np.testing.assert_array_equal(points.get_xdata(), result["section_delta_5"][0])
    np.testing.assert_array_equal(points.get_ydata(), result["section_delta_5_rate"][0])
    still = known_response()
    still["section_delta_5"][0] = 1.0 + 1e-13 * np.arange(POINTS)
    poincare_section(axes, still, 0)
    assert np.ptp(axes.get_xlim()) > 0.2 * np.ptp(result["delta_5"][0])


def heights(lines) -> dict[float, float]:
    ends = [segment[-1] for segment in lines.get_segments()]
    return {round(float(x), 9): float(y) for x, y in ends}


def test_the_lines_of_the_spectrum_are_the_waves(axes, result):
    """Eight periods are no multiple of period 3: six of them are transformed."""
    assert repeats_after(result, 0) == 3
    lines = heights(amplitude_spectrum(axes, result, 0, "delta_5"))
    high = {order: height for order, height in lines.items() if height > 1e-9}
    assert high == pytest.approx({0.0: MEAN, round(2 / 3, 9): SLOW, 1.0: FAST})
    assert axes.get_title("right") == "Rectangular window, 6 mesh periods"
    assert axes.get_ylabel() == r"Amplitude of $\delta_5$ (unit $b\prime$)"
    assert axes.get_ylim()[1] > FAST


def test_the_spectrum_is_that_of_the_acceleration_unless_asked_otherwise(axes, result):
    lines = heights(amplitude_spectrum(axes, result, 0))
    assert lines[1.0] == pytest.approx(FAST * TURN**2)


def test_a_motion_that_does_not_repeat_is_transformed_as_a_whole(axes, result):
    assert repeats_after(result, 1) == 0
    lines = heights(amplitude_spectrum(axes, result, 1, "delta_5", highest=2.0))
    assert axes.get_title("right") == "Hann window, 8 mesh periods"
    assert max(lines) <= 2.0
    assert lines[1.0] == pytest.approx(FAST, rel=0.05)
    # With a Hann window, a wave has half of its height on both neighbouring lines.
    assert [lines[0.875], lines[1.125]] == pytest.approx([FAST / 2.0] * 2, rel=0.2)


@pytest.mark.parametrize(
    ("lane", "variable", "message"),
    [
        (0, "delta_9", "no variable 'delta_9' over time in the result; it has delta_5, "),
        (0, "contact_tangential", "no variable 'contact_tangential' over time"),
        (1, "delta_5", "pitch_error = 12.5: the lane diverged"),
    ],
)
def test_what_cannot_be_drawn_is_reported(axes, lane, variable, message):
    with pytest.raises(FigureError, match=message):
        time_history(axes, known_response(diverged=(1,)), lane, variable)


@pytest.mark.parametrize(
    ("lane", "width", "height"), [(0, 180.0, None), (0, 85.0, None), (1, 180.0, 150.0)]
)
def test_the_page_has_the_asked_size_and_texts_a_journal_accepts(result, lane, width, height):
    page = response_page(result, lane, width_mm=width, height_mm=height)
    inches = page.get_size_inches()
    assert inches[0] * 25.4 == pytest.approx(width)
    assert height is None or inches[1] * 25.4 == pytest.approx(height)
    assert [axes.get_title("left") for axes in page.axes] == ["(a)", "(b)", "(c)", "(d)"]
    assert page.axes[0].get_title("right") == ("$P$ = 5.86", "$P$ = 12.5")[lane]
    assert page.axes[3].get_title("right").startswith(("Rectangular", "Hann")[lane])
    written = [text for text in page.findobj(Text) if text.get_text()]
    assert min(text.get_fontsize() for text in written) >= 7.0
    drawn = page.get_tightbbox()
    assert min(drawn.x0, drawn.y0) >= 0.0
    assert (drawn.x1 <= inches[0], drawn.y1 <= inches[1]) == (True, True)
    boxes = [axes.get_tightbbox() for axes in page.axes]
    overlaps = [one.overlaps(other) for one in boxes for other in boxes if one is not other]
    assert not any(overlaps)


def test_a_page_names_a_parameter_without_a_symbol_and_leaves_settings_alone():
    before = dict(mpl.rcParams)
    page = response_page(known_response(swept="operation.speed_rpm"), 0)
    assert page.axes[0].get_title("right") == "speed of the driving gear = 5.86 rpm"
    assert dict(mpl.rcParams) == before


@pytest.fixture
def path(tmp_path, result):
    path = tmp_path / "response.h5"
    result.save(path)
    return path


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["--output", "{}/fig8"], ["fig8_pitch_error_5.86", "fig8_pitch_error_12.5"]),
        (["--variable", "delta_5", "--to", "6"], ["response_pitch_error_5.86"]),
        (["--output", "{}/fig8.png", "--from", "6", "--width", "85"], ["fig8"]),
    ],
)
def test_the_command_draws_a_page_for_each_lane(path, arguments, names, capsys):
    asked = [text.format(path.parent) for text in arguments]
    assert main([str(path), "--format", "png", "--dpi", "50", *asked]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines() == [str(path.parent / f"{name}.png") for name in names]
    size = "85 mm x 208 mm" if "85" in arguments else "180 mm x 104 mm"
    *progress, summary = err.splitlines()
    assert summary == f"gearchaos plot: 2 lanes over pitch_error, {size} at 50 dpi"
    if len(names) == 1:
        assert not progress
    else:
        (line,) = progress
        assert re.fullmatch(r"gearchaos plot: 2 of 2 pages, *[\d.]+ pages/s, 00:00 left", line)


def test_the_strip_below_a_force_covers_the_record_with_the_states_of_contact():
    result = known_response()
    states, edges = result["contact_tangential"], result["time"]
    states[0] = np.where(edges < 2.0, 1, np.where(edges < 3.5, 0, 2))
    axes = Figure(layout="constrained").subplots()
    strips = contact_strip(axes, result, 0, "mesh_force_tangential")
    bars = [[path.get_extents().intervalx.tolist() for path in one.get_paths()] for one in strips]
    assert dict(zip((one.get_label() for one in strips), bars, strict=True)) == {
        "apart": [[2.0, 3.5]],
        "driving flank": [[0.0, 2.0]],
        "back flank": [[3.5, float(PERIODS)]],
    }


@pytest.mark.parametrize("name", ["mesh_force_tangential", "delta_5_rate"])
def test_what_is_no_coordinate_has_its_history_and_its_own_spectrum(path, result, name, capsys):
    asked = ["--variable", name, "--to", "6", "--format", "png", "--dpi", "50"]
    assert main([str(path), *asked]) == 0
    out, err = capsys.readouterr()
    assert out == f"{path.parent}/response_pitch_error_5.86_{name}.png\n"
    assert "180 mm x 52 mm" in err
    history, spectrum = response_page(result, 0, name).axes
    np.testing.assert_array_equal(history.lines[0].get_ydata(), result[name][0])
    alone = Figure().subplots()
    amplitude_spectrum(alone, result, 0, name)
    for one, other in zip(spectrum.collections, alone.collections, strict=True):
        np.testing.assert_array_equal(one.get_segments(), other.get_segments())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--output", "all.gif"], "'gif': a figure is written as png, pdf, svg, eps, tiff"),
        (
            ["--stages"],
            "--stages: only diagrams of sweeps have it, and here is a response",
        ),
        (["--variable", "delta_3"], "no variable 'delta_3' over time in the result; it has delta"),
        (["--from", "13"], "the result has 5.86 to 12.5"),
    ],
)
def test_what_the_command_cannot_draw_is_a_usage_error(path, arguments, message, capsys):
    assert main([str(path), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert [file.name for file in path.parent.iterdir()] == ["response.h5"]


def test_diverged_lanes_are_left_out(tmp_path, capsys):
    some, none = tmp_path / "some.h5", tmp_path / "none.h5"
    known_response(diverged=(0,)).save(some)
    known_response(diverged=(0, 1)).save(none)
    assert main([str(some), "--format", "png", "--dpi", "50"]) == 0
    out, err = capsys.readouterr()
    assert out == f"{tmp_path / 'some_pitch_error_12.5.png'}\n"
    assert "1 of them diverged" in err
    assert main([str(none)]) == 2
    assert "every lane diverged" in capsys.readouterr().err
