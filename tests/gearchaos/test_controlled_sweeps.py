"""Sweeps with [control]: captured lanes, reproducible bits, and refused settings."""

import signal
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.controlling.controller import Controller
from gearchaos.dynamics.control import PeriodMaps, lqr_gain, placed_gain
from gearchaos.errors import ConfigurationError
from gearchaos.records.control import CAPTURED, NO_ORBIT, OFF

from .commands import SMALL, names_in, run_module, same_data, signalled

SWEEPS = Path(__file__).parents[2] / "sweeps"
PUBLISHED = SWEEPS / "pan2021.toml"
SHORT = {
    "integration": {
        "method": "flow_map",
        "steps_per_period": 12,
        "transient_periods": 600,
        "recorded_periods": 100,
    },
    "outputs.section_points": 100,
    "sweep": {"parameter": "pitch_error", "values": [12.4, 12.47, 12.6]},
    "control": {"limit": 0.2, "found_at": 12.47},
}
"""Three values of the pitch error in chaos, with control."""

SECTION, EXPONENT = "section_delta_5", "lyapunov_exponent"


def short(**changes):
    """Return the short sweep with changes; a key has __ in place of a dot."""
    config = gearchaos.load_config(PUBLISHED).replace(SHORT)
    return config.replace({key.replace("__", "."): value for key, value in changes.items()})


def with_starts(count: int, **changes):
    """Return the short sweep with random starts."""
    start = {"kind": "random", "count": count, "spread": 0.3}
    return short(start=start, **changes)


@cache
def switched():
    """Return a sweep with the controller switched off and on."""
    limits = {"parameter": "control.limit", "values": [0.0, 0.2]}
    return gearchaos.run(short(second_sweep=limits, control={"found_at": 12.47}))


def test_lanes_are_captured_and_their_labels_and_exponents_are_those_of_the_closed_loop():
    result = switched()
    assert result.axes == ("control_limit", "pitch_error")
    off, on = result["capture"]
    assert (off == OFF).all()
    assert (on == CAPTURED).all()
    assert (result["period"][1] == 1).all()
    assert (result["effort_largest"][0] == 0.0).all()
    assert (result["effort_largest"][1] <= 0.2).all()
    assert (result["effort_mean"][1] > 0.0).all()
    assert (result["effort_recorded"][1] < 1e-9).all()
    system = gearchaos.System(short().without_control(), pitch_error=12.47)
    controller = Controller(system, system.orbits(1, record=3000)[0])
    duration = system.equations.mesh_period[0]
    expected = np.log(np.abs(controller.closed_multipliers[0])) / duration
    assert result[EXPONENT][1, 1] == pytest.approx(expected, rel=1e-7)


def test_a_controller_that_is_off_changes_no_bit():
    free = gearchaos.run(short().without_control())
    for name in (SECTION, EXPONENT, "end_state", "motion", "crossings_per_period"):
        assert np.array_equal(switched()[name][0], free[name]), name


@pytest.mark.parametrize(
    "control",
    [
        {"gain": "placement"},
        {"gain": "delayed", "limit": 0.02},
        {"measured": ["delta_5", "delta_5_rate"], "noise": 1e-4},
    ],
)
def test_bits_do_not_depend_on_threads_blocks_or_the_size_of_the_sweep(control, monkeypatch):
    given = {"limit": 0.2, "found_at": 12.47, "seed": 3} | control
    config = with_starts(20, control=given)
    one, other = gearchaos.run(config, threads=1), gearchaos.run(config)
    assert same_data(one, other)
    assert (one["effort_largest"] > 0.0).any()
    monkeypatch.setattr("gearchaos.engine.computing.BLOCK_PERIODS", 1)
    monkeypatch.setattr("gearchaos.engine.running.block_lanes", lambda _run, _threads: 7)
    assert same_data(gearchaos.run(config), one)


def test_noise_of_each_lane_follows_from_the_seed():
    noisy = {"limit": 0.2, "found_at": 12.47, "noise": 1e-3}
    config = with_starts(4, control={**noisy, "seed": 1})
    one, again = gearchaos.run(config), gearchaos.run(config)
    assert same_data(one, again)
    other = gearchaos.run(config.replace("control.seed", 2))
    assert not np.array_equal(one[SECTION], other[SECTION])
    # With the same noise, captured lanes of one pitch error would have the same effort.
    assert len({*one["effort_recorded"].ravel().tolist()}) == one["effort_recorded"].size
    # On the orbit, the input is proportional to the noise.
    quiet = gearchaos.run(config.replace("control.noise", 1e-4))
    ratio = np.median(one["effort_recorded"]) / np.median(quiet["effort_recorded"])
    assert ratio == pytest.approx(10.0, rel=0.2)
    assert (one["capture"] == CAPTURED).all()


