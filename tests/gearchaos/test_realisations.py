"""Drawn gear pairs are an axis of the result, between the swept parameters and the starts."""

import numpy as np
import pytest

import gearchaos
from gearchaos import figures
from gearchaos.engine.computing import block_lanes
from gearchaos.engine.run_plan import plan_run
from gearchaos.engine.steps import stable_steps
from gearchaos.errors import ConfigurationError

from .commands import run_module
from .short_sweeps import assert_same, computed
from .test_tooth_deviations import text_of

DRAWN = '[pitch_error]\nkind = "grade"\ngrade = 9\nseed = 4\nrealisations = 3\n'
STARTS = ("start.kind=random", "start.count=2")


def configured(*overrides):
    text = text_of(DRAWN, "[21, 38]")
    return gearchaos.Configuration.from_toml(text, "gears.toml", ["sweep.count=4", *overrides])


@pytest.fixture(scope="module")
def result():
    return gearchaos.run(configured(*STARTS))


def test_the_axes_are_swept_parameter_gear_pair_and_start(result):
    assert result.axes == ("pitch_error", "realisation", "start")
    assert result.axis == "pitch_error"
    assert result["end_state"].shape == (4, 3, 2, 10)
    assert result["realisation"].tolist() == [0, 1, 2]
    assert result["realisation"].dtype == np.int32
    attributes = result.attributes("realisation")
    assert (attributes["units"], attributes["long_name"]) == ("1", "drawn gear pair")
    second = configured("second_sweep={parameter='pitch_error.grade', values=[6.0, 8.0]}")
    names = [axis.name for axis in plan_run(second).lanes.axes]
    assert names == ["pitch_error_grade", "pitch_error", "realisation"]


def test_one_gear_pair_is_no_axis():
    one = gearchaos.run(configured("pitch_error.realisations=1"))
    assert one.axes == ("pitch_error",)


def test_a_gear_pair_alone_is_that_of_the_row():
    row = gearchaos.run(configured())
    assert row.axes == ("pitch_error", "realisation")
    alone = gearchaos.run(configured().at({"realisation": 2}))
    assert np.array_equal(row.sel(realisation=2)["end_state"], alone["end_state"])


@pytest.mark.parametrize("number", [0.5, -1, float("nan")])
def test_the_number_of_a_gear_pair_is_whole(number):
    with pytest.raises(ConfigurationError, match=r"pitch_error\.first_realisation = "):
        configured().at({"realisation": number})


def test_a_file_keeps_the_axis(result, tmp_path):
    result.save(tmp_path / "drawn.h5")
    again = gearchaos.open_result(tmp_path / "drawn.h5")
    assert again.axes == result.axes
    assert np.array_equal(again["end_state"], result["end_state"])
    assert again["realisation"].dtype == np.int32


@pytest.mark.parametrize("carry", ["upwards", "downwards"])
def test_every_gear_pair_is_carried_for_itself(carry):
    overrides = (*STARTS, f"start.carry={carry}")
    every = plan_run(configured(*overrides))
    found = computed(every, 4)
    assert_same(found, computed(every, 1))
    ends = found["end_state"].reshape(*every.lanes.shape, 10)
    starts = found["start_state"].reshape(*every.lanes.shape, 10)
    later, earlier = (
        (slice(1, None), slice(-1)) if carry == "upwards" else (slice(-1), slice(1, None))
    )
    assert np.array_equal(starts[later], ends[earlier])
    assert block_lanes(every, 1) % 6 == 0


def test_stability_is_that_of_all_gear_pairs():
    fine = plan_run(configured("integration.unstable=raise"))
    _, note = stable_steps(fine.lanes, 2)
    assert note.endswith("of 12 of 12 lanes")
    with pytest.raises(
        ConfigurationError, match=r"for 12 of 12 lanes \(pitch_error from \S+ to \S+\)"
    ):
        stable_steps(plan_run(configured()).lanes, 2)


