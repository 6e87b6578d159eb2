"""One system at one point: analyses of its dynamics against exact solutions and stored orbits."""

from pathlib import Path

import gearchaos_kernels as kernels
import numpy as np
import pytest

import gearchaos
from gearchaos.dynamics.orbits import exponents_of
from gearchaos.dynamics.stability_loss import StabilityLoss
from gearchaos.models.gear_pair.scene import STATES

from ..kernels.reference import SOLUTIONS
from .short_sweeps import METHODS

PAN2021 = Path(__file__).resolve().parents[2] / "sweeps" / "pan2021_first.toml"
ORBITS = [orbit for orbit in SOLUTIONS["periodic_orbits"] if orbit["scene"] == "no_axial"]
LINEAR = (
    "groups.half_backlash=0.0",
    "groups.stiffness_variation_scale=0.0",
    "outputs.section_points=1",
)


@pytest.fixture(scope="module", params=METHODS)
def doubled(request) -> gearchaos.System:
    config = gearchaos.load_config(PAN2021, [f"integration.method={request.param}"])
    return gearchaos.System(config, pitch_error=10.75)


@pytest.fixture(scope="module")
def linear() -> gearchaos.System:
    return gearchaos.System(gearchaos.load_config(PAN2021, LINEAR), pitch_error=2.0)


def test_the_states_have_one_order_in_configuration_and_kernels():
    assert kernels.STATES == STATES


# docs/numerics.md has 2.6e-5 and 4e-8 at 400 steps for the same orbits with order 4.
@pytest.mark.parametrize(
    ("overrides", "multipliers", "exponent"),
    [
        ((), 2**4.1 * 2.6e-5, 2**4.1 * 4e-8),
        (("integration={method='flow_map'}",), 1e-9, 1e-9),
    ],
    ids=METHODS,
)
@pytest.mark.parametrize("stored", ORBITS, ids=lambda orbit: f"{orbit['pitch_error']}")
def test_orbits_and_multipliers_are_the_stored_ones(stored, overrides, multipliers, exponent):
    config = gearchaos.load_config(PAN2021, overrides)
    # The stored solutions use rounded values of these groups.
    derived = {name: SOLUTIONS["groups"][name] for name in ("mass_ratio_p", "mass_ratio_g")}
    derived["base_helix_angle_deg"] = SOLUTIONS["beta_b_deg"]
    system = gearchaos.System(config, pitch_error=stored["pitch_error"], **derived)
    orbit = system.orbit(stored["period"], guess=stored["section_points"][0])
    wanted = np.array([complex(*pair) for pair in stored["floquet_multipliers"]])
    apart = np.abs(orbit.multipliers[:, np.newaxis] - wanted).min(axis=0).max()
    assert apart < multipliers
    assert orbit.exponent == pytest.approx(stored["largest_exponent"], abs=exponent)
    assert orbit.stable
    assert orbit.residual < 1e-12


def test_a_motion_settles_on_the_orbit_that_is_asked_for(doubled):
    orbit = doubled.orbit(period=2)
    motion = doubled.integrate(2, start=orbit.point)
    assert motion.time[[0, -1]].tolist() == [0.0, 2.0]
    assert np.abs(motion.states[-1] - orbit.point).max() < 1e-10
    with pytest.raises(gearchaos.ConfigurationError, match="no orbit of period 3 "):
        doubled.orbit(period=3)


def test_the_orbit_of_another_value_is_a_guess():
    other, system = (gearchaos.System(PAN2021, pitch_error=one) for one in (5.0, 6.0))
    found, settled = system.orbit(guess=other.orbit().point), system.orbit()
    assert np.abs(found.point - other.orbit().point).max() > 0.01
    assert found.point == pytest.approx(settled.point, abs=1e-9)