def test_rk4_and_flow_maps_capture_alike():
    integration = {"method": "rk4", "steps_per_period": 200}
    integration |= {"transient_periods": 600, "recorded_periods": 100}
    result = gearchaos.run(short(integration=integration))
    assert (result["capture"] == CAPTURED).all()
    np.testing.assert_allclose(result[SECTION][:, -1], switched()[SECTION][1, :, -1], rtol=1e-5)
    np.testing.assert_allclose(result[EXPONENT], switched()[EXPONENT][1], rtol=1e-4)


def test_control_begins_at_its_period():
    free = gearchaos.run(short().without_control().replace("integration.transient_periods", 0))
    late = {"limit": 0.2, "found_at": 12.47, "begins": 60}
    result = gearchaos.run(short(control=late, integration__transient_periods=0))
    assert np.array_equal(result[SECTION][:, :60], free[SECTION][:, :60])
    assert not np.array_equal(result[SECTION], free[SECTION])


def test_a_small_limit_captures_fewer_starts():
    limits = {"parameter": "control.limit", "values": [0.01, 0.2]}
    begins = {"found_at": 12.47, "begins": 300}
    config = with_starts(30, control=begins, second_sweep=limits)
    config = config.replace("sweep.values", [12.47])
    captured = (gearchaos.run(config)["capture"] == CAPTURED).mean(axis=(1, 2))
    assert captured[0] < 0.6
    assert captured[1] == 1.0


def test_lanes_without_the_orbit_run_uncontrolled_and_are_counted(tmp_path):
    """The orbit of period 3 in the window at P = 13 ends in a fold at P = 11.12."""
    control = {"limit": 0.1, "found_at": 12.95, "period": 3}
    values = {"parameter": "pitch_error", "values": [11.05, 12.95, 13.0]}
    config = short(control=control, sweep=values)
    (tmp_path / "pair.toml").write_text(config.resolved_toml())
    done = run_module("gearchaos.sweep", "pair.toml", "-o", "pair.h5", cwd=tmp_path)
    assert done.code == 0, done.err
    assert "1 lane ran without control: the orbit does not exist there" in done.err
    result = gearchaos.open_result(tmp_path / "pair.h5")
    assert result["capture"].tolist() == [NO_ORBIT, CAPTURED, CAPTURED]
    assert result["effort_largest"][0] == 0.0
    free = gearchaos.run(config.without_control())
    assert np.array_equal(result[SECTION][0], free[SECTION][0])
    assert result[EXPONENT][0] == free[EXPONENT][0]


def test_the_command_resumes_shards_and_describes_control(tmp_path):
    (tmp_path / "pair.toml").write_text(short(sweep__values=[12.4, 12.6]).resolved_toml())
    done = run_module("gearchaos.sweep", "pair.toml", "--dry-run", cwd=tmp_path)
    assert done.code == 0, done.err
    words = "load within 20 % of it, lqr, period-1 orbit found at pitch_error = 12.47 for 2 of 2"
    assert f"control:    {words} values, from mesh period 0 on" in done.err
    for shard in ("2/2", "1/2"):
        done = run_module("gearchaos.sweep", "pair.toml", "--shard", shard, cwd=tmp_path)
        assert done.code == 0, done.err
    assert run_module("gearchaos.merge", "pair.h5", cwd=tmp_path).code == 0
    assert run_module("gearchaos.sweep", "pair.toml", "-o", "one.h5", cwd=tmp_path).code == 0
    one, joined = (gearchaos.open_result(tmp_path / name) for name in ("one.h5", "pair.h5"))
    assert same_data(one, joined)
    assert one["capture"].tolist() == [CAPTURED, CAPTURED]
    done = run_module("gearchaos.plot", "one.h5", "--control", "-o", "one.png", cwd=tmp_path)
    assert done.code == 0, done.err
    done = run_module("gearchaos.stages", "one.h5", "--refine", "1e-3", cwd=tmp_path)
    assert done.code == 2
    assert "is a sweep with [control]" in done.err


def test_efforts_and_limits_of_a_pair_with_a_torque_are_in_newton_metres():
    config = gearchaos.Configuration.from_toml(SMALL).replace(
        {
            "sweep": {"parameter": "operation.torque_Nm", "values": [40.0, 60.0]},
            "integration": SHORT["integration"],
            "outputs.section_points": 10,
            "control": {"limit_Nm": 3.0, "noise": 1e-2},
        }
    )
    result = gearchaos.run(config)
    torque = result["operation_torque_Nm"]
    assert result.variables["effort_largest_Nm"].units == "N m"
    assert (result["effort_largest_Nm"] <= 3.0).all()
    assert (result["effort_largest_Nm"] > 0.0).all()
    np.testing.assert_allclose(result["effort_mean_Nm"], result["effort_mean"] * torque, rtol=1e-12)


