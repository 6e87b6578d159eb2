"""A sweep up and down in one file: its directions differ between two folds."""

import json

import matplotlib.colors
import numpy as np
import pytest

import gearchaos
from gearchaos import figures
from gearchaos.engine.recomputing import computable
from gearchaos.engine.refinement import refined_jumps
from gearchaos.errors import ConfigurationError, FigureError
from gearchaos.outputs.names import WAYS
from gearchaos.records.label import CHAOTIC
from gearchaos.results.reading.jumps import apart

from .commands import run_module, same_data
from .short_sweeps import MASSES, PAN2021

STEP = 0.05
WHERE = (
    "start.carry=both",
    "sweep.from=0.55",
    "sweep.to=2.0",
    "sweep.count=30",
    "integration.transient_periods=150",
    "integration.recorded_periods=60",
    "outputs.section_points=8",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("both")
    flags = [word for override in WHERE for word in ("--set", override)]
    arguments = str(PAN2021), *flags, "--output", "both.h5", "--quiet"
    assert run_module("gearchaos.sweep", *arguments, cwd=folder) == (0, "both.h5\n", "")
    return folder


@pytest.fixture(scope="module")
def result(folder):
    return gearchaos.open_result(folder / "both.h5")


@pytest.fixture(scope="module")
def folds():
    """Return the values at which System.follow ends the two coexisting motions of period 1."""
    ends = []
    for first, last, contact in ((1.5, 0.5, False), (1.0, 2.0, True)):
        system = gearchaos.System(PAN2021, pitch_error=first)
        state = system.integrate(300, start=np.eye(6)[0] * (1.2 if contact else -1.0)).states[-1]
        branch = system.follow(system.orbit(guess=state), "pitch_error", first, last, 1e-6)
        assert branch.loss.name == "FOLD"
        ends.append(branch.value)
    return ends


def test_the_file_is_the_result_in_memory_and_names_its_directions(result):
    assert result.axes == ("pitch_error", "direction")
    assert result["direction"].tolist() == [0, 1]
    assert result.attributes("direction")["flag_meanings"] == "upwards downwards"
    assert same_data(result, gearchaos.run(gearchaos.load_config(PAN2021, WHERE)))
    down = result.sel(direction="downwards")
    assert (down.axes, down.fixed) == (("pitch_error",), {"direction": 1.0})
    assert np.array_equal(down["end_state"], result["end_state"][:, 1])
    with pytest.raises(ConfigurationError, match="must be a number or upwards or downwards"):
        result.sel(direction="up")


def test_both_directions_differ_between_the_folds_of_the_coexisting_motions(result, folds):
    (stretch,) = apart(result)
    assert (stretch.motion_upwards, stretch.motion_downwards) == ("period 1", "period 1")
    assert stretch.start - STEP <= folds[0] <= stretch.start
    assert stretch.end <= folds[1] <= stretch.end + STEP
    assert stretch.lower == pytest.approx(folds[0], abs=STEP / 2)
    assert stretch.upper == pytest.approx(folds[1], abs=STEP / 2)


def test_narrow_stretches_and_those_of_one_direction_are_not_reported(result):
    assert apart(result, 0.95) == []
    assert apart(result.sel(direction="upwards")) == []
    assert refined_jumps(computable(result, "both.h5"), result, [], 1e-3) == []


def test_refined_jumps_are_the_folds(folder, folds):
    ended = run_module("gearchaos.stages", "both.h5", "--refine", "1e-5", "--json", cwd=folder)
    facts = json.loads(ended.out)
    (stretch,) = facts["directions_apart"]
    assert (stretch["motion_upwards"], stretch["motion_downwards"]) == ("period 1", "period 1")
    downwards, upwards = facts["boundaries"]
    assert (downwards["direction"], upwards["direction"]) == ("downwards", "upwards")
    for jump, fold in zip((downwards, upwards), folds, strict=True):
        assert jump["above"] - jump["below"] <= 1.1e-5
        assert jump["below"] - 1e-5 <= fold <= jump["above"] + 1e-5
        assert jump["loss"].startswith("fold")
        assert jump["multiplier"][0] > 0.9


def test_a_direction_whose_motion_continues_does_not_jump():
    sweep = "sweep={parameter='frequency',from=0.575,to=0.604166666666,count=8}"
    result = gearchaos.run(gearchaos.load_config(MASSES, [sweep]))
    stretches = apart(result)
    assert stretches
    # Upwards, the motion of period 6 continues from 0.5875 to 0.5917. Downwards, it changes to
    # period 7 between these values.
    for jump in refined_jumps(computable(result, "masses.h5"), result, stretches, 1e-6):
        stays = jump.loss.startswith("the orbit stays stable")
        assert not (stays and jump.label_below == jump.label_above), jump


def test_the_table_reports_where_directions_differ_within_80_columns(folder):
    ended = run_module("gearchaos.stages", "both.h5", cwd=folder)
    assert (ended.code, ended.err) == (0, "")
    assert "slice direction = upwards; others with --at direction=VALUE" in ended.out
    text = "0.8 to 1.65: other motions upwards (period 1) than downwards (period 1)"
    assert text in ended.out.splitlines()
    assert max(map(len, ended.out.splitlines())) <= 80
    one = run_module("gearchaos.stages", "both.h5", "--at", "direction=downwards", cwd=folder)
    assert "slice direction = downwards" in one.out
    assert "other motions" not in one.out


def test_one_direction_alone_is_not_refined(folder):
    arguments = "both.h5", "--at", "direction=upwards", "--refine", "0.01"
    ended = run_module("gearchaos.stages", *arguments, cwd=folder)
    assert (ended.code, ended.out) == (2, "")
    assert "nothing lies between lanes whose starts are carried on" in ended.err


def test_the_response_and_the_system_of_a_lane_are_on_its_branch(folder, result):
    arguments = "both.h5", "--periods", "1", "--quiet", "--at", "pitch_error=1.2"
    for number, way in enumerate(WAYS):
        named = ("--at", f"direction={way}", "--output", f"{way}.h5")
        assert run_module("gearchaos.response", *arguments, *named, cwd=folder).code == 0
        response = gearchaos.open_result(folder / f"{way}.h5")
        assert f"pitch_error = 1.2, direction = {way} of both.h5" in response.metadata["notes"]
        lane = result.sel("nearest", pitch_error=1.2, direction=way)
        assert np.array_equal(response["start_state"][0], lane["end_state"])
        system = gearchaos.System.of_lane(result, pitch_error=1.2, direction=number)
        assert np.array_equal(system.state, lane["end_state"])


def test_info_names_both_directions(folder):
    told = " ".join(run_module("gearchaos.info", "both.h5", cwd=folder).out.split())
    assert "2 values, upwards and downwards lanes 60" in told


def test_a_table_names_the_direction_of_each_lane(result):
    pandas = pytest.importorskip("pandas")
    table = result.to_dataframe()
    assert table.index.get_level_values("direction").unique().tolist() == list(WAYS)
    assert table.loc[(2.0, "downwards"), "status"] == "ok"
    assert isinstance(table, pandas.DataFrame)


def test_chaos_on_two_attractors_is_no_motion_of_one_label(folder):
    result = gearchaos.open_result(folder / "both.h5")
    result["motion"][:], result["period"][:] = CHAOTIC, 0
    (stretch,) = apart(result)
    assert (stretch.lower, stretch.upper) == pytest.approx((0.775, 1.675))
    assert stretch.motion_upwards == stretch.motion_downwards == "chaotic"


def test_the_diagram_overlays_the_directions_and_shades_where_they_differ(result):
    page = figures.bifurcation_page(result)
    for axes in page.axes:
        (shade,) = axes.patches
        assert shade.get_x() == pytest.approx(0.775)
        assert shade.get_x() + shade.get_width() == pytest.approx(1.675)
        assert len({matplotlib.colors.to_hex(line.get_color()) for line in axes.lines}) >= 3
        (ticks,) = (line for line in axes.lines if line.get_label() == "jumps")
        assert ticks.get_xdata().tolist() == pytest.approx([0.775, 1.675])
    named = [text.get_text() for text in page.axes[0].get_legend().get_texts()]
    assert named == ["upwards", "downwards", "directions differ", "jumps"]


def test_several_files_name_their_directions_and_stages_want_one(result):
    one = result.sel(direction="upwards")
    page = figures.bifurcation_page([result, one], labels=["mine", "other"])
    named = [text.get_text() for text in page.axes[0].get_legend().get_texts()]
    assert named[:3] == ["mine, upwards", "mine, downwards", "other"]
    with pytest.raises(FigureError, match="choose one with --at direction=upwards"):
        figures.bifurcation_page(result, stages=True)
    assert figures.bifurcation_page(one, stages=True).get_suptitle() == "upwards"


def test_shares_are_not_those_of_directions(result):
    with pytest.raises(ConfigurationError, match="has the axes pitch_error, direction"):
        figures.shares_page(result)
