"""Maps over two parameters: each lane is a cell, and the legend names cells without a value."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch

from gearchaos.errors import FigureError, FileError
from gearchaos.figures import map_page, parameter_map
from gearchaos.figures.maps import _number_cells
from gearchaos.figures.stages import SHADES, look_of
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.outputs.variable import Variable, coordinate
from gearchaos.plot import main
from gearchaos.records.contact import CONTACT_STATES
from gearchaos.records.label import MOTION_MEANINGS
from gearchaos.results.reading.result import Result

from .listed_variables import sweep_variables

SPEEDS = coordinate(
    "operation_speed_rpm", "rpm", "speed", "", np.array([900.0, 1000.0, 1300.0, 1500.0])
)
ERRORS = coordinate("pitch_error", "1", "pitch error", "$P$", np.array([0.0, 1.0, 4.0]))
MOTION = np.array([[0, 0, 0, 3], [0, 0, 1, 2], [4, 4, 2, 2]])
PERIOD = np.array([[1, 2, 3, 0], [4, 7, 0, 0], [0, 0, 0, 0]])
KINDS = [
    ["period 1", "period 2", "period 3", "unresolved"],
    ["period 4 or more", "period 4 or more", "quasi-periodic", "chaotic"],
    ["diverged", "diverged", "chaotic", "chaotic"],
]
EXPONENT = np.array([[-0.3, -0.1, -0.2, 0.01], [-0.1, -0.4, 0.0, 0.2], [np.nan, np.nan, 0.5, 0.4]])


def result_over(*axes: Variable, labelled: bool = True) -> Result:
    """Return three pitch errors by four uneven speeds; the last error diverged at two speeds."""
    variables = sweep_variables(
        axes,
        states=["delta_5"],
        section=["delta_5"],
        section_points=2,
        lyapunov=True,
        contact=["tangential"],
        status_meanings=["ok", "diverged"],
        motion_meanings=MOTION_MEANINGS if labelled else (),
    )
    shape = [axis.values.size for axis in axes]
    dims = {"section_point": 2, "state": 1}
    data = {
        one.name: np.zeros([*shape, *(dims[dim] for dim in one.dims[len(axes) :])])
        for one in variables
        if one.values is None
    }
    data |= {"motion": MOTION, "period": PERIOD, "lyapunov_exponent": EXPONENT}
    data |= {"status": MOTION == 4, "diverged_period": np.where(MOTION == 4, 9, -1)}
    data |= {"contact_state_tangential": MOTION % 4, "time_apart_tangential": np.abs(EXPONENT)}
    data["approach_mean_tangential"] = np.where(PERIOD == 1, np.nan, np.abs(EXPONENT))
    given = {name: np.broadcast_to(np.reshape(values, (3, 4, *[1] * (len(axes) - 2))), shape)
             for name, values in data.items() if np.shape(values) == (3, 4)}  # fmt: skip
    return Result([axis.name for axis in axes], variables, data | given, {}, {"title": "t"})


RESULT = result_over(ERRORS, SPEEDS)


def drawn(variable: str, result: Result = RESULT, **options):
    axes = Figure(layout="constrained").subplots()
    image = parameter_map(axes, result, variable, **options)
    return axes, image


def legend_of(axes) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()] if axes.get_legend() else []


@pytest.mark.parametrize("variable", ["motion", "period"])
def test_every_cell_has_the_colour_of_its_motion_and_period(variable):
    axes, image = drawn(variable)
    colours = image.to_rgba(image.get_array()).reshape(-1, 4)
    wanted = [SHADES[kind].lower() for row in KINDS for kind in row]
    assert [to_hex(colour) for colour in colours] == wanted
    assert legend_of(axes) == [name for name in SHADES if name in np.ravel(KINDS)]


def test_numbers_are_those_of_the_file_and_what_diverged_is_named():
    for variable in ("lyapunov_exponent", "time_apart_tangential", "approach_mean_tangential"):
        axes, image = drawn(variable)
        values = image.get_array()
        assert np.array_equal(values.filled(np.nan), RESULT[variable], equal_nan=True)
        missing = ["diverged"] + ["no value"] * (variable == "approach_mean_tangential")
        assert legend_of(axes) == missing
        assert len(axes.child_axes) == 1
        if "no value" in missing:
            patch = axes.get_legend().legend_handles[1]
            assert np.array_equal(image.to_rgba(values)[0, 0], patch.get_facecolor())


@pytest.mark.parametrize(
    ("variable", "mask"),
    [("motion", np.isin(MOTION, (1, 3, 4))), ("lyapunov_exponent", np.isnan(EXPONENT))],
)
def test_hatches_lie_on_the_cells_they_belong_to(variable, mask):
    axes, _ = drawn(variable)
    outlines = [one.get_path() for one in axes.get_children() if isinstance(one, PathPatch)]
    centres = np.stack(np.meshgrid(SPEEDS.values, ERRORS.values), axis=-1).reshape(-1, 2)
    hatched = np.any([outline.contains_points(centres) for outline in outlines], axis=0)
    assert np.array_equal(hatched.reshape(mask.shape), mask)


def test_cells_end_halfway_between_their_values():
    axes, image = drawn("motion")
    assert axes.get_xlim() == (850.0, 1600.0) and axes.get_ylim() == (-0.5, 5.5)
    assert axes.get_xlabel() == "Speed (rpm)" and axes.get_ylabel() == "Pitch error, $P$"
    axes.figure.set_layout_engine(None)
    picture = np.zeros((3, 4), int)
    for row, y in enumerate((0.4, 2.4, 2.6)):
        for column, x in enumerate((949.0, 951.0, 1149.0, 1399.0)):
            place = axes.transData.transform((x, y))
            mouse = type("At", (), {"x": place[0], "y": place[1], "xdata": x, "ydata": y})
            picture[row, column] = image.get_cursor_data(mouse)
    kinds = image.get_array()
    assert picture.tolist() == kinds[[0, 1, 2]][:, [0, 1, 1, 2]].tolist()


def test_exponents_are_white_at_zero_blue_below_and_orange_above():
    _, image = drawn("lyapunov_exponent")
    below, zero, above = image.to_rgba(np.array([-0.2, 0.0, 0.2]))[:, :3]
    assert zero.min() > 0.94
    assert below[2] > below[0] and above[0] > above[2]
    lightness = image.to_rgba(np.array([-0.4, 0.5]))[:, :3].sum(axis=1)
    assert lightness[1] < 0.5 < lightness[0]


@pytest.mark.parametrize(
    ("outlier", "ends"), [(-90.0, "min"), (90.0, "max"), (None, "neither")], ids=str
)
def test_the_bar_of_colours_ends_in_an_arrow_where_numbers_lie_beyond_it(outlier, ends):
    """One outlier among 60 numbers is beyond the robust limits, on its own side."""
    numbers = np.linspace(0.0, 1.0, 60)
    if outlier is not None:
        numbers[7] = outlier
    axes = Figure(layout="constrained").subplots()
    edges = np.arange(11.0), np.arange(7.0)
    image = _number_cells(axes, edges, numbers.reshape(6, 10), signed=False)
    (bar,) = axes.child_axes
    assert image.colorbar.extend == ends
    # A triangle lies beyond an end of the bar; the left end is the lower one.
    patches = [one.get_path().get_extents() for one in bar.get_children() if type(one) is PathPatch]
    assert len(patches) == (outlier is not None)
    assert all((patch.x0 < 0.0) == (ends == "min") for patch in patches)
    assert (image.norm.vmin > numbers.min()) == (ends == "min")
    assert (image.norm.vmax < numbers.max()) == (ends == "max")


def test_the_bar_of_colours_has_both_arrows_where_numbers_lie_beyond_both_ends():
    numbers = np.linspace(0.0, 1.0, 120)
    numbers[[7, 70]] = -90.0, 90.0
    axes = Figure(layout="constrained").subplots()
    edges = np.arange(11.0), np.arange(13.0)
    image = _number_cells(axes, edges, numbers.reshape(12, 10), signed=True)
    assert image.colorbar.extend == "both"


def test_a_part_of_the_range_is_that_of_the_first_parameter():
    axes, image = drawn("motion", between=(950.0, 1350.0))
    assert axes.get_xlim() == (950.0, 1350.0)
    assert np.array_equal(image.get_array(), drawn("motion")[1].get_array()[:, 1:3])


@pytest.mark.parametrize(("width", "shape"), [(85.0, (3, 1)), (180.0, (1, 3))])
def test_the_page_has_a_panel_for_each_of_motion_exponent_and_contact(width, shape):
    page = map_page(RESULT, width_mm=width, marked={"operation_speed_rpm": 1200.0})
    assert len(page.axes) == 3
    assert page.axes[0].get_gridspec().get_geometry() == shape
    titles = [axes.get_title(loc="left").split("$ ", 1)[1] for axes in page.axes]
    assert titles[0] == "Motion and period" and titles[1].startswith("Largest Lyapunov exponent")
    flags = [flag.replace("_", " ") for flag in CONTACT_STATES if flag != "diverged"]
    assert legend_of(page.axes[2]) == flags
    for axes in page.axes:
        assert [line.get_xdata() for line in axes.lines] == [[1200.0, 1200.0]] * 2
    assert legend_of(page.axes[0])[-1] == "speed = 1200 rpm"
    # A legend or a colour bar with its title must not cover a map.
    boxes = [axes.get_legend() or axes.child_axes[0] for axes in page.axes]
    renderer = page.canvas.get_renderer()
    for one in boxes:
        box = one.get_tightbbox(renderer)
        assert not any(box.overlaps(axes.bbox.padded(-1.0)) for axes in page.axes)


def test_one_start_of_several_is_chosen_and_reported():
    several = result_over(ERRORS, SPEEDS, CATALOGUE.axis("start", np.arange(2)))
    with pytest.raises(FigureError, match=r"along start; a map shows one of them.*--at start=0"):
        map_page(several)
    assert map_page(several.sel(start=1)).get_suptitle() == "start 1"


def test_a_result_over_one_parameter_is_no_map():
    with pytest.raises(FigureError, match="two swept parameters; the result has pitch_error"):
        parameter_map(Figure().subplots(), RESULT.sel(operation_speed_rpm=900.0))


@pytest.fixture
def path(tmp_path):
    RESULT.save(tmp_path / "map.h5")
    return tmp_path / "map.h5"


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ([], "map"),
        (["--variable", "time_apart_tangential"], "map_time_apart_tangential"),
        (["--from", "950", "--mark", "pitch_error=2"], "map_from_950"),
        (["--at", "pitch_error=1", "--mark", "1200"], "map_pitch_error_1"),
    ],
)
def test_the_command_draws_the_map(path, arguments, name, capsys):
    assert main([str(path), "--format", "png", "--dpi", "60", *arguments]) == 0
    assert capsys.readouterr().out == f"{path.with_name(name)}.png\n"


def test_a_pdf_has_its_cells_as_images_and_its_words_as_text(path):
    assert main([str(path), "--format", "pdf", "--variable", "lyapunov_exponent"]) == 0
    drawing = path.with_name("map_lyapunov_exponent.pdf").read_bytes()
    assert b"/Subtype /Image" in drawing and b"/Type /Font" in drawing


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--stages"], "a map; --at pitch_error=VALUE makes a diagram of it"),
        (["{}"], "map.h5: only diagrams of sweeps are drawn over each other"),
        (["--variable", "section_delta_5"], "no variable 'section_delta_5' of each lane"),
        (["--variable", "end_state"], "no variable 'end_state' of each lane"),
        (["--mark", "torque=3"], "--mark torque: is no swept parameter of the figure"),
        (["--mark", "3"], "--mark 3: must be NAME=VALUE, each of the axes pitch_error, operation"),
        (["--mark", "pitch_error=99"], "--mark 99: pitch_error runs from "),
        (["--from", "5000"], "no lane with operation_speed_rpm from 5000; the result has"),
        (["--shares"], "fix others with --at NAME=VALUE"),
    ],
)
def test_what_no_map_can_be_is_reported(path, arguments, message, capsys):
    assert main([str(path), *(text.format(path) for text in arguments)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and message in err
    assert len(list(path.parent.iterdir())) == 1


def test_a_motion_that_nobody_labelled_cannot_be_drawn():
    with pytest.raises(FileError, match=r"outputs\.motion = true"):
        drawn("motion", result_over(ERRORS, SPEEDS, labelled=False))


def test_lanes_that_diverged_look_alike_in_all_maps():
    state = np.where(MOTION == 4, CONTACT_STATES.index("diverged"), MOTION % 4)
    data = {name: RESULT[name] for name in RESULT} | {"contact_state_tangential": state}
    result = Result(RESULT.axes, [*RESULT.variables.values()], data, {}, {})
    axes = Figure().subplots()
    parameter_map(axes, result, "contact_state_tangential")
    assert legend_of(axes)[-1] == "diverged"
    patch = axes.get_legend().get_patches()[-1]
    assert patch.get_facecolor() == Patch(**look_of("diverged")).get_facecolor()
