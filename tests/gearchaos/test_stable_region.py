"""The stable region of the Runge-Kutta method of order 4 in the left half plane."""

import numpy as np
import pytest
from gearchaos_kernels.methods.rk4.stability import amplification

from gearchaos.dynamics.stability import steps_per_time


@pytest.mark.parametrize("angle", np.linspace(0.5 * np.pi, np.pi, 46))
def test_a_ray_leaves_the_stable_region_exactly_once(angle):
    direction = np.exp(1j * angle)
    limit = 1.0 / steps_per_time(np.array([direction]))[0]
    # The length of the ray is interpolated; on the imaginary axis 1 - |R| is only rounding near 0.
    assert np.all(amplification(np.linspace(0.0, limit, 4000) * direction) <= 1.0 + 1e-7)
    assert np.all(amplification(np.linspace(limit + 1e-6, 20.0, 40_000) * direction) > 1.0)


def test_the_size_of_r_does_not_rise_steadily_along_the_negative_real_axis():
    sizes = amplification(-np.array([0.0, 1.6, 2.7]) + 0j)
    assert sizes[1] < sizes[2] < sizes[0]


def test_known_rays_and_directions():
    directions = np.array([1j, -1j, -1.0, 1.0, 0.1 + 1j, 0.0])
    wanted = [1.0 / np.sqrt(8.0), 1.0 / np.sqrt(8.0), 1.0 / 2.785293563405282, 0.0, 0.0, 0.0]
    assert steps_per_time(directions) == pytest.approx(wanted, rel=1e-8)


def test_an_undamped_mode_is_recognised_in_spite_of_rounding():
    modes = 100.0j + np.array([-1e-12, 0.0, 1e-12])
    assert steps_per_time(modes) == pytest.approx(np.full(3, 100.0 / np.sqrt(8.0)), rel=1e-8)