def test_commands_take_a_gear_pair_by_its_number(result, tmp_path):
    result.save(tmp_path / "drawn.h5")

    def run(command, *arguments):
        ended = run_module(f"gearchaos.{command}", *arguments, cwd=tmp_path)
        assert ended.code == 0, ended.err
        return ended.out

    where, small = ("--at", "realisation=1", "--at", "start=0"), ("--format", "png", "--dpi", "50")
    assert "slice realisation = 1" in run("stages", "drawn.h5", *where)
    assert "all 3 values of realisation; --at" in run("stages", "drawn.h5")
    assert "realisation (realisation) int32" in run("info", "drawn.h5")
    assert "drawn_realisation_1" in run("plot", "drawn.h5", "--at", "realisation=1", *small)
    run("plot", "drawn.h5", "--stages", *small)
    lane = (*where, "--at", "pitch_error=5.0", "--periods", "2", "--output", "lane.h5")
    run("response", "drawn.h5", *lane)
    lane = gearchaos.open_result(tmp_path / "lane.h5")
    assert lane.axes == ("pitch_error",)
    assert "first_realisation = 1\n" in str(lane.metadata["configuration_resolved"])
    run("export", "drawn.h5", "drawn.csv")
    assert (
        (tmp_path / "drawn.csv")
        .read_text()
        .startswith("pitch_error [1],realisation [1],start [1],")
    )


def test_boundaries_are_refined_with_the_gear_pair_of_the_slice(tmp_path):
    gearchaos.run(configured("sweep.count=9")).save(tmp_path / "drawn.h5")
    arguments = ("drawn.h5", "--refine", "0.5", "--at", "realisation=2")
    assert run_module("gearchaos.stages", *arguments, cwd=tmp_path).code == 0
    grades = "sweep={parameter='pitch_error.grade', values=[8.0, 9.0]}"
    gearchaos.run(configured(grades)).save(tmp_path / "drawn.h5", overwrite=True)
    ended = run_module("gearchaos.stages", *arguments, cwd=tmp_path)
    assert (ended.code, ended.out) == (2, "")
    assert "drawn.h5: nothing lies between two values of pitch_error.grade" in ended.err


def test_the_truth_of_flow_maps_is_not_asked_for(tmp_path):
    (tmp_path / "gears.toml").write_text(text_of(DRAWN, "[21, 38]"))
    ended = run_module("gearchaos.accuracy", "gears.toml", cwd=tmp_path)
    assert (ended.code, ended.out) == (2, "")
    told = (
        "gears.toml: the reference solution comes from flow maps, and flow maps know pitch errors"
    )
    assert told in ended.err
    assert "measure errors with integration.error_check" in ended.err


def test_a_response_holds_all_gear_pairs(tmp_path):
    (tmp_path / "gears.toml").write_text(text_of(DRAWN, "[21, 38]"))
    arguments = ("gears.toml", "--pitch-error", "2.0", "--periods", "2")
    assert run_module("gearchaos.response", *arguments, cwd=tmp_path).code == 0
    response = gearchaos.open_result(tmp_path / "gears_response.h5")
    assert response.axes == ("pitch_error", "realisation")
    drawn = run_module(
        "gearchaos.plot", "gears_response.h5", "--format=png", "--dpi=60", cwd=tmp_path
    )
    assert drawn.code == 0 and "realisation_2" in drawn.out.replace(
        "drawn_gear_pair", "realisation"
    )


def test_a_dry_run_reports_how_many_there_are(tmp_path):
    (tmp_path / "gears.toml").write_text(text_of(DRAWN, "[21, 38]"))
    ended = run_module("gearchaos.sweep", "gears.toml", "--dry-run", cwd=tmp_path)
    assert ended.code == 0
    assert (
        "lanes:      120 (40 values of pitch_error from 0 to 5, 3 values of realisation"
        in ended.err
    )


def test_a_diagram_shows_all_gear_pairs_and_calls_what_differs_several_motions(result):
    assert figures.lanes.diagram_lanes(result).numbers.size == 4 * 3 * 2
    drawn = result.sel(start=0)
    drawn["period"][1, 2] += 1
    figure = figures.bifurcation_page(drawn, stages=True)
    texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert "several motions" in texts


def test_a_system_is_one_gear_pair(result):
    system = gearchaos.System(configured(), pitch_error=2.0, at={"realisation": 1})
    assert system.config.pitch_error.first_realisation == 1
    lane = gearchaos.System.of_lane(result, pitch_error=5.0, realisation=2, start=1)
    assert lane.config.pitch_error.first_realisation == 2
    assert np.array_equal(lane.state, result["end_state"][-1, 2, 1])
