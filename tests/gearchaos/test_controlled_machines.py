"""Control of two masses with a stop by a force and of trains by a torque, with every method."""

import json
from functools import cache

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate

import gearchaos
from gearchaos.controlling.controller import Controller
from gearchaos.dynamics.controllers import ControlSettings
from gearchaos.errors import ConfigurationError
from gearchaos.records.control import CAPTURED, NO_ORBIT

from .commands import run_module
from .short_sweeps import MASSES

PLANETARY = MASSES.with_name("planetary.toml")
STEPS = {"flow_map": 16, "rk4": 400, "taylor": 4}
METHODS = tuple(STEPS)
DOUBLED = {"x1": 0.388, "x1_rate": 0.606, "x2": 0.4207, "x2_rate": 1.0617}
"""A state near the stable orbit of period 2 at the frequency 0.74."""

TRAIN = """
title = "one stage"
[model]
kind = "train"
[operation]
speed_rpm = 3000.0
[shaft]
input = { inertia_kg_m2 = 0.002, uniform = true }
output = { inertia_kg_m2 = 0.004, torque_Nm = -60.0 }
[gear]
pinion = { shaft = "input", teeth = 25, base_radius_mm = 35.2 }
wheel = { shaft = "output", teeth = 40, base_radius_mm = 56.4 }
[mesh.teeth]
gears = ["pinion", "wheel"]
stiffness_N_per_um = 300.0
contact_ratio = 1.6
harmonics = 1
half_backlash_um = 30.0
transmission_error_um = 3.0
[start]
kind = "contact"
[sweep]
parameter = "operation.speed_rpm"
values = [3000.0, 3100.0]
[integration]
method = "rk4"
steps_per_period = 200
transient_periods = 300
recorded_periods = 40
[control]
limit_Nm = 6.0
noise = 1e-3
[outputs]
section = ["output_angle"]
section_points = 20
# With a tangent vector, as in the other loops of this train.
lyapunov = true
motion = false
"""


def masses(method, **changes):
    """Return the two masses with a method and changes; a key has __ in place of a dot."""
    config = gearchaos.load_config(MASSES).replace("start", {"kind": "rest"})
    config = config.replace("integration", {"method": method, "steps_per_period": STEPS[method]})
    return config.replace({key.replace("__", "."): value for key, value in changes.items()})


@cache
def beyond_doubling(method):
    """Return the masses at the frequency 0.74, and their unstable orbit of period 1."""
    system = gearchaos.System(
        masses(method, start={"kind": "given", "state": DOUBLED}), frequency=0.74
    )
    return system, system.orbits(1)[0]


@cache
def beyond_neimark_sacker(method):
    """Return the masses at the frequency 0.616, and their orbit with two unstable multipliers."""
    config, guess = masses(method), None
    for frequency in np.linspace(0.64, 0.616, 13):
        system = gearchaos.System(config, frequency=float(frequency))
        orbit = system.orbit(guess=guess)
        guess = orbit.point
    return system, orbit


def closed_frame(found):
    """Return the tangent frame of the closed loop after one period of the orbit."""
    states = len(found.orbit.point)
    plan = found.system.plan._replace(transient_periods=0, recorded_periods=1, tangent=True)
    control = found.control(states)
    system = found.equations.of(np.zeros(states, dtype=int))
    outcome = integrate(
        system.controlled(control),
        np.tile(found.orbit.point, (states, 1)),
        plan,
        tangent_start=np.eye(states),
    )
    return (outcome.end_tangent * np.exp(outcome.growth)).T


CASES = [(case, method) for case in (beyond_doubling, beyond_neimark_sacker) for method in METHODS]


@pytest.mark.parametrize(("case", "method"), CASES)
def test_the_frame_of_the_closed_loop_has_the_designed_multipliers(case, method):
    unstable = 1 if case is beyond_doubling else 2
    for gain in ("lqr", "placement"):
        found = Controller(*case(method), ControlSettings(gain, limit_absolute=0.05))
        assert np.sum(np.abs(found.multipliers) > 1.0) == unstable
        assert np.abs(found.closed_multipliers[0]) < 1.0
        # A double multiplier 0 is defective: rounding of 1e-16 moves both by 1e-8.
        expected, close = found.maps.closed(found.gain), 1e-8
        np.testing.assert_allclose(closed_frame(found), expected, atol=close)
        moved = np.sort_complex(np.linalg.eigvals(closed_frame(found)))
        close = 1e-8 if gain == "lqr" else 1e-5
        np.testing.assert_allclose(moved, np.sort_complex(found.closed_multipliers), atol=close)


