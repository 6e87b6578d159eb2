"""Resolved steps keep the order of the method where a clearance is crossed.

`test_oracle` checks states and numbers of crossings of the stored runs and orbits.
"""

import numpy as np
import pytest
from gearchaos_kernels import Effects, Plan, integrate

from .reference import (
    BASE_HELIX_ANGLE,
    CLEARANCE,
    FULL,
    NO_BACKLASH,
    PERIOD,
    SOLUTIONS,
    TORSION,
    TORSION_ONLY,
    assert_same_bits,
    pan2021,
    run,
    state,
    stored_state,
    system_of,
)
from .test_oracle import name_of
from .test_order import measured_order
from .test_twin import IN_PHASE, START, named

STEPS = np.array([100, 141, 200, 283, 400, 566, 800])
ORBITS = [orbit for orbit in SOLUTIONS["periodic_orbits"] if orbit["crossings"] > 0]


def multipliers(orbit: dict, steps: int, resolved: bool = True) -> np.ndarray:
    """Return the Floquet multipliers of an orbit, from one tangent vector for each state."""
    scene = Effects(axial=orbit["scene"] == "full")
    count = len(scene.states)
    outcome = integrate(
        system_of(pan2021(np.full(count, orbit["pitch_error"])), scene),
        np.tile(orbit["section_points"][0], (count, 1)),
        Plan(steps, 0, orbit["period"], 0, True, resolved),
        tangent_start=np.eye(count),
    )
    length = np.exp(outcome.growth.sum(axis=1))
    return np.linalg.eigvals(outcome.end_tangent * length[:, np.newaxis])


def exponent_error(orbit: dict, steps: int) -> float:
    largest = np.abs(multipliers(orbit, steps)).max()
    return abs(np.log(largest) / (orbit["period"] * PERIOD) - orbit["largest_exponent"])


@pytest.mark.parametrize("orbit", ORBITS, ids=name_of)
def test_the_exponent_of_an_orbit_with_crossings_converges_as_fast(orbit):
    errors = [exponent_error(orbit, int(steps)) for steps in STEPS]
    assert measured_order(errors, STEPS) > 3.5
    for steps, largest in ((100, 2e-5), (200, 2e-6), (400, 2e-7), (800, 2e-8)):
        assert errors[list(STEPS).index(steps)] < largest


@pytest.mark.parametrize("orbit", [o for o in ORBITS if o["scene"] == "full"], ids=name_of)
def test_plain_steps_give_no_such_multipliers(orbit):
    wanted = np.array([complex(*one) for one in orbit["floquet_multipliers"]])

    def missed(resolved: bool) -> float:
        apart = np.abs(multipliers(orbit, 400, resolved)[:, np.newaxis] - wanted)
        return apart.min(axis=0).max()

    assert missed(False) > 50.0 * missed(True)


@pytest.mark.parametrize("orbit", ORBITS, ids=name_of)
def test_an_orbit_crosses_the_known_number_of_times_in_every_period(orbit):
    turns = 20
    outcome = run(
        pan2021(orbit["pitch_error"]),
        Effects(axial=orbit["scene"] == "full"),
        stored_state(orbit["section_points"][0]),
        steps=200,
        periods=turns * orbit["period"],
        resolved=True,
    )
    assert outcome.crossings[0] == turns * orbit["crossings"]
    assert 0.0 < outcome.slowest_crossing[0] < np.inf
    assert outcome.section[0, -1] == pytest.approx(orbit["section_points"][0], rel=0, abs=2e-5)


def test_no_crossing_is_counted_twice_wherever_in_its_step_it_falls():
    # Neighbouring motions of period 1: their crossings lie at all places within the steps.
    lanes, periods = 320, 50
    model = pan2021(np.linspace(5.0, 7.0, lanes))
    outcome = run(model, FULL, steps=100, transient=600, periods=periods, points=1, resolved=True)
    assert (outcome.crossings == 4 * periods).all()
    assert not outcome.overflows.any()


def test_crossings_are_counted_in_the_recorded_periods_only():
    how = {"steps": 100, "points": 1, "resolved": True}
    parts = [
        int(run(pan2021(5.86), transient=transient, periods=periods, **how).crossings[0])
        for transient, periods in ((0, 20), (8, 12), (0, 8))
    ]
    assert parts[0] == parts[1] + parts[2]
    assert min(parts) > 0


SPEEDS = 0.3, 0.5
"""Load and half backlash of a free oscillation that leaves its flank."""


@pytest.mark.parametrize("excess", [1e-2, 0.1, 0.5, 1.0])
def test_the_slowest_crossing_is_the_one_that_energy_gives(excess):
    # An oscillation about the loaded equilibrium leaves the flank if its amplitude exceeds the
    # static deflection, and returns with the same speed.
    load, half_backlash = SPEEDS
    cosine = np.cos(BASE_HELIX_ANGLE)
    deflection = load / cosine
    amplitude = (1.0 + excess) * deflection
    model = pan2021(0.0, load=load, half_backlash=half_backlash, damping_ratio=0.0)
    start = state(delta_5=half_backlash * cosine + deflection + amplitude)
    wanted = np.sqrt(cosine * (amplitude**2 - deflection**2))
    errors = []
    for steps in (100, 200, 400):
        outcome = run(model, CLEARANCE, start, steps=steps, periods=10, resolved=True)
        assert outcome.crossings[0] >= 12
        errors.append(abs(outcome.slowest_crossing[0] / wanted - 1.0))
    assert errors[0] < 3e-3
    assert errors[2] < 2e-5
    assert measured_order(errors, np.array([100, 200, 400])) > 3.5


