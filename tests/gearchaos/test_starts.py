"""The states in which the lanes of a sweep start."""

import numpy as np
import pytest

from .short_sweeps import RANDOM, simulation, starts_of


def test_lanes_start_at_rest_unless_told_otherwise():
    assert not starts_of(simulation()).any()


def test_contact_start_lies_on_the_flank_that_the_load_presses():
    sweep = simulation("start.kind=contact")
    start = starts_of(sweep)
    groups = sweep.lanes.system_of(np.arange(13)).groups
    clearance = groups.half_backlash * np.cos(groups.base_helix_angle)
    assert start[:, 0] == pytest.approx(clearance + groups.load)
    assert not start[:, 1:].any()


def test_contact_start_of_a_negative_load_lies_on_the_other_flank():
    one = starts_of(simulation("start.kind=contact"))
    other = starts_of(simulation("start.kind=contact", "groups.load=-0.26762"))
    assert np.array_equal(one, -other)


def test_contact_start_without_backlash_is_the_static_deflection():
    start = starts_of(
        simulation("start.kind=contact", 'scene.effects=["pitch_error", "transverse"]')
    )
    assert start[:, 0] == pytest.approx(np.full(13, 0.26762))


def test_given_start_fills_the_named_states_and_leaves_the_others_at_zero():
    given = "start.state={delta_5 = 0.5, delta_2_rate = -0.25}"
    sweep = simulation("start.kind=given", given)
    start = starts_of(sweep)
    assert (start[:, sweep.lanes.states.index("delta_5")] == 0.5).all()
    assert (start[:, sweep.lanes.states.index("delta_2_rate")] == -0.25).all()
    assert np.count_nonzero(start) == 2 * 13


def test_random_starts_fill_the_states_of_the_scene_within_the_spread():
    start = starts_of(simulation(*RANDOM, "sweep.count=400"))
    assert start.shape == (1200, 6)
    assert np.abs(start).max() <= 0.7
    assert np.abs(start).max(axis=0).min() > 0.69
    assert np.abs(start.mean(axis=0)).max() < 4.0 * 0.7 / np.sqrt(3.0 * 1200)
    assert np.unique(start).size == start.size


def test_random_starts_follow_from_the_seed_and_nothing_else():
    assert np.array_equal(starts_of(simulation(*RANDOM)), starts_of(simulation(*RANDOM)))
    other = starts_of(simulation(*RANDOM, "start.seed=6"))
    assert not np.intersect1d(starts_of(simulation(*RANDOM)), other).size > 1


@pytest.mark.parametrize(("first", "last"), [(0, 1), (1, 2), (7, 20), (38, 39)])
def test_random_start_of_a_lane_does_not_depend_on_its_block(first, last):
    sweep = simulation(*RANDOM)
    assert np.array_equal(starts_of(sweep, first, last), starts_of(sweep)[first:last])