@pytest.mark.parametrize("gain", [lambda maps: lqr_gain(maps, 1.0, 10.0), placed_gain])
def test_two_unstable_multipliers_are_stabilised_by_one_input(gain):
    rng = np.random.default_rng(4)
    jacobian = rng.normal(size=(4, 4))
    basis = np.linalg.qr(jacobian)[0]
    jacobian = basis @ np.diag([1.6, -2.1, 0.5, -0.2]) @ basis.T
    maps = PeriodMaps(np.zeros((1, 4)), jacobian[np.newaxis], rng.normal(size=(1, 4)))
    assert np.abs(np.linalg.eigvals(maps.closed(gain(maps)))).max() < 1.0


REFUSED = [
    ({"control": {"limit": 0.1, "actuator": "speed"}}, "change the length of the mesh period"),
    ({"control": {"limit": 0.1, "limit_Nm": 1.0}}, "given in two units"),
    ({"control": {}}, "control.limit: is missing"),
    ({"control": {"limit": 0.1, "measured": ["delta_3"]}}, "is no state of this scene"),
    ({"control": {"limit": 0.1, "found_at": 2.0}}, "must be between 12.4 and 12.6"),
    ({"integration.error_check": 0.1}, "error_check = 0.1: cannot be combined with"),
    ({"outputs.exponents": True, "control.gain": "delayed"}, "an estimate or a delay"),
    ({"second_sweep": {"parameter": "load", "values": [0.2, 0.3]}}, "second parameter of the mach"),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED)
def test_what_cannot_be_controlled_is_refused(changes, words):
    with pytest.raises(ConfigurationError, match=words):
        short().replace(changes)


def test_weights_go_with_a_linear_quadratic_gain():
    weights = {"parameter": "control.input_weight", "values": [1.0, 2.0]}
    with pytest.raises(ConfigurationError, match="has no meaning with"):
        short(second_sweep=weights, control__gain="placement")


def test_an_orbit_is_controlled_on_both_sides_of_a_grazing():
    """The unstable orbit of period 3 grazes a flank at P = 12.697."""
    control = {"limit": 0.3, "found_at": 12.95, "period": 3}
    values = {"parameter": "pitch_error", "values": [12.69, 12.697, 12.705, 12.95]}
    result = gearchaos.run(
        short(control=control, sweep=values, integration__transient_periods=4000)
    )
    assert (result["capture"] == CAPTURED).all()
    assert (result["period"] == 3).all()


def test_keys_of_a_missing_controller_cannot_be_swept():
    with pytest.raises(ConfigurationError, match=r"add \[control\]"):
        short().without_control().replace("sweep.parameter", "control.noise")


def test_an_orbit_that_is_not_found_and_a_torque_that_is_missing_are_named():
    with pytest.raises(
        ConfigurationError, match=r"control.number = 9: found only 1 orbit of period 1"
    ):
        gearchaos.run(short(control__number=9))
    with pytest.raises(ConfigurationError, match=r"control.limit_Nm: needs operation.torque_Nm"):
        gearchaos.run(short(control={"limit_Nm": 1.0}))


def test_fixing_the_swept_parameter_keeps_the_controller():
    fixed = short().at({"pitch_error": 12.6})
    assert fixed.control.found_at is None
    assert fixed.sweep.values == (12.6,)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_sweep_continues_with_the_same_bits(number, tmp_path):
    """The controllers of the lanes are designed again, and their noise starts again."""
    control = {"limit": 0.2, "found_at": 12.47, "noise": 1e-3, "seed": 5}
    config = with_starts(700, control=control, integration__transient_periods=300)
    (tmp_path / "pair.toml").write_text(config.resolved_toml())
    words = ("pair.toml", "--threads", "1")
    ended = signalled(tmp_path, "pair.h5.blocks", number, *words)
    assert ended.code != 0
    assert "Traceback" not in ended.err
    assert names_in(tmp_path) == ["pair.h5.blocks", "pair.toml"]
    done = run_module("gearchaos.sweep", *words, "--resume", cwd=tmp_path)
    assert done.code == 0, done.err
    assert run_module("gearchaos.sweep", *words, "-o", "one.h5", cwd=tmp_path).code == 0
    one, resumed = (gearchaos.open_result(tmp_path / name) for name in ("one.h5", "pair.h5"))
    assert same_data(one, resumed)
    assert (one["effort_largest"] > 0.0).all()
