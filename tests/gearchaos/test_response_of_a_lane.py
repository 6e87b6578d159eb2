"""The time response of a lane continues from the end of the lane."""

from pathlib import Path

import numpy as np
import pytest
from gearchaos_kernels import integrate

from gearchaos import Result, load_config, open_result, run
from gearchaos.engine.run_plan import plan_run
from gearchaos.figures.labels import in_words, place_of
from gearchaos.response import main

from .short_sweeps import METHODS, PAN2021, SHORT

RECORDED = 12
LANE = 9


def config(*overrides: str):
    return load_config(PAN2021, (*SHORT, *overrides))


def going_on(folder: Path, result: Result, *at: str) -> Result:
    """Save a result, run the command on the lane at some coordinates, and return the response."""
    result.save(folder / "sweep.h5", overwrite=True)
    places = [word for text in at for word in ("--at", text)]
    output = str(folder / "response.h5")
    arguments = [str(folder / "sweep.h5"), *places, "--periods", "4", "-o", output, "-q"]
    assert main([*arguments, "--overwrite"]) == 0
    return open_result(output)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("carry", ["none", "upwards", "downwards"])
def test_the_motion_goes_on_bit_for_bit_on_the_branch_of_the_lane(tmp_path, carry, method):
    swept = config(f"start.carry={carry}", f"integration.method={method}")
    result = run(swept)
    value = result["pitch_error"][LANE]
    found = going_on(tmp_path, result, f"pitch_error={value}")
    assert found["pitch_error"].tolist() == [value]
    np.testing.assert_array_equal(found["start_state"][0], result["end_state"][LANE])
    sweep = plan_run(swept)
    lane, start = np.array([LANE]), result["end_state"][LANE : LANE + 1]
    plan = sweep.plan._replace(transient_periods=0, section_points=RECORDED)
    onwards = integrate(sweep.lanes.system_of(lane), start, plan)
    np.testing.assert_array_equal(found["section_delta_5"][0], onwards.section[0, :, 0])
    np.testing.assert_array_equal(found["end_state"], onwards.end_state)
    np.testing.assert_array_equal(found["delta_5"][0, 0], onwards.section[0, -5, 0])
    assert found.metadata["transient_periods"] == 0
    assert "continues from the end of the lane pitch_error = " in found.metadata["notes"]
    # The configuration in the file computes the same result again.
    again = run(load_config(_resolved(tmp_path, found)))
    np.testing.assert_array_equal(again["end_state"], onwards.end_state)


def test_a_lane_from_rest_goes_on_as_a_longer_transient_would(tmp_path):
    found = going_on(tmp_path, run(config()), "11")
    (value,) = found["pitch_error"].tolist()
    longer = run(
        config(
            f"sweep={{parameter='pitch_error', values=[{value!r}]}}",
            f"integration.transient_periods={6 + RECORDED}",
            f"outputs.section_points={RECORDED}",
        )
    )
    np.testing.assert_array_equal(found["section_delta_5"], longer["section_delta_5"])


def test_every_axis_of_a_result_names_its_lane(tmp_path, capsys):
    load = "second_sweep={parameter='load', values=[0.1, 0.2]}"
    random = ("start.kind=random", "start.count=2")
    result = run(config("sweep.count=3", load, *random))
    found = going_on(tmp_path, result, "load=0.19", "pitch_error=8", "start=1")
    np.testing.assert_array_equal(found["start_state"][0], result["end_state"][1, 1, 1])
    assert found.axes == ("pitch_error",)
    assert found.parameters["load"].values == 0.2
    assert found.fixed == {"load": 0.2, "start": 1.0}
    assert in_words(found, place_of(found, 0)) == "$f_n$ = 0.2, start 1, $P$ = 7.5"
    sweep, output = str(tmp_path / "sweep.h5"), str(tmp_path / "none.h5")
    for arguments, message in {
        ("--at", "7"): "--at 7: must be NAME=VALUE, each of the axes load, pitch_error, start once",
        ("--at", "load=0.1"): "name one lane, with --at pitch_error=VALUE and --at start=VALUE as",
        ("--at", "load=0.3"): "load = 0.3: lies beyond the values of the result, 0.1 to 0.2",
        ("--at", "upwards"): "direction: is no axis of the result",
        ("--at", "torque=0"): "torque: is no axis of the result; its axes: load, pitch_error",
        (): "name one lane, with --at load=VALUE and --at pitch_error=VALUE and",
        ("--pitch-error", "7"): "name one lane, with --at load=VALUE and --at start=VALUE as",
        ("--at", "7", "--set", "sweep.count=3"): "with its own configuration; leave --set out",
    }.items():
        assert main([sweep, *arguments, "-o", output]) == 2
        assert message in capsys.readouterr().err
    assert main([sweep, "--at", "load=0.1", "-o", sweep]) == 2
    assert not Path(output).exists()


def test_what_the_file_does_not_hold_of_the_axial_pair_is_not_made_up(tmp_path):
    full = PAN2021.with_name("pan2021_full.toml")
    without = (*SHORT, "sweep.count=3", "outputs.lyapunov=false", 'outputs.section=["delta_5"]')
    found = going_on(tmp_path, run(load_config(full, without)), "3")
    assert "delta_1" in found
    assert "delta_3" not in found


def test_no_motion_goes_on_from_a_lane_that_diverged(tmp_path, capsys):
    run(config("sweep.count=3", "groups.load=1e150")).save(tmp_path / "s.h5")
    assert main([str(tmp_path / "s.h5"), "--at", "15", "-o", str(tmp_path / "r.h5")]) == 2
    assert (
        "pitch_error = 15: the status of this lane is diverged; choose another"
        in capsys.readouterr().err
    )
    assert not (tmp_path / "r.h5").exists()


def _resolved(folder: Path, result: Result) -> Path:
    path = folder / "resolved.toml"
    path.write_text(str(result.metadata["configuration_resolved"]))
    return path
