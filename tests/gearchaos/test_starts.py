"""The start states of the lanes of a sweep."""

import re

import numpy as np
import pytest

from gearchaos.engine.lanes import Lanes
from gearchaos.errors import ConfigurationError
from gearchaos.models import load_config

from .short_sweeps import PAN2021, RANDOM, simulation, starts_of


def test_lanes_start_at_rest_by_default():
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


BOX = "start.box={delta_5=[-2.0, 1.0], delta_2_rate=[0.0, 0.5]}"


def test_a_grid_holds_every_pair_of_its_values_the_last_state_running_fastest():
    sweep = simulation("start.kind=grid", "start.count=4", BOX, "start.state={delta_1=0.3}")
    start = starts_of(sweep).reshape(13, 16, 6)
    columns = [sweep.lanes.states.index(name) for name in ("delta_5", "delta_2_rate")]
    grid = np.stack(np.meshgrid([-2, -1, 0, 1], np.linspace(0.0, 0.5, 4), indexing="ij"), axis=2)
    assert (start[:, :, columns] == grid.reshape(16, 2)).all()
    assert (start[:, :, sweep.lanes.states.index("delta_1")] == 0.3).all()
    assert np.count_nonzero(start.any(axis=(0, 1))) == 3
    assert sweep.lanes.shape == (13, 16)


def test_a_lane_of_a_grid_starts_where_it_does_in_any_block():
    sweep = simulation("start.kind=grid", "start.count=4", BOX)
    assert np.array_equal(starts_of(sweep, 21, 40), starts_of(sweep)[21:40])


def test_states_beside_a_grid_are_drawn_within_their_bounds_for_every_start_anew():
    drawn = ("start.count=4", BOX, "start.drawn={delta_1=[0.2, 0.4]}")
    sweep = simulation("start.kind=grid", *drawn)
    plain = simulation("start.kind=grid", "start.count=4", BOX)
    start, at = starts_of(sweep), sweep.lanes.states.index("delta_1")
    assert np.unique(start[:, at]).size == len(start)
    assert 0.2 <= start[:, at].min() < 0.21 and 0.39 < start[:, at].max() <= 0.4
    assert np.array_equal(np.delete(start, at, axis=1), np.delete(starts_of(plain), at, axis=1))
    assert np.array_equal(starts_of(sweep, 21, 40), start[21:40])
    other = simulation("start.kind=grid", *drawn, "start.seed=1")
    assert not np.any(starts_of(other)[:, at] == start[:, at])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["start.drawn={delta_5=[0.0, 1.0]}"], "start.box has a value of it as well"),
        (["start.drawn={delta_1=[1.0, 0.0]}"], "must be the lowest value and the highest one"),
        (["start.kind=random", "start.drawn={delta_1=[0.0, 1.0]}"], 'it goes with kind = "grid"'),
        (["start.seed=1"], "it goes with kind"),
    ],
)
def test_what_is_drawn_beside_a_grid_is_checked(changes, said):
    with pytest.raises(ConfigurationError, match=re.escape(said)):
        simulation("start.kind=grid", "start.count=4", BOX, *changes)


def test_random_starts_fill_a_box_and_leave_other_states_as_given():
    more = ("start.count=200", BOX, "start.state={delta_1=0.3}")
    sweep = simulation("start.kind=random", *more)
    start = starts_of(sweep)
    inside = {"delta_5": (-2.0, 1.0), "delta_2_rate": (0.0, 0.5)}
    for name, column in zip(sweep.lanes.states, start.T, strict=True):
        low, high = inside.get(name, (0.3, 0.3) if name == "delta_1" else (0.0, 0.0))
        assert low <= column.min() <= low + 0.01 * (high - low)
        assert high - 0.01 * (high - low) <= column.max() <= high


def test_random_starts_fill_the_states_of_a_large_machine_whatever_the_block():
    options = ["start={kind='random', count=3, spread=0.1, seed=4}", "sweep.count=5"]
    config = load_config(PAN2021.with_name("planetary.toml"), options)
    lanes = Lanes(config)
    together = lanes.start_of(np.arange(15))
    assert together.shape == (15, 34)
    assert np.unique(together).size == 15 * 34 and (np.abs(together) <= 0.1).all()
    for number in (0, 7, 14):
        assert np.array_equal(lanes.start_of(np.array([number]))[0], together[number])
