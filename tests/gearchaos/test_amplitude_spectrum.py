"""Lines of a spectrum have the amplitudes of the waves in the signal."""

import numpy as np
import pytest

from gearchaos.records.amplitude_spectrum import spectral_lines

STEPS, PERIODS = 20, 12
TIME = np.arange(PERIODS * STEPS) / STEPS
ROUNDING = 1e-14


def wave(amplitude: float, order: float, phase: float = 0.4) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * order * TIME + phase)


@pytest.mark.parametrize("hann", [False, True])
@pytest.mark.parametrize("order", [0.25, 1.0, 7 / 3, 9.0])
def test_a_sine_of_amplitude_a_is_a_line_of_height_a(hann, order):
    lines = spectral_lines(wave(1.7, order), STEPS, hann)
    peak = np.argmax(lines.amplitude)
    assert lines.order[peak] == pytest.approx(order)
    assert lines.amplitude[peak] == pytest.approx(1.7, rel=ROUNDING)


def test_a_rectangular_window_over_whole_periods_shows_nothing_else():
    lines = spectral_lines(wave(1.7, 1.0) + wave(0.2, 0.5) - 3.0, STEPS)
    expected = np.zeros(PERIODS * STEPS // 2 + 1)
    expected[[0, PERIODS // 2, PERIODS]] = 3.0, 0.2, 1.7
    np.testing.assert_allclose(lines.amplitude, expected, atol=ROUNDING)


def test_the_hann_window_spreads_a_line_to_its_neighbours_and_keeps_the_mean_apart():
    lines = spectral_lines(wave(1.0, 1.0) - 3.0, STEPS, hann=True)
    expected = np.zeros(PERIODS * STEPS // 2 + 1)
    expected[[0, PERIODS - 1, PERIODS, PERIODS + 1]] = 3.0, 0.5, 1.0, 0.5
    np.testing.assert_allclose(lines.amplitude, expected, atol=ROUNDING)


def test_the_hann_window_keeps_down_what_leaks_from_a_wave_that_does_not_fit():
    between_lines = wave(1.0, 1.0 + 0.5 / PERIODS)
    far = slice(4 * PERIODS, None)
    plain, hann = (spectral_lines(between_lines, STEPS, hann).amplitude for hann in (False, True))
    assert np.max(hann[far]) < 0.01 * np.max(plain[far])


def test_the_nyquist_line_is_not_doubled():
    alternating = 0.8 * (-1.0) ** np.arange(TIME.size)
    lines = spectral_lines(alternating, STEPS)
    assert lines.order[-1] == STEPS / 2
    assert lines.amplitude[-1] == pytest.approx(0.8)


def test_an_odd_number_of_samples_has_no_nyquist_line():
    time = np.arange(45) / 15
    lines = spectral_lines(np.cos(2.0 * np.pi * 22 / 3 * time), 15)
    assert lines.order[-1] == pytest.approx(22 / 3)
    assert lines.amplitude[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("samples", [240, 225])
def test_the_lines_hold_the_mean_square_of_the_motion(samples):
    """Parseval: half the squared amplitude of every sine, the whole of mean and Nyquist line."""
    values = np.random.default_rng(3).normal(1.0, 2.0, samples)
    amplitude = spectral_lines(values, samples // 15).amplitude
    shares = np.full(amplitude.size, 0.5)
    shares[0] = 1.0
    shares[-1] = 1.0 if samples % 2 == 0 else 0.5
    assert np.sum(shares * amplitude**2) == pytest.approx(np.mean(values**2), rel=1e-13)


def test_motions_side_by_side_are_transformed_one_by_one():
    both = np.stack([wave(1.0, 1.0) + 1.0, wave(2.0, 3.0)])
    before = both.copy()
    amplitude = spectral_lines(both, STEPS, hann=True).amplitude
    for row, motion in zip(amplitude, both, strict=True):
        np.testing.assert_array_equal(row, spectral_lines(motion, STEPS, hann=True).amplitude)
    np.testing.assert_array_equal(both, before)
