"""Wilson's interval of a share agrees with its definition, its closed forms and its coverage."""

from math import comb

import numpy as np
import pytest

from gearchaos.records.wilson import CONFIDENCE_95, wilson_interval


@pytest.mark.parametrize(
    ("counted", "of", "interval"),
    [
        # Count 0 has the upper end z^2 / (n + z^2), count n the lower end 1 - z^2 / (n + z^2),
        # count n / 2 the ends 1/2 +- z / (2 sqrt(n + z^2)).
        (0, 10, (0.0, 0.2775327998628892)),
        (200, 200, (0.9811546736227335, 1.0)),
        (5, 10, (0.236593090512564, 0.763406909487436)),
        (1, 1, (0.2065493143772375, 1.0)),
    ],
)
def test_known_intervals(counted, of, interval):
    np.testing.assert_allclose(wilson_interval(counted, of), interval, rtol=1e-12)


def test_at_its_ends_the_count_lies_so_many_of_their_deviations_away():
    counted, of = np.arange(1, 30), 30
    ends = wilson_interval(counted, of)
    assert ends.shape == (29, 2)
    away = np.abs(ends - counted[:, np.newaxis] / of) / np.sqrt(ends * (1.0 - ends) / of)
    np.testing.assert_allclose(away, CONFIDENCE_95, rtol=1e-12)


@pytest.mark.parametrize("of", [20, 100, 200])
def test_it_holds_the_share_in_95_of_100_cases(of):
    """The coverage is summed over all counts and averaged over shares, without random numbers."""
    shares, counts = np.linspace(0.02, 0.98, 481), np.arange(of + 1)
    ways = np.array([comb(of, int(n)) for n in counts], dtype=np.float64)
    chance = ways * shares[:, np.newaxis] ** counts * (1.0 - shares[:, np.newaxis]) ** (of - counts)
    low, high = wilson_interval(counts, of).T
    held = (low <= shares[:, np.newaxis]) & (shares[:, np.newaxis] <= high)
    coverage = np.sum(chance * held, axis=1)
    assert np.mean(coverage) == pytest.approx(0.95, abs=0.01)
    assert coverage.min() > 0.83


def test_without_a_trial_there_is_none():
    assert np.isnan(wilson_interval([0, 0], [0, 0])).all()
