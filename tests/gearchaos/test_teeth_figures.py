"""The page of a response of teeth with individual errors shows known waves at known orders."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.text import Text

import gearchaos
from gearchaos.figures import bifurcation_page, response_page, shares_page
from gearchaos.figures.page import Page
from gearchaos.figures.response import repeats_after
from gearchaos.figures.style import BLACK, BLUE, VERMILION
from gearchaos.info import main as info
from gearchaos.models.gear_pair.outputs import CATALOGUE, DIRECTIONS
from gearchaos.outputs.variable import coordinate
from gearchaos.plot import main as plot
from gearchaos.results.reading.excitation import Excitation, excitation_of
from gearchaos.results.reading.result import Result
from gearchaos.stages import main as stages

from .commands import small_config
from .listed_variables import parameter, sweep_variables

STEPS, DRIVING, DRIVEN = 8, 4, 6
MEET = 12
"""Mesh periods after which the same teeth meet again."""
STATES = ("delta_5", "delta_5_rate")
TURN = 2.0 * np.pi
SCALE_UM = 25.0


def known_teeth(
    recorded: int = 4,
    kept: int = 2 * MEET,
    extra_order: float = 0.0,
    scaled: bool = True,
    **facts: float | str,
) -> Result:
    """Return a response with lines of the mesh, of both shafts and of another order.

    It has ``recorded`` periods of the excitation. The amplitudes are 1 for the mesh, 0.3 for the
    driving shaft, 0.2 for the driven shaft and 0.1 for the other order.
    """
    time = np.arange(-recorded * MEET * STEPS, 0 + 1) / STEPS
    lines = {1.0: 1.0, 3.0 / DRIVING: 0.3, 1.0 / DRIVEN: 0.2}
    lines |= {extra_order: 0.1} if extra_order else {}
    wave, rate, acceleration = (
        sum(
            height * (TURN * order) ** power * np.cos(TURN * order * time + power * np.pi / 2.0)
            for order, height in lines.items()
        )
        for power in range(3)
    )
    motion = dict(zip((*STATES, "delta_5_acceleration"), (wave, rate, acceleration), strict=True))
    record = {name: values[np.newaxis, -kept * STEPS - 1 :] for name, values in motion.items()}
    axis = coordinate("pitch_error", "1", "multiple of the pitch error", "$P$", np.array([2.0]))
    known = {
        "excitation_period": MEET,
        "driving_teeth": DRIVING,
        "driven_teeth": DRIVEN,
    } | facts
    meanings = ("periodic", "quasi_periodic", "chaotic", "unresolved", "diverged", "grows")
    variables = sweep_variables(
        [axis],
        states=STATES,
        section=STATES,
        section_points=recorded * MEET,
        lyapunov=False,
        status_meanings=("ok", "diverged"),
        motion_meanings=meanings,
        excitation_period=MEET,
    )
    instants = np.arange(kept * STEPS + 1) / STEPS
    variables += CATALOGUE.motion([axis], instants, STATES, DIRECTIONS[:1])
    data = {
        **{f"section_{name}": motion[name][np.newaxis, STEPS::STEPS] for name in STATES},
        **dict.fromkeys(("motion", "bands", "status", "return_distance"), np.zeros(1)),
        "period": np.ones(1),
        "diverged_period": np.full(1, -1),
        "start_state": np.zeros((1, 2)),
        "end_state": np.zeros((1, 2)),
        "mesh_period": np.ones(1),
        **record,
        "mesh_error": 0.01 * record["delta_5"],
        "transmission_error": 1.01 * record["delta_5"],
        "mesh_force_tangential": record["delta_5"],
        "contact_tangential": np.ones((1, kept * STEPS + 1)),
    }
    scale = parameter("length_scale", SCALE_UM, "derived", "um")
    scales = {"length_scale": scale} if scaled else {}
    return Result([axis.name], variables, data, scales, {"title": "teeth", **known})


@pytest.mark.parametrize(
    ("given", "understood"),
    [
        ({}, Excitation(1, 0, 0)),
        ({"excitation_period": 1}, Excitation(1, 0, 0)),
        (
            {"excitation_period": 798, "driving_teeth": 21, "driven_teeth": 38},
            Excitation(798, 21, 38),
        ),
        (
            {"excitation_period": 0, "driving_teeth": -3, "driven_teeth": "x"},
            Excitation(1, 0, 0),
        ),
        ({"excitation_period": 2.5, "driving_teeth": 21}, Excitation(1, 21, 0)),
    ],
)
def test_what_attributes_report_of_the_excitation(given, understood):
    assert excitation_of(given) == understood


@pytest.mark.parametrize(
    ("recorded", "extra_order", "repeats"),
    [(4, 0.0, MEET), (6, 1.0 / (2 * MEET), 2 * MEET), (4, 1.0 / (2 * MEET), 0), (2, 0.0, 0)],
)
def test_motions_repeat_after_whole_excitations_if_there_are_three_of_them(
    recorded, extra_order, repeats
):
    assert repeats_after(known_teeth(recorded, extra_order=extra_order), 0) == repeats


@cache
def known_page() -> Page:
    """Return the page of the known teeth; tests must not change it."""
    return response_page(known_teeth(), 0)


def titles(page) -> list[str]:
    return [axes.get_title("right") for axes in page.axes]


def test_error_and_history_share_revolutions_with_a_tick_for_each_tooth():
    result = known_teeth()
    error, history = known_page().axes[:2]
    x, y = error.lines[0].get_data()
    assert (x[0], x[-1]) == (2 * MEET - 2 * DRIVING, 2 * MEET)
    np.testing.assert_allclose(y, SCALE_UM * result["mesh_error"][0, -x.size :])
    assert error.get_ylabel() == "Pitch error of\nthe mesh, $e$ (µm)"
    np.testing.assert_array_equal(history.lines[0].get_ydata(), result["delta_5"][0, -x.size :])
    assert error.get_xlim() == history.get_xlim() == (x[0], x[-1])
    ticks = history.get_xticks()
    shown = (ticks >= x[0]) & (ticks <= x[-1])
    labels = [text.get_text() for text in history.get_xticklabels()]
    assert [label for label, seen in zip(labels, shown, strict=True) if seen] == [
        *("0", "0.5", "1", "1.5", "2")
    ]
    every = {*np.round(ticks[shown], 9), *np.round(history.get_xticks(minor=True), 9)}
    assert every >= {*np.arange(x[0], x[-1] + 1.0)}
    assert history.get_xlabel() == "Revolutions of the driving gear, a tick for each tooth"


def test_without_a_unit_of_lengths_the_error_is_dimensionless():
    (error, *_) = response_page(known_teeth(scaled=False), 0).axes
    assert error.get_ylabel() == "Pitch error of the\nmesh, $e$ (unit $b\\prime$)"


def test_points_once_an_excitation_stand_before_those_once_a_mesh_period():
    _, _, portrait, section, _ = known_page().axes
    for axes, periods, first in ((portrait, 2, 0), (section, 4, MEET - 1)):
        points = [line for line in axes.lines if line.get_marker() == "o"]
        behind, before = sorted(points, key=lambda line: line.get_zorder())
        marked = behind.get_xydata()[first::MEET]
        np.testing.assert_array_equal(before.get_xydata(), marked)
        assert len(before.get_xydata()) == (periods + 1 if axes is portrait else periods)
        np.testing.assert_allclose(marked, marked[-1:].repeat(len(marked), 0), atol=1e-9)
        assert to_hex(before.get_color()) == VERMILION.lower()
        assert len(np.unique(np.round(behind.get_xydata(), 6), axis=0)) > 1


@pytest.mark.parametrize(
    ("made", "words"),
    [
        ({}, "period 1 of the excitation, 12 mesh periods"),
        (
            {"recorded": 6, "extra_order": 1.0 / (2 * MEET)},
            "period 2 of the excitation, 24 mesh periods",
        ),
        ({"recorded": 2}, ""),
    ],
)
def test_the_section_says_after_what_the_motion_repeats(made, words):
    page = response_page(known_teeth(**made), 0) if made else known_page()
    assert titles(page)[:4] == [
        "$P$ = 2",
        "excitation period: 12 mesh periods",
        "last 24 mesh periods, black: last 2 revolutions",
        words,
    ]


def coloured(axes) -> dict[str, set[float]]:
    """Return the shaft orders of the visible lines, by colour."""
    (lines,) = axes.collections
    found: dict[str, set[float]] = {}
    for segment, colour in zip(lines.get_segments(), lines.get_colors(), strict=True):
        if segment[1, 1] > 1e-3:
            order = round(float(segment[0, 0]) * DRIVING, 6)
            found.setdefault(to_hex(colour).upper(), set()).add(order)
    return found


def test_lines_have_the_colour_of_their_shaft_over_its_orders():
    *_, spectrum = response_page(known_teeth(6, extra_order=5.0 / (2 * MEET)), 0).axes
    driven, other = round(DRIVING / DRIVEN, 6), round(5.0 * DRIVING / (2 * MEET), 6)
    assert coloured(spectrum) == {
        BLACK: {float(DRIVING)},
        VERMILION: {3.0},
        BLUE: {driven},
        "#A6A6A6": {other},
    }
    assert spectrum.get_title("right") == "Rectangular window, 24 mesh periods"
    assert [text.get_text() for text in spectrum.get_legend().get_texts()] == [
        *("mesh", "driving shaft", "driven shaft, multiples of 4/6", "other")
    ]
    labels = {text.get_text() for text in spectrum.get_xticklabels()}
    assert labels >= {"0", "4", "8", "12"}
    assert spectrum.get_xlabel() == "Order of the driving shaft (mesh: 4)"


def test_a_short_record_resolves_no_shaft():
    *_, spectrum = response_page(known_teeth(kept=MEET - 1), 0).axes
    assert spectrum.get_title("right") == "Hann window, 11 mesh periods"
    assert {*coloured(spectrum)} == {BLACK, "#A6A6A6"}
    names = [text.get_text() for text in spectrum.get_legend().get_texts()]
    assert names == ["mesh", "not resolved by so short a record"]


def test_what_does_not_repeat_is_transformed_over_whole_excitations():
    result = known_teeth(4, kept=MEET + 5, extra_order=1.0 / np.sqrt(7.0))
    *_, spectrum = response_page(result, 0).axes
    assert spectrum.get_title("right") == "Hann window, 12 mesh periods"


@pytest.mark.parametrize(
    ("width", "variable", "panels"),
    [(180.0, None, 5), (85.0, None, 5), (180.0, "mesh_force_tangential", 3)],
)
def test_the_page_has_texts_a_journal_accepts(width, variable, panels):
    page = response_page(known_teeth(), 0, variable, width_mm=width)
    letters = [axes.get_title("left") for axes in page.axes]
    assert letters == [f"({name})" for name in "abcde"[:panels]]
    written = [text for text in page.findobj(Text) if text.get_text()]
    assert min(text.get_fontsize() for text in written) >= 7.0
    drawn, inches = page.get_tightbbox(), page.get_size_inches()
    assert min(drawn.x0, drawn.y0) >= 0.0
    assert (drawn.x1 <= inches[0], drawn.y1 <= inches[1]) == (True, True)
    boxes = [axes.get_tightbbox() for axes in page.axes]
    assert not any(one.overlaps(other) for one in boxes for other in boxes if one is not other)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "teeth.h5"
    known_teeth().save(path)
    return path


def test_a_gear_without_errors_has_no_lines_of_its_own():
    """Half of the mesh order is a multiple of the other shaft order, but has another cause."""
    result = known_teeth(recorded=8, extra_order=0.5, excitation_period=DRIVING)
    *_, spectrum = response_page(result, 0).axes
    assert BLUE not in coloured(spectrum)


GRADES = (
    "pair.teeth=[6, 9]",
    'pitch_error={kind="grade",grade=7,realisations=3}',
    'sweep={parameter="pitch_error.grade",values=[5,7]}',
    'scene.effects=["pitch_error","stiffness_variation","backlash"]',
    'outputs.section=["delta_5"]',
    "integration.steps_per_period=120",
)


def test_a_sweep_and_a_response_know_their_teeth(tmp_path):
    config = gearchaos.load_config(small_config(tmp_path), GRADES)
    result = gearchaos.run(config)
    assert excitation_of(result.metadata) == Excitation(18, 6, 9)
    assert result.attributes("period")["long_name"].startswith("periods of the excitation, 18 mesh")
    assert shares_page(result).axes[0].get_title("right") == "3 gear pairs each"
    response = gearchaos.respond(config.replace("integration.recorded_periods", 54), periods=18)
    assert excitation_of(response.metadata) == excitation_of(result.metadata)
    page = response_page(response, 0)
    assert page.axes[0].get_title("right") == "accuracy grade of both gears = 5, gear pair 0"
    assert page.axes[4].get_xlabel() == "Order of the driving shaft (mesh: 6)"


def test_a_sine_says_nothing_of_teeth(tmp_path):
    config = gearchaos.load_config(small_config(tmp_path), ["sweep.count=2"])
    result = gearchaos.run(config)
    assert excitation_of(result.metadata) == Excitation()
    assert not {*Excitation._fields[1:]} & result.metadata.keys()
    assert excitation_of(result.metadata).in_words == ""


@pytest.mark.parametrize(("shown", "last"), [(12, ""), (48, ""), (5, ", and the last 5 are drawn")])
def test_the_points_of_a_period_are_counted_as_they_are_drawn(shown, last):
    excitation = Excitation(excitation_period=12)
    words = f"the excitation repeats after 12 mesh periods:\nperiod 1 has 12 points{last}"
    assert excitation.points_in_words(shown) == words
    assert Excitation().points_in_words(shown) == ""


def test_a_diagram_says_how_many_points_a_period_has():
    section = bifurcation_page(known_teeth())
    assert "period 1 has 12 points" in section.get_supxlabel()
    assert "points" not in bifurcation_page(known_teeth(), "return_distance").get_supxlabel()


def test_the_commands_say_what_a_period_is(path, capsys):
    words = "periods are those of the excitation, 12 mesh periods each\n"
    for command in (stages, info):
        assert command([str(path)]) == 0
        assert words in capsys.readouterr().out
    wording = "periods of the excitation, 12 mesh periods each, after which the motion repeats"
    assert known_teeth().variables["period"].long_name.startswith(wording)


def test_the_command_draws_the_page(path, capsys):
    assert plot([str(path), "--format", "png", "--dpi", "50"]) == 0
    out, err = capsys.readouterr()
    assert out == f"{path.parent}/teeth_pitch_error_2.png\n"
    assert err == "gearchaos plot: 1 lane over pitch_error, 180 mm x 192 mm at 50 dpi\n"
