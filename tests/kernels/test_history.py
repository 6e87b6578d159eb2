"""The state at every step of the last periods, which contains sections and the end state."""

import numpy as np
import pytest
from gearchaos_kernels import Outcome, Plan, integrate

from .reference import OMEGA, assert_same_bits, pan2021, system_of

STEPS, RECORDED, KEPT, LANES = 60, 7, 3, 35


def run(transient: int, kept: int) -> Outcome:
    plan = Plan(STEPS, transient, RECORDED, RECORDED, True, True, kept)
    model = pan2021(np.linspace(0.0, 15.0, LANES))
    return integrate(system_of(model), np.zeros((LANES, 10)), plan)


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return run(5, KEPT)


def test_the_history_meets_the_section_once_a_period(outcome):
    once_a_period = outcome.history[:, STEPS::STEPS]
    assert np.array_equal(once_a_period, outcome.section[:, -KEPT:])


def test_the_history_begins_where_the_period_before_ended(outcome):
    assert np.array_equal(outcome.history[:, 0], outcome.section[:, -KEPT - 1])


def test_the_history_ends_with_the_lane(outcome):
    assert np.array_equal(outcome.history[:, -1], outcome.end_state)


def test_a_history_of_the_whole_run_begins_at_the_start():
    assert np.array_equal(run(0, RECORDED).history[:, 0], np.zeros((LANES, 10)))


def test_keeping_the_history_changes_nothing_else(outcome):
    without = run(5, 0)
    assert_same_bits(outcome._replace(history=without.history), without)


def test_between_two_steps_displacements_follow_the_rates(outcome):
    """The trapezoidal rule holds over each step; a wrong order of the samples would violate it."""
    step = 2.0 * np.pi / OMEGA / STEPS
    moved = np.diff(outcome.history[:, :, 0::2], axis=1)
    rates = outcome.history[:, :, 1::2]
    expected = 0.5 * step * (rates[:, 1:] + rates[:, :-1])
    assert np.max(np.abs(moved - expected)) < 0.01 * np.max(np.abs(moved))


def test_the_history_of_a_lane_that_diverges_in_the_last_period_ends_as_the_lane_does():
    model = pan2021(np.ones(2))
    model.transverse_damping_g[1] = -2.5
    system, start = system_of(model), np.zeros((2, 10))
    long = integrate(system, start, Plan(STEPS, 0, 30, 30, True, True, 1))
    (_, last), status = long.diverged_period, long.status
    assert status.tolist() == [0, 1]
    ended = integrate(system, start, Plan(STEPS, 0, last + 1, 1, True, True, 1))
    assert np.isnan(ended.end_state[1]).all() and np.isnan(ended.history[1, -1]).all()
    assert np.isfinite(ended.history[0]).all() and np.isfinite(ended.history[1, 0]).all()
