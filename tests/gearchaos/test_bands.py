"""Every n-th point of a torus goes everywhere; of a doubled or tripled orbit it does not."""

import numpy as np
import pytest

from gearchaos.records.bands import subsequence_spread
from gearchaos.records.period import LONGEST_PERIOD

POINTS = 2000
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def torus(rotation: float, curves: int = 1, points: int = POINTS) -> np.ndarray:
    """Points that visit so many ellipses in turn, each with this rotation number."""
    number = np.arange(points)
    angle = 2.0 * np.pi * rotation * (number // curves)
    centre = 5.0 * np.cos(2.0 * np.pi * number / curves)
    return np.stack([centre + np.cos(angle), 3.0 + 0.1 * np.sin(angle + 1.0)], axis=1)


def logistic(r: float, points: int = POINTS) -> np.ndarray:
    """Points of the logistic map after a long transient."""
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
    assert apart(torus(rotation, curves)) < 0.1


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
    assert apart(np.tile(once, (POINTS // period + 1, 1))[:POINTS]) > 0.25


def test_too_few_points_tell_nothing():
    assert apart(torus(GOLDEN, points=111)) == np.inf
    assert apart(torus(GOLDEN, points=112)) < np.inf
    # Sixteen curves take more points than these.
    assert apart(torus(GOLDEN, LONGEST_PERIOD, points=500)) > apart(torus(GOLDEN, LONGEST_PERIOD))


def test_a_coordinate_at_rest_does_not_matter():
    section = torus(GOLDEN)
    assert apart(np.insert(section, 1, 0.3, axis=1)) == apart(section)
