"""The largest Lyapunov exponent follows from growth rates with a known mean."""

import numpy as np
import pytest

from gearchaos.records.lyapunov import largest_exponent

PERIOD = 7.1736
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def estimate(growth: np.ndarray, period: float = PERIOD) -> tuple[np.ndarray, np.ndarray]:
    return largest_exponent(growth, np.full(growth.shape[0], period))


@pytest.mark.parametrize("periods", [2, 3, 9, 10, 11, 500])
def test_constant_growth_is_the_exponent_without_error(periods):
    growth = np.tile(np.array([[0.3], [0.0], [-2.0]]), periods)
    exponent, error = estimate(growth)
    assert exponent == pytest.approx(growth[:, 0] / PERIOD, rel=1e-14)
    assert error == pytest.approx(np.zeros(3), abs=1e-15)


def test_exponent_is_per_unit_of_time_of_each_lanes_own_period():
    growth = np.full((3, 40), 0.2)
    period = np.array([1.0, 2.0, 8.0])
    exponent, _ = largest_exponent(growth, period)
    assert exponent == pytest.approx([0.2, 0.1, 0.025])


def test_a_single_period_gives_an_exponent_without_a_standard_error():
    exponent, error = estimate(np.array([[0.5]]))
    assert exponent == pytest.approx([0.5 / PERIOD])
    assert np.isnan(error).all()


def test_two_periods_give_a_standard_error():
    _, error = estimate(np.array([[0.5, 0.7]]))
    # Half the difference, widened to the quantile of t for one degree of freedom, to first order.
    assert error == pytest.approx([2.25 * 0.1 / PERIOD])


def quasi_periodic_error(periods: int) -> float:
    """Return the largest error over many phases of a growth that oscillates about 0.01."""
    phase = np.linspace(0.0, 1.0, 64, endpoint=False)[:, np.newaxis]
    angle = 2.0 * np.pi * (GOLDEN * np.arange(periods) + phase)
    growth = 0.01 + np.cos(angle) + 0.5 * np.sin(2.0 * angle)
    return float(np.abs(estimate(growth)[0] * PERIOD - 0.01).max())


def test_quasi_periodic_growth_converges_with_the_third_power_of_the_number_of_periods():
    periods = np.array([100, 200, 400, 800, 1600])
    errors = [quasi_periodic_error(number) for number in periods]
    order = -np.polyfit(np.log(periods), np.log(errors), 1)[0]
    assert order == pytest.approx(3.0, abs=0.2)
    assert errors[-1] < 1e-8


def test_quasi_periodic_growth_is_far_closer_than_its_plain_mean():
    growth = 0.01 + np.cos(2.0 * np.pi * GOLDEN * np.arange(500))[np.newaxis]
    exponent, error = estimate(growth)
    plain = abs(growth.mean() - 0.01)
    assert abs(exponent[0] * PERIOD - 0.01) < 1e-3 * plain
    assert error[0] * PERIOD < 1e-3


@pytest.mark.parametrize("periods", [100, 500, 1003])
def test_standard_error_of_white_noise_is_calibrated(periods):
    rng = np.random.default_rng(periods)
    lanes = 6_000
    growth = 0.4 + rng.standard_normal((lanes, periods))
    exponent, error = estimate(growth)
    true_spread = np.std(exponent)
    z = (exponent - 0.4 / PERIOD) / error
    # A normal distribution has 95.4 % within two deviations; 6000 lanes resolve this to 0.3 %.
    assert np.mean(np.abs(z) < 2.0) == pytest.approx(0.954, abs=0.01)
    # The error is a little wider than the spread because it is estimated from few blocks.
    assert 1.0 < np.sqrt(np.mean(error**2)) / true_spread < 1.15
    # The smooth weights increase the spread by the factor sqrt(3/2).
    assert true_spread * PERIOD == pytest.approx(np.sqrt(1.5 / periods), rel=0.05)


def test_standard_error_of_correlated_growth_covers_it():
    rng = np.random.default_rng(3)
    noise = rng.standard_normal((4000, 1100))
    # The growth has a memory of about five periods, as in a chaotic motion near a window.
    growth = np.zeros_like(noise)
    for period in range(1, noise.shape[1]):
        growth[:, period] = 0.8 * growth[:, period - 1] + noise[:, period]
    exponent, error = estimate(growth[:, 100:])
    assert 0.93 < np.mean(np.abs(exponent) < 2.0 * error) < 0.97