@pytest.mark.parametrize("method", METHODS)
def test_the_response_is_the_difference_by_the_force(method):
    system, orbit = beyond_doubling(method)
    (response,) = Controller(system, orbit, ControlSettings(limit_absolute=0.05)).maps.responses
    h, one = 1e-6, system.actuated("drive")
    once = Plan(STEPS[method], 0, 1, 1, tangent=True, method=method)
    ends = [
        integrate(one.with_steady_input(np.full(1, sign * h)), orbit.point[np.newaxis], once)
        for sign in (1.0, -1.0)
    ]
    difference = (ends[0].end_state[0] - ends[1].end_state[0]) / (2.0 * h)
    np.testing.assert_allclose(response, difference, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_doubled_motion_returns_to_the_orbit_of_period_1(method):
    system, orbit = beyond_doubling(method)
    found = Controller(system, orbit, ControlSettings(limit_absolute=0.05))
    assert found.load == 0.0
    assert found.unit == (1.0, "force")
    begin = found.starts(4)
    # The motion repeats after two excitation periods, and not after one.
    after = system.equations.of(np.zeros(4, dtype=int))
    section = integrate(after, begin, Plan(STEPS[method], 0, 2, 2, True, method=method)).section
    np.testing.assert_allclose(section[:, 1], begin, atol=1e-6)
    assert np.abs(section[:, 0] - begin).max() > 0.01
    motion = found.run(begin, 600)
    assert motion.captured.all()
    assert 0.0 < np.abs(motion.inputs).max() <= 0.05
    assert np.abs(motion.inputs[:, -1]).max() < 1e-9


@pytest.mark.parametrize("method", METHODS)
def test_the_motion_beyond_neimark_sacker_returns_to_an_orbit_with_two_unstable_multipliers(method):
    system, orbit = beyond_neimark_sacker(method)
    near = orbit.point + 1e-3 * np.random.default_rng(0).normal(size=(4, 4))
    settle = Plan(STEPS[method], 2000, 50, 50, tangent=True, method=method)
    free = integrate(system.equations.of(np.zeros(4, dtype=int)), near, settle)
    assert np.abs(free.section - orbit.point).max() > 0.01
    for gain in ("lqr", "placement"):
        found = Controller(system, orbit, ControlSettings(gain, limit_absolute=0.3))
        motion = found.run(free.end_state, 1000)
        assert motion.captured.all()
        assert np.abs(motion.inputs[:, -1]).max() < 1e-9


def test_a_sweep_of_machines_is_controlled_and_drawn(tmp_path):
    """The orbit that is found at 0.74 ends in a fold at 0.7556."""
    config = masses(
        "flow_map",
        start={"kind": "given", "state": DOUBLED},
        integration__transient_periods=1500,
        sweep={"parameter": "frequency", "values": [0.74, 0.743, 0.78]},
        second_sweep={"parameter": "control.limit_force", "values": [0.0, 0.05]},
        control={"found_at": 0.74},
        outputs__section_points=20,
    )
    (tmp_path / "masses.toml").write_text(config.resolved_toml())
    done = run_module("gearchaos.sweep", "masses.toml", cwd=tmp_path)
    assert done.code == 0, done.err
    assert "1 lane ran without control: the orbit does not exist there" in done.err
    result = gearchaos.open_result(tmp_path / "masses.h5")
    assert result["capture"][1].tolist() == [CAPTURED, CAPTURED, NO_ORBIT]
    assert result["period"][0, :2].tolist() == [2, 2]
    assert result["period"][1, :2].tolist() == [1, 1]
    effort = result["effort_largest_force"]
    assert (effort[0] == 0.0).all()
    assert (effort[1, :2] > 0.0).all()
    assert (effort <= 0.05).all()
    # The force has no steady part, so the input cannot be given as a share of it.
    assert np.isnan(result["effort_largest"]).all()
    done = run_module("gearchaos.plot", "masses.h5", "--control", "-o", "masses.png", cwd=tmp_path)
    assert done.code == 0, done.err
    assert (tmp_path / "masses.png").stat().st_size > 10_000


def test_the_command_controls_a_machine(tmp_path):
    config = masses("flow_map", start={"kind": "given", "state": DOUBLED})
    (tmp_path / "masses.toml").write_text(config.resolved_toml())
    options = ("masses.toml", "--at", "0.74", "--starts", "8", "--periods", "600")
    done = run_module("gearchaos.control", *options, cwd=tmp_path)
    assert done.code == 2
    assert "limit: is a share of drive, whose steady value is 0; give limit_absolute" in done.err
    options = (*options, "--limit-absolute", "0.05")
    done = run_module("gearchaos.control", *options, "-o", "masses.png", cwd=tmp_path)
    assert done.code == 0, done.err
    assert "captured: 8 of 8 starts" in done.out
    assert "largest change of drive 0.0" in done.out
    done = run_module("gearchaos.control", *options, "--json", cwd=tmp_path)
    facts = json.loads(done.out)
    assert facts["largest_effort"] is None
    assert 0.0 < facts["largest_effort_force"] <= 0.05


def test_the_torque_of_a_shaft_is_changed_in_newton_metres():
    config = gearchaos.Configuration.from_toml(TRAIN)
    result = gearchaos.run(config)
    assert (result["capture"] == CAPTURED).all()
    assert result.variables["effort_largest_Nm"].units == "N m"
    assert (result["effort_mean_Nm"] > 0.0).all()
    np.testing.assert_allclose(result["effort_mean_Nm"], 60.0 * result["effort_mean"], rtol=1e-12)
    share = gearchaos.run(config.replace("control", {"limit": 0.1, "noise": 1e-3}))
    assert np.array_equal(share["effort_mean_Nm"], result["effort_mean_Nm"])
    system = gearchaos.System(config, {"operation.speed_rpm": 3000.0})
    assert system.actuated("output").steady_input == [-60.0]
    # An input of 1 is a torque of 1 N m.
    other = config.replace({"shaft.output.torque_Nm": -59.0}).without_control()
    other = gearchaos.System(other, {"operation.speed_rpm": 3000.0}).equations
    changed = system.actuated("output").with_steady_input(np.full(1, -59.0))
    np.testing.assert_allclose(changed.force, other.force, rtol=1e-14)


def train(speed):
    """Return a controller of the orbit of the stage at a speed."""
    config = gearchaos.Configuration.from_toml(TRAIN).without_control()
    system = gearchaos.System(config, {"operation.speed_rpm": speed})
    return Controller(system, system.orbit(), ControlSettings(limit_absolute=6.0))


@cache
def planetary():
    """Return a controller of the planetary set by the torque on its carrier."""
    config = gearchaos.load_config(PLANETARY).replace("integration.method", "flow_map")
    system = gearchaos.System(config, {"operation.speed_rpm": 2000.0})
    return Controller(system, system.orbit(), ControlSettings(limit=0.1))


@pytest.mark.slow
def test_an_orbit_of_many_states_closes_to_rounding():
    """Displacements of 50 cause rounding errors of 1e-12 in the smallest rates."""
    orbit = planetary().orbit
    assert orbit.point.size == 34
    assert orbit.stable
    assert np.abs(orbit.point).max() > 50.0


@pytest.mark.slow
@pytest.mark.parametrize("controller", [planetary, lambda: train(3000.0)])
def test_the_frame_of_a_controlled_train_has_the_designed_multipliers(controller):
    found = controller()
    frame = closed_frame(found)
    np.testing.assert_allclose(frame, found.maps.closed(found.gain), atol=1e-8)
    moved = np.sort(np.abs(np.linalg.eigvals(frame)))
    np.testing.assert_allclose(moved, np.sort(np.abs(found.closed_multipliers)), atol=1e-8)
    # The orbit is stable without control; with control, the motion returns faster.
    assert np.abs(found.closed_multipliers[0]) < np.abs(found.multipliers[0]) < 1.0


@pytest.mark.slow
def test_a_sweep_of_a_planetary_set_is_controlled():
    config = gearchaos.load_config(PLANETARY).replace(
        {
            "sweep": {"parameter": "operation.speed_rpm", "values": [2000.0, 2010.0]},
            "integration": {"method": "flow_map", "transient_periods": 300, "recorded_periods": 20},
            "control": {"limit": 0.1},
            "outputs": {"section": ["carrier_u"], "section_points": 10},
        }
    )
    result = gearchaos.run(config)
    assert (result["capture"] == CAPTURED).all()
    assert (result["effort_largest"] > 0.0).all()
    assert (result["effort_largest"] <= 0.1).all()
    np.testing.assert_allclose(
        result["effort_largest_Nm"], result["effort_largest"] * np.abs(load_of(config)), rtol=1e-9
    )


def load_of(config):
    """Return the torque on the carrier at the first speed, in N m."""
    system = gearchaos.System(config.without_control(), {"operation.speed_rpm": 2000.0})
    return system.actuated("carrier").steady_input[0]


REFUSED = [
    ({"control.limit": 0.1}, "is a share of the steady input, which is 0; give limit_force"),
    ({"control.limit_Nm": 0.1}, "is in a unit that the input does not have"),
    ({"control": {"limit_force": 0.1, "actuator": "stop"}}, 'a controller can change "drive" only'),
    ({"control.limit_force": 0.1, "force.other": {"on": {"x1": 1.0}}}, "has several inputs"),
    ({"control.limit_force": 0.1, "force": {}}, "no input that a controller could change"),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED)
def test_an_input_that_a_machine_does_not_have_is_refused(changes, words):
    with pytest.raises(ConfigurationError, match=words):
        gearchaos.load_config(MASSES).replace(changes)


def test_a_system_without_a_controller_is_that_without_an_actuator():
    system = gearchaos.System(masses("flow_map"), frequency=0.7)
    assert system.actuated("drive").flags() == system.equations.flags()
