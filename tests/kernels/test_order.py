"""The measured order of the method: the slope of log error over log step."""

import numpy as np
import pytest

from .reference import FULL, LINEAR, NO_BACKLASH, SOLUTIONS, pan2021, run, state, stored_state

STEPS = np.array([200, 283, 400, 566, 800])
FINE = 6400
PERIODS = 5
CLASSICAL = pytest.approx(4.0, abs=0.1)


def measured_order(errors, steps=STEPS) -> float:
    """Return the slope of the regression of log error on log step."""
    return float(np.polyfit(-np.log(steps), np.log(errors), 1)[0])


def largest_difference(one, other) -> float:
    return float(np.max(np.abs(np.asarray(one) - np.asarray(other))))


@pytest.mark.parametrize("name", ["no_backlash", "linear"])
def test_states_of_a_scene_without_clearance_converge_with_order_four(name):
    solution = next(s for s in SOLUTIONS["runs"] if s["scene"] == name)
    scene = {"no_backlash": NO_BACKLASH, "linear": LINEAR}[name]
    wanted = np.array(solution["state"][solution["periods"].index(PERIODS)])
    errors = [
        largest_difference(
            run(pan2021(5.86), scene, steps=steps, periods=PERIODS).section[0, -1], wanted
        )
        for steps in STEPS
    ]
    assert measured_order(errors) == CLASSICAL


def test_states_of_a_motion_that_stays_in_contact_converge_with_order_four():
    orbit = next(
        o for o in SOLUTIONS["periodic_orbits"] if o["scene"] == "full" and o["crossings"] == 0
    )
    point = stored_state(orbit["section_points"][0])
    errors = [
        largest_difference(
            run(pan2021(orbit["pitch_error"]), FULL, point, steps=steps, periods=PERIODS).section,
            point,
        )
        for steps in STEPS
    ]
    assert measured_order(errors) == CLASSICAL


@pytest.mark.parametrize(
    ("scene", "pitch_error"), [(NO_BACKLASH, 5.86), (LINEAR, 5.86), (FULL, 0.5)]
)
def test_growth_of_the_tangent_vector_converges_with_order_four(scene, pitch_error):
    orbit = next(
        o for o in SOLUTIONS["periodic_orbits"] if o["scene"] == "full" and o["crossings"] == 0
    )
    start = stored_state(orbit["section_points"][0])

    def total_growth(steps):
        outcome = run(pan2021(pitch_error), scene, start, steps=steps, periods=PERIODS)
        return np.cumsum(outcome.growth[0])

    # More steps: the tangent vector starts with all modes, including the stiff axial modes.
    steps = 2 * STEPS
    errors = [largest_difference(total_growth(s), total_growth(FINE)) for s in steps]
    assert measured_order(errors, steps) == CLASSICAL


def test_clearance_crossings_leave_an_error_that_falls_like_the_square_of_the_step():
    solution = next(s for s in SOLUTIONS["runs"] if s["pitch_error"] == 0.0)
    wanted = np.array(solution["state"])
    at = np.array(solution["periods"]) - 1

    def error(steps):
        outcome = run(pan2021(0.0), steps=int(steps), periods=solution["periods"][-1])
        return largest_difference(outcome.section[0, at], wanted)

    # The place of a crossing within its step is random. A mean over many step counts shows the
    # order.
    coarse = np.mean([error(steps) for steps in range(200, 240)])
    fine = np.mean([error(steps) for steps in range(800, 960, 4)])
    assert np.log(coarse / fine) / np.log(4.0) > 1.7


@pytest.mark.parametrize("seed", range(3))
def test_tangent_vector_is_the_limit_of_two_neighbouring_motions(seed):
    rng = np.random.default_rng(seed)
    start = state(delta_5=1.4) + 0.01 * rng.standard_normal(10)
    direction = np.ones(10) / np.sqrt(10.0)
    distance = 1e-6
    pair = np.stack([start + distance * direction, start - distance * direction])
    outcome = run(pan2021([5.86, 5.86]), FULL, pair, steps=200, periods=1)
    middle = run(pan2021(5.86), FULL, start, steps=200, periods=1)
    growth = np.linalg.norm(np.subtract(*outcome.section[:, 0])) / (2.0 * distance)
    assert middle.growth[0, 0] == pytest.approx(np.log(growth), rel=0, abs=1e-4)
