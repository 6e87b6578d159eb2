"""The period of a motion is the period of its section, at any phase and scale."""

import numpy as np
import pytest

from gearchaos.records.period import LONGEST_PERIOD, motion_period, section_distance

RANDOM = np.random.default_rng(7)


def orbit(period: int, points: int = 60, states: int = 2) -> np.ndarray:
    """Return the section of one periodic lane: ``period`` random points, repeated."""
    cycle = RANDOM.uniform(-1.0, 1.0, (period, states))
    return np.resize(cycle, (points, states))[np.newaxis]


def logistic_map(r: float, points: int) -> np.ndarray:
    x = 0.4
    orbit = []
    for _ in range(2000 + points):
        x = r * x * (1.0 - x)
        orbit.append(x)
    return np.array(orbit[2000:]).reshape(1, points, 1)


def test_every_period_up_to_the_longest_is_found_among_lanes_of_others():
    periods = range(1, LONGEST_PERIOD + 1)
    section = np.concatenate([orbit(n) for n in periods])
    assert motion_period(section).tolist() == [*periods]


def test_a_longer_period_is_none():
    assert motion_period(orbit(17, points=200)).tolist() == [0]


@pytest.mark.parametrize(
    ("r", "period"), [(2.8, 1), (3.2, 2), (3.5, 4), (3.55, 8), (3.83, 3), (3.7, 0), (4.0, 0)]
)
def test_the_logistic_map_has_its_well_known_periods(r, period):
    assert motion_period(logistic_map(r, 100)).tolist() == [period]


def test_a_quasi_periodic_motion_has_no_period():
    angle = np.arange(100) * (np.sqrt(5.0) - 1.0) * np.pi
    section = np.stack([np.cos(angle), np.sin(angle)], axis=1)[np.newaxis]
    assert motion_period(section).tolist() == [0]


def test_a_period_must_fit_three_times_into_the_section():
    assert motion_period(orbit(4, points=12)).tolist() == [4]
    assert motion_period(orbit(4, points=11)).tolist() == [0]
    assert motion_period(orbit(1, points=2)).tolist() == [0]
    assert motion_period(np.zeros((5, 0, 2))).tolist() == [0] * 5
    assert motion_period(np.zeros((5, 50, 0))).tolist() == [0] * 5


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_the_unit_of_a_coordinate_does_not_matter(scale):
    two = orbit(2) * [1.0, scale]
    assert motion_period(two).tolist() == [2]
    noisy = two * (1.0 + 1e-7 * RANDOM.normal(size=two.shape))
    assert motion_period(noisy).tolist() == [2]
    assert motion_period(two * (1.0 + 1e-2 * RANDOM.normal(size=two.shape))).tolist() == [0]


def test_rounding_in_a_coordinate_that_is_zero_does_not_hide_the_period():
    section = orbit(3)
    section[:, :, 1] = 1e-15 * RANDOM.normal(size=60)
    assert motion_period(section).tolist() == [3]
    assert motion_period(np.zeros((1, 60, 2))).tolist() == [1]


def test_a_transient_that_is_still_on_its_way_has_no_period():
    decay = np.exp(-0.1 * np.arange(60))[np.newaxis, :, np.newaxis]
    assert motion_period(1.0 + decay).tolist() == [0]
    assert motion_period(1.0 + 1e-6 * decay).tolist() == [1]


def test_a_diverged_lane_has_no_period_and_its_neighbours_keep_theirs():
    section = np.concatenate([orbit(2), np.full((1, 60, 2), np.nan), orbit(5)])
    assert motion_period(section).tolist() == [2, 0, 5]


def test_the_distance_of_two_orbits_does_not_depend_on_their_phase():
    one = np.concatenate([orbit(4), orbit(3), orbit(1), orbit(2)])
    other = one + 1e-3 * np.array([1.0, -2.0])
    other = np.stack(
        [np.roll(lane, shift, axis=0) for lane, shift in zip(other, range(4), strict=True)]
    )
    distance = section_distance(one, other, np.array([4, 3, 1, 0], dtype=np.int32))
    assert distance[:3] == pytest.approx(2e-3)
    assert np.isnan(distance[3])