def test_an_orbit_is_followed_to_where_its_period_doubles(doubled):
    branch = doubled.follow(doubled.orbit(period=2), "pitch_error", 10.75, 11.6)
    assert branch.loss is StabilityLoss.PERIOD_DOUBLING
    # docs/numerics.md has 11.4255 with 200 steps.
    assert branch.value == pytest.approx(11.4255, abs=2e-4)
    assert branch.value < branch.beyond < branch.value + 2e-4
    assert branch.multiplier.real < -0.99
    assert branch.orbit.stable


def test_an_orbit_is_followed_along_a_physical_key_as_along_its_group():
    config = gearchaos.load_config(PAN2021)
    tables = config.tables()
    tables["operation"] = {"torque_Nm": 40.0}
    tables["mesh"]["length_scale_um"] = 50.0
    del tables["groups"]["load"]
    system = gearchaos.System(gearchaos.Configuration.from_tables(tables), pitch_error=1.0)
    orbit = system.orbit()
    by_key = system.follow(orbit, "operation.torque_Nm", 40.0, 44.0)
    load = system.groups["load"]
    by_group = system.follow(orbit, "load", load, 1.1 * load)
    assert by_key.loss == by_group.loss
    assert by_key.orbit.point == pytest.approx(by_group.orbit.point, rel=1e-9)


def test_the_exponent_of_a_followed_orbit_is_that_of_the_period_at_its_value():
    begin, end = (gearchaos.System(PAN2021, pitch_error=5.0, mesh_frequency=f) for f in (0.9, 1.1))
    branch = begin.follow(begin.orbit(), "mesh_frequency", 0.9, 1.1)
    assert branch.value == branch.beyond == 1.1
    assert branch.loss is StabilityLoss.STAYS_STABLE
    assert branch.text == "the orbit stays stable up to the last value"
    there = end.orbit(guess=branch.orbit.point)
    assert branch.orbit.exponent == pytest.approx(there.exponent, rel=1e-9)
    assert there.exponent == pytest.approx(np.log(abs(there.multipliers[0])) * 1.1 / (2.0 * np.pi))


def test_an_orbit_whose_multipliers_vanish_has_the_exponent_of_a_tangent_vector(doubled):
    orbit, turns = doubled.orbit(period=2), 200
    lanes = doubled.equations.of(np.zeros(2, dtype=int))
    points = np.tile(orbit.point, (2, 1))
    multipliers = np.array([orbit.multipliers**turns, 0.0 * orbit.multipliers])
    found = exponents_of(lanes, doubled.plan, points, multipliers, 2 * turns)
    assert found[0] == pytest.approx(orbit.exponent, rel=1e-9)
    assert found[1] == pytest.approx(orbit.exponent, rel=0.02)


def test_exponents_of_a_linear_system_add_up_to_what_its_damping_says(linear):
    found = linear.exponents()
    assert found.values.sum() == pytest.approx(linear.sum_of_exponents(), abs=1e-4)
    assert np.all(np.diff(found.values) <= 0.0)
    assert linear.orbit().exponent == pytest.approx(found.values[0], abs=1e-5)


def test_along_flow_maps_orbits_exponents_and_their_end_are_those_of_finer_ones_to_rounding():
    lengths = ("integration.transient_periods=0", "integration.recorded_periods=20", *LINEAR[2:])
    (guess,) = (o["section_points"][0] for o in ORBITS if o["pitch_error"] == 10.75)
    found = []
    for steps in (24, 60):
        how = (f"integration={{method='flow_map', steps_per_period={steps}}}", *lengths)
        system = gearchaos.System(gearchaos.load_config(PAN2021, how), pitch_error=10.75)
        orbit = system.orbit(period=2, guess=guess)
        exponents = system.exponents(start=orbit.point).values
        # Crossings do not change volumes, and each step is exact.
        assert exponents.sum() == pytest.approx(system.sum_of_exponents(), abs=1e-12)
        assert orbit.exponent == pytest.approx(
            np.log(np.abs(orbit.multipliers).max()) / (2.0 * system.mesh_period), abs=1e-12
        )
        branch = system.follow(orbit, "pitch_error", 10.75, 11.6)
        found.append([*orbit.point, orbit.exponent, *exponents, branch.value, branch.beyond])
    assert found[0] == pytest.approx(found[1], rel=0.0, abs=1e-12)


