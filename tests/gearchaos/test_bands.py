"""Subsequences of every n-th point cover a whole torus, but not a doubled or tripled orbit."""

import numpy as np
import pytest

from gearchaos.dynamics.labelling import WHOLE
from gearchaos.records.bands import band_count, subsequence_spread
from gearchaos.records.period import LONGEST_PERIOD

POINTS = 2000
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def torus(rotation: float, curves: int = 1, points: int = POINTS) -> np.ndarray:
    """Return points that visit ``curves`` ellipses in turn, each with this rotation number."""
    number = np.arange(points)
    angle = 2.0 * np.pi * rotation * (number // curves)
    centre = 5.0 * np.cos(2.0 * np.pi * number / curves)
    return np.stack([centre + np.cos(angle), 3.0 + 0.1 * np.sin(angle + 1.0)], axis=1)


def logistic(r: float, points: int = POINTS) -> np.ndarray:
    """Return points of the logistic map after a long transient."""
    x = 0.4
    for _ in range(100_000):
        x = r * x * (1.0 - x)
    orbit = []
    for _ in range(points):
        x = r * x * (1.0 - x)
        orbit.append(x)
    return np.array(orbit)[:, np.newaxis]


def apart(section: np.ndarray) -> float:
    return float(subsequence_spread(section[np.newaxis])[0])


@pytest.mark.parametrize("curves", [1, 2, 3, 5, 16])
@pytest.mark.parametrize("rotation", [GOLDEN, np.sqrt(2.0) - 1.0])
def test_the_subsequences_of_a_torus_lie_on_top_of_each_other(rotation, curves):
    assert apart(torus(rotation, curves)) < min(WHOLE, 0.1)


@pytest.mark.parametrize("curves", [1, 2, 3])
def test_a_torus_may_take_a_hundred_points_for_a_turn(curves):
    assert apart(torus(0.01 * GOLDEN, curves)) < 0.1


@pytest.mark.parametrize(
    "r",
    [
        3.569945671870944,  # The end of the cascade of period doublings.
        3.569,  # Period 32.
        3.5697,  # Period 64.
        3.8495,  # In the cascade of the window of period 3.
    ],
)
def test_a_cascade_is_not_a_torus(r):
    assert apart(logistic(r)) > 1.0


@pytest.mark.parametrize("period", [32, 48, 80, 112, 2 * 3 * 5 * 7])
def test_a_long_period_of_small_factors_is_not_a_torus(period):
    once = np.random.default_rng(3).normal(size=(period, 2))
    assert apart(np.tile(once, (POINTS // period + 1, 1))[:POINTS]) > max(WHOLE, 0.25)


def test_too_few_points_report_nothing():
    assert apart(torus(GOLDEN, points=111)) == np.inf
    assert apart(torus(GOLDEN, points=112)) < np.inf
    # Sixteen curves need more than 500 points.
    assert apart(torus(GOLDEN, LONGEST_PERIOD, points=500)) > apart(torus(GOLDEN, LONGEST_PERIOD))


def test_a_coordinate_at_rest_does_not_matter():
    section = torus(GOLDEN)
    assert apart(np.insert(section, 1, 0.3, axis=1)) == apart(section)


def bands(section: np.ndarray) -> int:
    return int(band_count(section[np.newaxis])[0])


@pytest.mark.parametrize(
    ("r", "count"),
    # Bands merge at 3.5748, 3.5925722 and 3.6785735; in the window of period 3 at 3.85680.
    [
        *((3.573, 8), (3.58, 4), (3.5915, 4), (3.594, 2), (3.677, 2), (3.68, 1), (4.0, 1)),
        *((3.8531, 3), (3.8575, 1)),
    ],
)
def test_the_bands_of_the_logistic_map_merge_where_they_are_known_to(r, count):
    assert bands(logistic(r, 512)) == count


@pytest.mark.parametrize("curves", [1, 2, 3, 5])
@pytest.mark.parametrize("rotation", [GOLDEN, 0.01 * GOLDEN, np.pi / 10.0, 0.25 + 0.004 * GOLDEN])
def test_every_curve_of_a_torus_is_a_band(rotation, curves):
    section = torus(rotation, curves)
    # Without the added coordinate, some of these curves would lie on top of each other.
    apart = np.sin(2.0 * np.pi * np.arange(POINTS) / curves)
    assert bands(np.insert(section, 1, 5.0 * apart, axis=1)) == curves


def test_bands_may_surround_each_other():
    number = np.arange(512)
    radius, angle = 1.0 + number % 2, 2.0 * np.pi * GOLDEN * (number // 2)
    rings = radius[:, np.newaxis] * np.stack([np.cos(angle), np.sin(angle), radius], axis=1)
    assert bands(rings) == 2


def test_noise_a_point_at_rest_and_too_few_points_are_one_band():
    noise = np.random.default_rng(7).normal(size=(512, 6))
    assert bands(noise) == 1
    assert bands(np.ones((512, 2))) == 1
    assert bands(logistic(3.6, 31)) == 1
    assert bands(logistic(3.6, 32)) == 2
    assert bands(np.full((512, 2), np.nan)) == 1


def test_more_bands_than_are_counted_are_reported_as_a_divisor():
    assert bands(logistic(3.5701, 512)) == 16  # The map has 32 bands.
