"""Control of periodic orbits: linear design, captured starts, and the command."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from gearchaos_kernels import Plan, integrate

import gearchaos
from gearchaos.controlling.controller import Controller
from gearchaos.controlling.trial import try_controller
from gearchaos.dynamics.control import (
    PeriodMaps,
    estimate_correction,
    lqr_gain,
    placed_gain,
    require_controllable,
)
from gearchaos.dynamics.controllers import ControlSettings
from gearchaos.dynamics.riccati import riccati
from gearchaos.errors import ConfigurationError
from gearchaos.figures import control_page
from gearchaos.figures.style import GREY
from gearchaos.models import Configuration

from .commands import SMALL, run_module

SWEEPS = Path(__file__).parents[2] / "sweeps"
PUBLISHED = {0.05: (0.915, 347), 0.1: (1.0, 164), 0.2: (1.0, 144), 0.3: (1.0, 140)}
"""Share of 1000 chaotic starts that were captured with each limit in an independent computation,
and the median time until capture in mesh periods."""


TEETH = """
[pair]
teeth = [7, 20]
normal_module_mm = 2.0
normal_pressure_angle_deg = 20.0
helix_angle_deg = 15.0
face_width_mm = 15.0
profile_shift = [0.5, 0.0]
[operation]
torque_Nm = 0.6
speed_rpm = 20000.0
[mesh]
mean_stiffness_N_per_um_mm = 12.0
normal_backlash_um = 40.0
damping_ratio = 0.02
stiffness = { shape = "trapezoid" }
[pitch_error]
kind = "teeth"
smoothing = 0.5
mean_um = 2.0
driving = { cumulative_um = [0.0, 3.0, 5.5, 4.0, 7.0, 2.0, -1.0] }
[groups]
pitch_error = 4.0
[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]
[sweep]
parameter = "operation.speed_rpm"
values = [69000.0]
[integration]
steps_per_period = 400
transient_periods = 700
recorded_periods = 700
"""
"""A pair whose excitation repeats after seven mesh periods."""


@cache
def chaotic():
    """Return the pair of Pan 2021 in chaos, and its unstable orbit of period 1."""
    config = gearchaos.load_config(SWEEPS / "pan2021.toml")
    config = config.replace("integration.method", "flow_map")
    config = config.replace("integration.steps_per_period", 12)
    system = gearchaos.System(config, pitch_error=12.47)
    return system, system.orbits(1, record=3000)[0]


@cache
def controller(**settings):
    """Return a controller of this orbit."""
    return Controller(*chaotic(), ControlSettings(**settings))


def test_the_open_loop_is_the_known_one_and_the_gain_that_of_the_riccati_equation():
    found = controller()
    assert found.multipliers[0] == pytest.approx(-1.6976, abs=1e-4)
    moduli = np.abs(found.closed_multipliers)
    np.testing.assert_allclose(moduli, [0.92, 0.92, 0.31, 0.31, 0.24, 0.24], atol=0.005)
    (a,), (b,) = found.maps.jacobians, found.maps.responses
    cost = scipy.linalg.solve_discrete_are(a, b[:, np.newaxis], np.eye(6), [[10.0]])
    np.testing.assert_allclose(found.gain[0], b @ cost @ a / (10.0 + b @ cost @ b), rtol=1e-9)


def test_the_response_is_the_difference_by_the_load():
    system, orbit = chaotic()
    (response,) = controller().maps.responses
    h = 1e-6
    one = system.equations
    ends = [
        integrate(
            one.with_steady_input(one.steady_input + sign * h),
            orbit.point[np.newaxis],
            Plan(12, 0, 1, 1, tangent=True, method="flow_map"),
        ).end_state[0]
        for sign in (1.0, -1.0)
    ]
    np.testing.assert_allclose(response, (ends[0] - ends[1]) / (2.0 * h), atol=1e-6)


@pytest.mark.parametrize("method", ["lqr", "placement"])
def test_the_frame_of_the_closed_loop_has_the_designed_multipliers(method):
    found = controller(method=method)
    plan = Plan(12, 0, 1, 1, tangent=True, method="flow_map")
    system, point = found.system.equations.of(np.zeros(6, dtype=int)), found.orbit.point
    controlled = system.controlled(found.control(6))
    outcome = integrate(controlled, np.tile(point, (6, 1)), plan, tangent_start=np.eye(6))
    frame = (outcome.end_tangent * np.exp(outcome.growth)).T
    expected = np.sort_complex(found.closed_multipliers)
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(frame)), expected, atol=1e-8)


@pytest.mark.parametrize("weight", [10.0, 300.0])
def test_delayed_feedback_has_the_multipliers_with_which_deviations_grow(weight):
    found = controller(method="delayed", limit=0.5, input_weight=weight)
    motion = found.run(found.orbit.point[np.newaxis] + 1e-9, 41)
    largest = np.abs(found.closed_multipliers[0])
    assert largest > 1.0
    assert found.closed_multipliers.shape == (6,)
    # With a complex pair of multipliers, the deviation turns while it grows.
    rates = np.diff(np.log(motion.distance[0, 10:41]))
    assert np.exp(rates.mean()) == pytest.approx(largest, rel=0.02)


def test_placement_leaves_stable_multipliers_and_removes_unstable_ones():
    found = controller(method="placement")
    stable = found.multipliers[np.abs(found.multipliers) < 1.0]
    kept = found.closed_multipliers[:-1]
    np.testing.assert_allclose(np.sort_complex(kept), np.sort_complex(stable), atol=1e-8)
    assert abs(found.closed_multipliers[-1]) < 1e-8
    rng = np.random.default_rng(1)
    two_unstable = np.diag([1.4, -2.2, 0.5])[np.newaxis]
    maps = PeriodMaps(np.zeros((1, 3)), two_unstable, rng.normal(size=(1, 3)))
    moduli = np.sort(np.abs(np.linalg.eigvals(maps.closed(placed_gain(maps)))))
    np.testing.assert_allclose(moduli, [0.0, 0.0, 0.5], atol=1e-7)


def test_the_cost_of_a_small_deviation_is_that_of_the_riccati_equation():
    found = controller()
    (a,), (b,) = found.maps.jacobians, found.maps.responses
    cost = scipy.linalg.solve_discrete_are(a, b[:, np.newaxis], np.eye(6), [[10.0]])
    deviation = 1e-7 * np.array([1.0, -0.5, 0.3, 0.2, -0.1, 0.4])
    motion = found.run(found.orbit.point[np.newaxis] + deviation, 200)
    states = motion.section[0] - found.orbit.point
    paid = np.sum(states**2) + np.sum(deviation**2) + 10.0 * np.sum(motion.inputs**2)
    assert paid == pytest.approx(deviation @ cost @ deviation, rel=1e-4)


@pytest.mark.parametrize("states", [2, 10, 34])
def test_the_riccati_equation_is_solved_where_multipliers_are_large_or_tiny(states):
    random = np.random.default_rng(states)
    a, b = random.normal(size=(states, states)) / np.sqrt(states), np.eye(states)[:, :2]
    for factor in (1e-12, 0.3, 1.4):
        # Some modes decay within a period, as on a long orbit of many mesh periods.
        matrix = factor * a @ np.diag(np.logspace(0, -12, states))
        (found,) = riccati(matrix[np.newaxis], b[np.newaxis], np.eye(states), 3.0 * np.eye(2))
        gain = np.linalg.solve(3.0 * np.eye(2) + b.T @ found @ b, b.T @ found @ matrix)
        closed = matrix - b @ gain
        assert found == pytest.approx(np.eye(states) + matrix.T @ found @ closed, rel=1e-11)
        assert np.abs(np.linalg.eigvals(closed)).max() < 1.0
    unreached = np.diag([1.5, 0.5])[np.newaxis], np.array([[[0.0], [1.0]]])
    with pytest.raises(ConfigurationError, match="no gain stabilises"):
        riccati(*unreached, np.eye(2), np.eye(1))


def cyclic(blocks):
    """Return one matrix for all steps of a period: block n leads from step n to the next one."""
    periods, rows, columns = blocks.shape
    whole = np.zeros((periods, rows, periods, columns))
    for n, block in enumerate(blocks):
        whole[(n + 1) % periods, :, n] = block
    return whole.reshape(periods * rows, periods * columns)


@pytest.mark.parametrize("periods", [2, 3, 7])
def test_gains_and_estimates_of_a_period_are_those_of_all_its_steps_in_one_matrix(periods):
    random = np.random.default_rng(periods)
    a, b = random.normal(size=(periods, 4, 4)), random.normal(size=(periods, 4))
    maps = PeriodMaps(np.zeros((periods, 4)), a, b)
    gain = scipy.linalg.block_diag(*lqr_gain(maps, 2.0, 10.0)[:, np.newaxis])
    one, act, pay = cyclic(a), cyclic(b[:, :, np.newaxis]), 10.0 * np.eye(periods)
    cost = scipy.linalg.solve_discrete_are(one, act, 2.0 * np.eye(4 * periods), pay)
    wanted = np.linalg.solve(pay + act.T @ cost @ act, act.T @ cost @ one)
    np.testing.assert_allclose(gain, wanted, atol=1e-9)
    noise, disturbance = np.array([0.1, 0.3]), np.array([0.2, 0.1, 0.4, 0.3])
    found = estimate_correction(maps, [0, 2], noise, disturbance)
    see = np.kron(np.eye(periods), np.eye(4)[[0, 2]])
    spread = np.kron(np.eye(periods), np.diag(disturbance**2))
    variance = np.kron(np.eye(periods), np.diag(noise**2))
    known = scipy.linalg.solve_discrete_are(one.T, see.T, spread, variance)
    wanted = known @ see.T @ np.linalg.inv(see @ known @ see.T + variance)
    np.testing.assert_allclose(scipy.linalg.block_diag(*found), wanted, atol=1e-9)


def test_an_orbit_of_a_thousand_mesh_periods_has_gains_that_stabilise_it():
    random = np.random.default_rng(0)
    a, b = random.normal(size=(1081, 2, 2)), random.normal(size=(1081, 2))
    maps = PeriodMaps(np.zeros((1081, 2)), 1.2 * a, b)
    cost = riccati(maps.jacobians, b[:, :, np.newaxis], np.eye(2), 10.0 * np.eye(1))
    gain = lqr_gain(maps, 1.0, 10.0)
    closed = maps.jacobians - b[:, :, np.newaxis] * gain[:, np.newaxis]
    later = np.roll(cost, -1, axis=0)
    paid = np.eye(2) + 10.0 * gain[:, :, np.newaxis] * gain[:, np.newaxis]
    assert cost == pytest.approx(paid + closed.transpose(0, 2, 1) @ later @ closed, rel=1e-9)
    assert np.abs(maps.closed(gain)).max() < 1e-9


@pytest.mark.parametrize("limit", PUBLISHED)
def test_chaotic_starts_are_captured_as_often_and_as_fast_as_known(limit):
    found = controller(limit=limit)
    # In the independent computation, all states of a captured motion are within 1e-6 of the orbit.
    motion = found.run(1000, 1000)._replace(within=1e-6 / found.scales.max())
    share, median = PUBLISHED[limit]
    counts = np.array([[motion.captured.sum(), 1000 * share], [0, 0]], dtype=int)
    counts[1] = 1000 - counts[0]
    assert scipy.stats.fisher_exact(counts).pvalue > 0.003
    times = np.sort(motion.capture_time[motion.captured])
    # Both medians are random: 95 % of medians lie between the order statistics n/2 -+ sqrt(n).
    reach = int(1.5 * np.sqrt(2.0 * times.size))
    middle = times.size // 2
    assert times[middle - reach] <= median <= times[middle + reach]
    assert np.abs(motion.inputs).max() <= limit * controller().load
    assert np.abs(motion.inputs[motion.captured, -1]).max() < 1e-5 * controller().load


def test_a_motion_that_noise_puts_near_the_orbit_by_chance_is_not_captured():
    # With this limit the controller has no effect. The reach of 30 standard deviations of the
    # noise covers the whole chaotic motion.
    motion = controller(noise=0.05, limit=1e-4).run(60, 400)
    near = motion.distance <= motion.within
    assert near[:, -1].any() and not motion.captured.any()
    assert (motion.capture_time == -1).all()
    # One of the last sixteen periods away from the orbit, or without input, prevents a capture.
    on = motion._replace(distance=np.zeros((3, 40)), inputs=np.ones((3, 40)))
    on.distance[0, -16], on.inputs[1, -16], on.distance[2, -17] = 1.0 + on.within, 0.0, 2.0
    assert on.captured.tolist() == [False, False, True]
    assert on._replace(noisy=False).captured.tolist() == [False, True, True]


@pytest.mark.parametrize("periods", [210, 213])
def test_measures_after_a_trial_are_those_of_the_orbit_at_any_phase_of_the_excitation(periods):
    system = gearchaos.System(Configuration.from_toml(TEETH), operation_speed_rpm=69_000.0)
    orbit = system.orbit()
    assert system.repeats_after == 7 and abs(orbit.multipliers[0]) > 2.0
    settings = ControlSettings(limit=0.3, measured=("delta_5", "delta_5_rate"))
    trial = try_controller(Controller(system, orbit, settings), 4, periods)
    assert trial.motion.captured.all()
    plan = system.plan._replace(transient_periods=0, recorded_periods=7, section_points=0)
    alone = integrate(system.equations, orbit.point[np.newaxis], plan._replace(loads=True))
    wanted = alone.loads[0, 0, 0] / system.equations.static_force()[0]
    assert trial.after["load_factor_largest"] == pytest.approx(wanted, rel=1e-5)
    assert trial.before["load_factor_largest"] < 0.97 * wanted
    assert trial.units["load_factor_largest"] == "1"
    assert trial.units["transmission_error_peak_to_peak"] == "um"
    # The static force is that of the torque on the base radius of the driving gear.
    helix, pressure = np.radians(15.0), np.radians(20.0)
    transverse = np.arctan(np.tan(pressure) / np.cos(helix))
    radius_m = 1e-3 * 7 * 2.0 / np.cos(helix) / 2.0 * np.cos(transverse)
    along = np.cos(np.arcsin(np.sin(helix) * np.cos(pressure)))
    assert trial.units["mesh_force_largest_tangential"] == "N"
    static = trial.after["mesh_force_largest_tangential"] / trial.after["load_factor_largest"]
    assert static == pytest.approx(0.6 / radius_m / along, rel=1e-6)


def test_noise_spreads_the_state_as_the_lyapunov_equation_says():
    found = controller(noise=1e-7)
    lanes = 2000
    starts = np.tile(found.orbit.point, (lanes, 1))
    motion = found.run(starts, 150)
    (a,), (b,) = found.maps.jacobians, found.maps.responses
    measured = np.diag((1e-7 * found.scales) ** 2)
    acting = np.outer(b, found.gain[0])
    spread = scipy.linalg.solve_discrete_lyapunov(a - acting, acting @ measured @ acting.T)
    found_spread = np.var(motion.section[:, -1] - found.orbit.point, axis=0)
    error = 3.0 * np.sqrt(2.0 / lanes)
    np.testing.assert_allclose(found_spread, np.diag(spread), rtol=error)
    again = found.run(starts, 150)
    assert np.array_equal(again.section, motion.section)
    other = controller(noise=1e-7, seed=1).run(starts, 150)
    assert not np.array_equal(other.section, motion.section)


def test_two_measured_states_are_enough_near_the_orbit():
    found = controller(measured=("delta_5", "delta_5_rate"), noise=1e-8)
    near = found.orbit.point + 1e-6 * np.random.default_rng(2).normal(size=(20, 6))
    motion = found.run(near, 400)
    assert motion.distance[:, -1].max() < 1e-5
    free = integrate(
        found.system.equations.of(np.zeros(20, dtype=int)),
        near,
        Plan(12, 0, 400, 400, tangent=True, method="flow_map"),
    )
    assert np.abs(free.section[:, -1] - found.orbit.point).max() > 0.1


def test_the_closed_loop_exponent_is_that_of_the_largest_closed_multiplier():
    found = controller()
    plan = Plan(12, 300, 200, 1, tangent=True, method="flow_map")
    outcome = found.integrate(np.tile(found.orbit.point, (2, 1)), plan)
    largest = np.log(np.abs(found.closed_multipliers[0]))
    assert outcome.growth.mean() == pytest.approx(largest, abs=5e-3)


def test_modes_without_input_are_named():
    maps = PeriodMaps(np.zeros((1, 2)), np.diag([1.5, 0.5])[np.newaxis], np.array([[0.0, 1.0]]))
    with pytest.raises(ConfigurationError, match=r"does not act .* multipliers 1\.5"):
        require_controllable(maps, "pair.toml")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"limit": 0.0}, "limit: is 0, and must be positive"),
        ({"noise": -1.0}, "noise: is -1"),
        ({"method": "pid"}, "must be one of 'lqr', 'placement', 'delayed'"),
        ({"measured": ("delta_9",)}, "measured = 'delta_9'"),
    ],
)
def test_settings_out_of_their_range_are_refused(settings, words):
    with pytest.raises(ConfigurationError, match=words):
        Controller(*chaotic(), ControlSettings(**settings))


def test_the_command_prints_a_table_and_json_and_draws(tmp_path):
    text = (SWEEPS / "pan2021.toml").read_text()
    (tmp_path / "pair.toml").write_text(text.replace("rk4", "flow_map"))
    options = ("pair.toml", "--at", "12.47", "--starts", "30", "--periods", "600")
    done = run_module("gearchaos.control", *options, "-o", "pair.png", cwd=tmp_path)
    assert done.code == 0, done.err
    assert "captured: 30 of 30 starts, 100.0 % (88.6 % to 100.0 %)" in done.out
    assert (tmp_path / "pair.png").stat().st_size > 10_000
    printed = done.out
    done = run_module("gearchaos.control", *options, "--json", cwd=tmp_path)
    facts = json.loads(done.out)
    assert facts["multipliers"][0][0] == pytest.approx(-1.6976, abs=1e-4)
    before, after = (facts[when]["load_factor_largest"] for when in ("before", "after"))
    assert after < before
    line = f"  largest mesh force over the static one   {before:<8.4g} {after:.4g}"
    heading = "means over the starts, lengths and forces in the units of the equations:"
    assert {line, heading} <= {*printed.splitlines()}
    assert "  share of the time apart, tangential " in printed


def test_a_long_target_is_drawn_from_each_of_its_excitation_periods():
    drawing = try_controller(controller(), 2, 40).drawing()
    target = np.random.default_rng(0).normal(size=(21, 6))
    page = control_page(drawing._replace(target=target, repeats=7))
    lines = [one for one in page.axes[0].lines if one.get_color() == GREY]
    assert [one.get_label() for one in lines].count("target orbit") == 1
    for begin, line in zip((0, 7, 14), lines, strict=True):
        time, places = line.get_data()
        assert np.array_equal(places, target[(time + begin) % 21, 0])
    page = control_page(drawing._replace(target=target, repeats=1))
    lines = [one for one in page.axes[0].lines if one.get_color() == GREY]
    assert [one.get_ydata()[0] for one in lines] == target[:, 0].tolist()


def test_the_command_names_an_orbit_that_is_not_there(tmp_path):
    done = run_module(
        "gearchaos.control", str(SWEEPS / "pan2021.toml"), "--at", "5", "--orbit", "7", cwd=tmp_path
    )
    assert done.code == 2
    assert "--orbit 7 is not among them" in done.err
    assert "Traceback" not in done.err


def test_the_command_asks_for_a_value_and_takes_the_name_of_an_axis(tmp_path):
    configuration = str(SWEEPS / "pan2021.toml")
    done = run_module("gearchaos.control", configuration, cwd=tmp_path)
    assert done.code == 2
    assert "pitch_error is swept from 0 to 15" in done.err
    assert "give --at VALUE" in done.err
    text = SMALL.replace('parameter = "pitch_error"', 'parameter = "operation.torque_Nm"')
    (tmp_path / "torque.toml").write_text(
        text.replace("from = 0.0\nto = 5.0", "from = 5.0\nto = 9.0")
    )
    options = ("torque.toml", "--at", "operation_torque_Nm=50", "--starts", "5", "--periods", "20")
    done = run_module("gearchaos.control", *options, cwd=tmp_path)
    assert done.code == 0, done.err
    assert "operation.torque_Nm = 50 lies outside the sweep, 5 to " in done.err
    assert "this orbit is stable" in done.err
