"""The pitch error and its derivatives."""

import numpy as np
import pytest

from gearchaos.gear import pitch_error

OMEGA = 0.87588
SINE = {"mesh_frequency": OMEGA, "amplitude": 0.022749, "phase": 0.4, "multiple": 5.86}
TAU = np.linspace(0.0, 20.0, 41)


def test_pitch_error_repeats_every_mesh_period():
    period = 2 * np.pi / OMEGA
    later = pitch_error.error(TAU + period, **SINE)
    assert later == pytest.approx(pitch_error.error(TAU, **SINE), abs=1e-14)


def test_pitch_error_swings_by_its_multiple_of_the_amplitude_about_its_mean():
    phases = np.linspace(0.0, 2 * np.pi / OMEGA, 10_001)
    values = pitch_error.error(phases, mean=0.01, **SINE)
    assert values.max() == pytest.approx(5.86 * (0.01 + 0.022749), rel=1e-6)
    assert values.min() == pytest.approx(5.86 * (0.01 - 0.022749), rel=1e-6)


def test_pan_2021_starts_at_zero_error_and_rising():
    bare = {"mesh_frequency": OMEGA, "amplitude": 0.022749}
    assert pitch_error.error(0.0, **bare) == 0.0
    assert pitch_error.rate(0.0, **bare) == pytest.approx(0.022749 * OMEGA)


@pytest.mark.parametrize(
    ("function", "derivative"),
    [
        (pitch_error.error, pitch_error.rate),
        (pitch_error.rate, pitch_error.acceleration),
    ],
)
def test_derivatives_match_central_differences(function, derivative):
    step = 1e-5
    difference = (function(TAU + step, **SINE) - function(TAU - step, **SINE)) / (2 * step)
    assert difference == pytest.approx(derivative(TAU, **SINE), abs=1e-9)


def test_inertial_forcing_of_a_sine_is_omega_squared_times_the_error():
    forcing = -pitch_error.acceleration(TAU, **SINE)
    assert forcing == pytest.approx(OMEGA**2 * pitch_error.error(TAU, **SINE), abs=1e-15)


def test_multiples_broadcast_against_time():
    multiples = np.array([0.0, 1.0, 15.0])[:, None]
    values = pitch_error.error(TAU, mesh_frequency=OMEGA, amplitude=0.02, multiple=multiples)
    assert values.shape == (3, TAU.size)
    assert np.array_equal(values[0], np.zeros(TAU.size))
