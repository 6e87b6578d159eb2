"""The time response: the recorded motion, its file, and the command that computes it."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearchaos import ConfigurationError, Result, load_config, open_result, respond
from gearchaos.engine.response import prepared
from gearchaos.response import main

from .commands import run_module, same_data
from .short_sweeps import PAN2021

SWEEPS = Path(__file__).resolve().parents[2] / "sweeps"
FULL, BASINS = SWEEPS / "pan2021_full.toml", SWEEPS / "basins.toml"
STEPS, PERIODS, RECORDED = 192, 3, 6
SHORT = (
    f"integration.steps_per_period={STEPS}",
    "integration.transient_periods=150",
    f"integration.recorded_periods={RECORDED}",
    "outputs.section_points=2",
)
COORDINATES = ("delta_5", "delta_1", "delta_2", "delta_3", "delta_4")
STATES = tuple(name for c in COORDINATES for name in (c, f"{c}_rate"))


def at(*values: float) -> tuple[str, ...]:
    return (*SHORT, f'sweep={{ parameter = "pitch_error", values = {list(values)} }}')


@pytest.fixture(scope="module")
def result() -> Result:
    """Return a motion in permanent contact and a motion with impacts on both flanks."""
    return respond(load_config(FULL, at(0.2, 12.97)), PERIODS)


def test_the_record_has_every_step_of_the_last_periods(result):
    time = result["time"]
    assert time.size == PERIODS * STEPS + 1
    assert (time[0], time[1], time[-1]) == (0.0, 1.0 / STEPS, PERIODS)
    assert result.dims("delta_5") == ("pitch_error", "time")
    np.testing.assert_allclose(result["mesh_period"], 1.0 / 0.1394, rtol=1e-12)


def test_the_sections_are_those_of_all_recorded_periods_and_meet_the_record(result):
    for name in STATES:
        assert result[f"section_{name}"].shape == (2, RECORDED)
        once_a_period = result[name][:, ::STEPS]
        np.testing.assert_array_equal(once_a_period, result[f"section_{name}"][:, -PERIODS - 1 :])
    last = np.stack([result[name][:, -1] for name in STATES], axis=1)
    np.testing.assert_array_equal(last, result["end_state"])


@pytest.mark.parametrize("coordinate", COORDINATES)
def test_accelerations_are_the_derivative_of_the_velocities(result, coordinate):
    """Differences of order 4 have the error (omega h)^4 / 30 for the fastest wave (bearing)."""
    rate, acceleration = (result[f"{coordinate}_{kind}"] for kind in ("rate", "acceleration"))
    step = result["mesh_period"][:, np.newaxis] / STEPS
    differences = 8.0 * (rate[:, 3:-1] - rate[:, 1:-3]) - (rate[:, 4:] - rate[:, :-4])
    off = np.abs(differences / (12.0 * step) - acceleration[:, 2:-2])
    contact = 3 * result["contact_tangential"] + result["contact_axial"]
    windows = np.lib.stride_tricks.sliding_window_view(contact, 5, axis=1)
    steady = np.all(windows == windows[:, :, :1], axis=2)
    assert 0.7 < np.mean(steady) < 1.0
    fastest = np.sqrt(result.parameters["transverse_stiffness_p"].values) * step[0, 0]
    assert np.max(off[steady]) < 2.0 * fastest**4 / 30.0 * np.max(np.abs(acceleration))


def test_over_a_period_the_mesh_force_carries_the_load(result):
    """The mean of eq. 13, row delta_5, is cos(beta_b) N_y = f_n for a motion of period 1."""
    load = result.parameters["load"].values
    angle = np.radians(result.parameters["base_helix_angle_deg"].values)
    force = result["mesh_force_tangential"][0, :STEPS]
    assert np.mean(force) == pytest.approx(load / np.cos(angle), rel=1e-7)
    assert np.ptp(force) > 0.01


@pytest.mark.parametrize(("given", "steps"), [((), 60), (("integration.steps_per_period=12",), 12)])
def test_flow_maps_have_enough_samples_unless_their_steps_are_given(given, steps):
    config = load_config(BASINS, ("start.count=2", *given))
    assert prepared(config, 1).plan.steps_per_period == steps


def test_a_response_of_flow_maps_is_as_exact_with_few_steps_as_with_many(tmp_path):
    """A sum of a smooth force over the period has no error either."""
    found = []
    for steps in (24, 96):
        how = ("integration.method=flow_map", f"integration.steps_per_period={steps}", *SHORT[2:])
        how += ("integration.transient_periods=8000",)  # The bearings have little damping.
        sets = [word for override in how for word in ("--set", override)]
        asked = [str(PAN2021), *sets, "--pitch-error", "0.2", "--periods", str(PERIODS), "-q"]
        assert main([*asked, "-o", str(tmp_path / f"{steps}.h5")]) == 0
        result = open_result(tmp_path / f"{steps}.h5")
        section = result["section_delta_5"][:, -PERIODS - 1 :]
        np.testing.assert_array_equal(result["delta_5"][:, ::steps], section)
        force = result["mesh_force_tangential"][0, :steps].mean()
        angle = np.radians(result.parameters["base_helix_angle_deg"].values)
        carried = result.parameters["load"].values / np.cos(angle)
        assert force == pytest.approx(carried, abs=1e-13)
        found.append(result)
    few, many = found
    for name in ("delta_5", "delta_5_rate", "delta_5_acceleration", "mesh_force_tangential"):
        np.testing.assert_allclose(few[name], many[name][:, ::4], rtol=0.0, atol=1e-13)


def test_only_the_lane_that_hammers_loses_contact_and_reaches_the_back_flank(result):
    driving = result["contact_tangential"][0]
    assert set(driving.tolist()) == {1}
    assert set(result["contact_tangential"][1].tolist()) == {0, 1, 2}
    assert result.attributes("contact_axial")["flag_meanings"] == "apart driving_flank back_flank"


def test_the_response_is_the_sweep_with_its_motion(result):
    """Only the motion in time depends on the number of periods; all other arrays stay the same."""
    shorter = respond(load_config(FULL, at(0.2, 12.97)), 1)
    assert set(shorter) == set(result)
    for name in set(result) - {"time"}:
        if "time" not in result.dims(name):
            np.testing.assert_array_equal(shorter[name], result[name])
        else:
            np.testing.assert_array_equal(shorter[name], result[name][:, -STEPS - 1 :])


def test_a_carried_sweep_keeps_the_motion_of_every_lane(result):
    carried = respond(load_config(FULL, (*at(0.2, 12.97), "start.carry=upwards")), PERIODS)
    np.testing.assert_array_equal(carried["delta_5"][0], result["delta_5"][0])
    assert np.isfinite(carried["delta_5"][1]).all()


@pytest.mark.parametrize("method", ["rk4", "flow_map"])
def test_teeth_that_are_apart_carry_a_force_only_if_the_damper_always_acts(method):
    for acts in ("always", "in_contact"):
        options = (f"mesh.damping_acts={acts}", f"integration.method={method}", *at(12.97))
        found = respond(load_config(FULL, options), PERIODS)
        for way in ("tangential", "axial"):
            apart = found[f"contact_{way}"] == 0
            force = found[f"mesh_force_{way}"][apart]
            assert apart.any() and not apart.all()
            assert (np.abs(force).max() > 0.01) == (acts == "always")
            assert acts == "always" or not force.any()


def test_a_lane_that_diverged_has_no_motion():
    diverging = respond(load_config(FULL, (*at(0.2), "groups.load=1e150")), PERIODS)
    assert diverging["status"].tolist() == [1]
    assert np.isnan(diverging["delta_5"]).all()
    assert np.isnan(diverging["mesh_force_axial"]).all()
    assert (diverging["contact_tangential"] == 255).all()


def test_the_axial_motion_is_there_where_a_sweep_would_leave_it_out():
    config = load_config(FULL, (*at(0.2), "outputs.lyapunov=false", 'outputs.section=["delta_5"]'))
    assert "axial" not in config.needed_effects
    found = respond(config, 1)
    assert found.variables["state"].flags == STATES
    assert {"delta_3_acceleration", "mesh_force_axial"} <= set(found)


@pytest.mark.parametrize("periods", [0, -1, RECORDED + 1])
def test_more_periods_than_are_recorded_are_refused(periods):
    config = load_config(FULL, at(1.0))
    with pytest.raises(
        ConfigurationError, match=r"periods = .*recorded_periods = 6; request fewer"
    ):
        respond(config, periods)


def test_a_response_that_no_memory_holds_is_refused_before_it_is_computed():
    config = load_config(FULL, (*at(1.0), "integration.recorded_periods=10_000_000"))
    with pytest.raises(ConfigurationError, match=r"10000000 mesh periods.*of this machine"):
        respond(config, 10_000_000)


@pytest.fixture(scope="module")
def path(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("response") / "response.h5"
    result.save(path)
    return path


def test_what_is_read_is_what_was_saved(result, path, tmp_path):
    again = open_result(path)
    assert same_data(again, result)
    assert again.metadata["kind"] == "response"
    assert again.metadata["configuration"] == FULL.read_text()
    for name in result:
        assert again.dims(name) == result.dims(name)
        np.testing.assert_equal(again.attributes(name), result.attributes(name))
    again.save(tmp_path / "again.h5")
    assert same_data(open_result(tmp_path / "again.h5"), result)


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_xarray_reads_time_as_a_coordinate(engine: Any, path, result):
    with xr.open_dataset(path, engine=engine, mask_and_scale=False) as dataset:
        assert {"pitch_error", "time"} <= set(dataset.coords)
        for name in result:
            assert dataset[name].dims == result.dims(name)
            np.testing.assert_array_equal(dataset[name].values, result[name])
        middle = dataset["delta_5"].sel(time=1.5, pitch_error=12.97)
        assert middle.item() == result["delta_5"][1, 3 * STEPS // 2]


def test_h5dump_shows_the_contact(path):
    if shutil.which("h5dump") is None:
        pytest.skip("h5dump is not installed")
    command = ["h5dump", "-A", "-d", "/contact_axial", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert '"apart driving_flank back_flank"' in done.stdout


def command(*arguments: str) -> list[str]:
    settings = [part for override in SHORT for part in ("--set", override)]
    periods = () if "--periods" in arguments else ("--periods", str(PERIODS))
    return [str(FULL), *periods, *settings, *arguments]


@pytest.mark.slow
def test_the_command_computes_the_values_asked_for(tmp_path, result):
    asked = command("--pitch-error", "12.97", "--pitch-error", "0.2")
    ended = run_module("gearchaos.response", *asked, cwd=tmp_path)
    assert (ended.code, ended.out) == (0, "pan2021_full_response.h5\n")
    summary = "2 lanes over pitch_error, 3 periods of 192 steps, 0 diverged\n"
    assert ended.err.endswith(f"gearchaos response: {summary}")
    assert same_data(open_result(tmp_path / "pan2021_full_response.h5"), result)


def test_at_takes_values_of_the_parameter_that_is_swept(tmp_path, capsys):
    output = str(tmp_path / "load.h5")
    swept = ("--set", 'sweep={ parameter = "load", from = 0.1, to = 0.3, count = 3 }')
    fixed = ("--set", "groups.pitch_error=0.5")
    assert main(command("--at", "0.2", *swept, *fixed, "-q", "-o", output)) == 0
    assert capsys.readouterr() == (f"{output}\n", "")
    found = open_result(output)
    assert found["load"].tolist() == [0.2]
    assert main(command("--at", "0.2", *swept, *fixed, "-o", output)) == 4
    assert "--overwrite" in capsys.readouterr().err
    assert same_data(open_result(output), found)


def test_diverged_lanes_are_kept_and_reported(tmp_path, capsys):
    output = str(tmp_path / "diverged.h5")
    asked = command("--pitch-error", "1", "--set", "groups.load=1e150", "-o", output)
    assert main(asked) == 3
    out, err = capsys.readouterr()
    assert out == f"{output}\n"
    assert "1 of 1 lane diverged" in err
    assert open_result(output)["diverged_period"][0] >= 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "--at: is missing"),
        (["--at", "load=1", "--pitch-error", "1"], "not load and pitch_error"),
        (["--at", "5,86"], "'5,86' is not a finite number"),
        (["--at", "lode=1"], "did you mean `load`?"),
        (
            ["--at", "1", "--set", "start.carry=upwards"],
            f'{FULL}: start.carry = "upwards": a lane starts where the lane before it ends, which '
            "single values lack; run the sweep, then: gearchaos response RESULT.h5 --at VALUE",
        ),
        (["--pitch-error", "nan"], "'nan' is not a finite number"),
        (["--pitch-error", "1", "--periods", "7"], "integration.recorded_periods = 6"),
        (["--pitch-error", "1", "--threads", "0"], "threads = 0"),
        (["--pitch-error", "1", "--set", 'scene.effects=["backlash"]'], "an effect that is off"),
    ],
)
def test_what_cannot_be_computed_is_a_usage_error(tmp_path, arguments, message, capsys):
    output = tmp_path / "none.h5"
    assert main(command(*arguments, "-o", str(output))) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert not output.exists()


def test_a_pitch_error_in_a_sweep_over_something_else_needs_a_value_of_that(tmp_path, capsys):
    output = tmp_path / "spur.h5"
    asked = [str(FULL.with_name("spur_pair.toml")), "--pitch-error", "1", "-o", str(output)]
    assert main(asked) == 2
    assert capsys.readouterr().err.startswith(
        "gearchaos response: error: values of pitch_error replace the sweep over "
        "mesh_frequency: give one value of mesh_frequency with --set groups.mesh_frequency=VALUE, "
        "or several with --at\n"
    )
    assert not output.exists()


def test_the_configuration_is_never_replaced(tmp_path, capsys):
    config = tmp_path / "gears.toml"
    shutil.copy(FULL, config)
    asked = [str(config), "--pitch-error", "1", "--overwrite", "-o", str(config)]
    assert main(asked) == 4
    assert "is the input itself" in capsys.readouterr().err
    assert config.read_text() == FULL.read_text()