def test_the_slowest_crossing_of_the_axial_clearance_is_a_speed_of_y_2():
    # This lane crosses the axial clearance, but never the tangential clearance.
    model = pan2021(0.0, load=0.0, damping_ratio=0.0, axial_damping_p=0.0, axial_damping_g=0.0)
    still = "axial_stiffness_p", "axial_stiffness_g", "stiffness_variation_scale"
    model = model._replace(**dict.fromkeys(still, np.zeros(1)))
    speed = 0.3
    # y_2 moves from 0 through the clearance at constant speed and rebounds at the flank.
    outcome = run(model, FULL, state(delta_3_rate=speed), steps=200, periods=2, resolved=True)
    assert outcome.crossings[0] >= 2
    assert outcome.slowest_crossing[0] == pytest.approx(speed, rel=1e-5)


def test_without_a_crossing_the_slowest_one_is_infinite():
    orbit = next(
        o for o in SOLUTIONS["periodic_orbits"] if o["scene"] == "full" and o["crossings"] == 0
    )
    point = stored_state(orbit["section_points"][0])
    outcome = run(pan2021(orbit["pitch_error"]), FULL, point, periods=20, resolved=True)
    assert outcome.crossings.tolist() == [0]
    assert outcome.slowest_crossing.tolist() == [np.inf]


def test_a_step_that_crosses_too_often_is_counted_and_never_silent():
    # The mesh would oscillate more than once per step. RK4 cannot follow this.
    lanes = 64
    steps = 20
    swing = np.linspace(6.6, 12.0, lanes)
    frequency = 2.0 * np.pi * np.sqrt(np.cos(BASE_HELIX_ANGLE)) / (steps * swing)
    model = pan2021(np.full(lanes, 5.86), mesh_frequency=frequency)
    outcome = run(model, CLEARANCE, state(delta_5=1.0), steps=steps, periods=40, resolved=True)
    assert np.mean(outcome.overflows > 0) > 0.9
    assert ((outcome.overflows > 0) | (outcome.status != 0)).all()


@pytest.mark.parametrize("scene", [NO_BACKLASH, TORSION], ids=named)
def test_without_backlash_resolved_steps_are_the_plain_ones(scene):
    how = {"steps": 60, "periods": 3}
    resolved = run(IN_PHASE, scene, START, **how, resolved=True)
    assert_same_bits(resolved, run(IN_PHASE, scene, START, **how))
    assert not resolved.crossings.any()


# These starts are fast enough to cross the clearance in every scene.
FAST = START + np.stack(
    [
        state(delta_5_rate=-1.5, delta_3_rate=1.5, delta_4_rate=-1.5),
        state(delta_5_rate=1.5, delta_3_rate=-1.5, delta_4_rate=1.5),
    ]
)


@pytest.mark.parametrize("scene", [FULL, TORSION_ONLY], ids=named)
def test_resolved_steps_agree_with_plain_ones_so_fine_that_crossings_do_not_matter(scene):
    for physical in (False, True):
        how = {"periods": 3, "physical": physical}
        fine = run(IN_PHASE, scene, FAST, steps=25_600, **how)
        for steps, tolerance in ((400, 2e-5), (800, 1.5e-6)):
            resolved = run(IN_PHASE, scene, FAST, steps=steps, **how, resolved=True)
            assert resolved.section == pytest.approx(fine.section, rel=0, abs=tolerance)
            # With plain steps, the tangent vector has a first-order error at every crossing.
            assert resolved.growth == pytest.approx(fine.growth, rel=0, abs=2e-3)
            assert (resolved.crossings > 0).all()


def test_resolved_steps_without_tangent_give_the_states_of_those_with_it():
    how = {"steps": 60, "periods": 3, "resolved": True}
    plain = run(IN_PHASE, FULL, START, **how, tangent=False)
    both = run(IN_PHASE, FULL, START, **how)
    assert plain.growth.size == 0
    assert plain.section == pytest.approx(both.section, rel=0, abs=2e-11)
    assert plain.crossings.tolist() == both.crossings.tolist()


def test_without_clearance_resolved_steps_are_those_of_the_scene_without_backlash():
    model = IN_PHASE._replace(half_backlash=np.zeros(2))
    how = {"steps": 100, "periods": 5}
    clearance = run(model, FULL, START, **how, resolved=True)
    linear = run(model, NO_BACKLASH, START, **how)
    assert clearance.section == pytest.approx(linear.section, rel=0, abs=1e-12)
    assert clearance.growth == pytest.approx(linear.growth, rel=0, abs=1e-12)
    assert not clearance.crossings.any()