def test_a_linear_system_answers_a_sine_with_a_sine(linear):
    lines = linear.spectrum("delta_5", periods=8)
    highest = np.argsort(lines.amplitude)[-2:]
    assert sorted(lines.order[highest]) == [0.0, 1.0]
    others = np.delete(lines.amplitude, highest)
    assert others.max() < 1e-6 * lines.amplitude[highest].min()


def test_the_mean_mesh_force_of_an_orbit_carries_the_load(doubled):
    orbit = doubled.orbit(period=2)
    found = doubled.mesh_motion(doubled.integrate(2, start=orbit.point))
    force = np.cos(doubled.groups["base_helix_angle"]) * found.force_tangential[:-1]
    # Sums over a period converge with the square of the step for a function with kinks.
    assert force.mean() == pytest.approx(doubled.groups["load"], rel=1e-3)
    assert set(found.contact_tangential.tolist()) == {0, 1}
    assert found.accelerations.shape == (401, 3)


def test_the_stability_limit_is_that_of_the_stiffest_bearing_and_flow_maps_have_none(doubled):
    rk4 = doubled.config.integration.method == "rk4"
    assert doubled.stability_limit() == (16 if rk4 else 1)


def test_a_response_goes_on_from_the_state_of_the_system(doubled):
    orbit = doubled.orbit(period=2)
    doubled.state = orbit.point
    response = doubled.response(periods=2)
    assert response["start_state"][0] == pytest.approx(orbit.point)
    assert np.abs(response["end_state"][0] - orbit.point).max() < 1e-6


@pytest.mark.parametrize("overrides", [(), ("start.kind=random", "start.count=2")])
def test_the_system_of_a_lane_starts_where_the_lane_ended(overrides):
    short = ("integration.transient_periods=20", "sweep.count=5", *overrides)
    result = gearchaos.run(gearchaos.load_config(PAN2021, short))
    last = dict.fromkeys(result.axes[1:], 1)
    system = gearchaos.System.of_lane(result, pitch_error=7.4, **last)
    lane = result.sel(pitch_error=7.5, **last)
    assert np.array_equal(system.state, lane["end_state"])
    amplitude = result.parameters["pitch_error_amplitude"].values
    assert system.groups["error_amplitude"] == 7.5 * amplitude
    with pytest.raises(gearchaos.ConfigurationError, match="give a value of pitch_error"):
        gearchaos.System.of_lane(result)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "pitch_error: is swept, and a system has one value of it"),
        ({"pitch_eror": 1.0}, "pitch_eror.*did you mean `pitch_error`"),
        ({"pitch_error": 1.0, "half_backlash": -1.0}, "half_backlash"),
        ({"pitch_error": float("nan")}, "finite"),
        ({"pitch_error": 1.0, "transverse_stiffness_p": 1e6}, "RK4 is unstable below"),
    ],
)
def test_a_system_that_cannot_be_is_refused_in_words(values, message):
    with pytest.raises(gearchaos.ConfigurationError, match=message):
        gearchaos.System(PAN2021, **values)


def test_a_motion_that_leaves_the_numbers_is_reported():
    system = gearchaos.System(PAN2021, pitch_error=1.0, load=1e150)
    with pytest.raises(gearchaos.ConfigurationError, match="left the range of numbers"):
        system.integrate(5)
    how = ["integration.method=flow_map", "integration.steps_per_period=2100"]
    system = gearchaos.System(
        gearchaos.load_config(PAN2021, how), pitch_error=1.0, mesh_frequency=1e-4
    )
    with pytest.raises(gearchaos.ConfigurationError, match="moves faster than so few flow maps"):
        system.integrate(5)