def test_a_lane_that_diverged_has_neither_and_leaves_the_others_alone():
    growth = np.random.default_rng(0).standard_normal((3, 60))
    sound = estimate(growth[[0, 2]])
    growth[1, 40:] = np.nan
    exponent, error = estimate(growth)
    assert np.isnan([exponent[1], error[1]]).all()
    assert np.array_equal(exponent[[0, 2]], sound[0])
    assert np.array_equal(error[[0, 2]], sound[1])


def test_exponent_of_a_lane_does_not_depend_on_the_lanes_beside_it():
    growth = np.random.default_rng(1).standard_normal((97, 487))
    exponent, error = estimate(growth)
    for first in range(0, 97, 13):
        part = estimate(growth[first : first + 13])
        assert np.array_equal(part[0], exponent[first : first + 13])
        assert np.array_equal(part[1], error[first : first + 13])


def wandering(lanes: int, periods: int, memory: float) -> np.ndarray:
    """Return nearly white growth; a small slow part causes half the variance of the mean."""
    rng = np.random.default_rng(11)
    noise = rng.standard_normal((2, lanes, periods + 1000))
    keeps = np.exp(-1.0 / memory)
    slow = np.zeros((lanes, periods + 1000))
    for period in range(1, slow.shape[1]):
        slow[:, period] = keeps * slow[:, period - 1] + np.sqrt(1 - keeps**2) * noise[0, :, period]
    # The variance of the slow part times twice its memory is the variance of the white part: both
    # together double the variance of the mean.
    return 0.3 + noise[1, :, 1000:] + slow[:, 1000:] / np.sqrt(2.0 * memory)


@pytest.mark.parametrize("periods", [200, 500])
def test_two_standard_errors_cover_an_exponent_whose_growth_remembers(periods):
    memory = 80.0
    growth, one = wandering(3000, periods, memory), np.ones(3000)
    exponent, blind = largest_exponent(growth, one)
    told = largest_exponent(growth, one, np.full(3000, memory))
    assert np.array_equal(told[0], exponent)
    covered = [np.mean(np.abs(exponent - 0.3) <= 2.0 * error) for error in (blind, told[1])]
    assert covered[0] < 0.91
    assert covered[1] > 0.92
    # The error is as wide as Student's t with two waves requires, and no wider.
    assert np.median(told[1]) < 2.2 * np.std(exponent)


@pytest.mark.parametrize(("periods", "widest"), [(100, 2.1), (300, 1.7), (700, 1.3)])
def test_white_growth_has_errors_that_are_wider_by_the_few_waves_of_a_long_memory(periods, widest):
    growth = np.random.default_rng(periods).standard_normal((4000, periods))
    one, memory = np.ones(4000), np.full(4000, 99.0)
    exponent, blind = largest_exponent(growth, one)
    error = largest_exponent(growth, one, memory)[1]
    assert (error >= blind).all()
    assert np.mean(np.abs(exponent) <= 2.0 * error) > 0.954
    assert np.median(error / blind) < widest


def test_blocks_longer_than_the_memory_are_left_alone():
    growth = np.random.default_rng(4).standard_normal((50, 400))
    one = np.ones(50)
    alone = largest_exponent(growth, one)[1]
    memory = np.linspace(40.0, 60.0, 50)
    error = largest_exponent(growth, one, memory)[1]
    # Blocks are an eighth of the record: 50 periods.
    assert np.array_equal(error[memory <= 50.0], alone[memory <= 50.0])
    assert (error > alone)[memory > 50.0].mean() > 0.5


def test_errors_with_a_memory_do_not_depend_on_the_lanes_beside_it():
    growth = np.random.default_rng(1).standard_normal((97, 487))
    growth[13, 400:] = np.nan
    period, memory = np.full(97, PERIOD), np.geomspace(10.0, 1e4, 97)
    memory[-1] = np.inf
    error = largest_exponent(growth, period, memory)[1]
    assert np.isfinite(np.delete(error, 13)).all()
    assert np.isnan(error[13])
    for first in range(0, 97, 13):
        some = slice(first, first + 13)
        part = largest_exponent(growth[some], period[some], memory[some])[1]
        assert np.array_equal(part, error[some], equal_nan=True)


@pytest.mark.parametrize("periods", [2, 3, 9, 16])
def test_short_records_have_errors_with_a_memory_too(periods):
    growth = np.random.default_rng(periods).standard_normal((5, periods))
    alone = estimate(growth)[1]
    error = largest_exponent(growth, np.full(5, PERIOD), np.full(5, 1e3))[1]
    assert (error >= alone).all()
    assert np.isfinite(error).all()
