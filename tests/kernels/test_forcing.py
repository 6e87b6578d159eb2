"""Forcing of a lane, on the grid of half steps and between its points, against trigonometry."""

import math

import numpy as np
import pytest
from gearchaos_kernels.models.gear_pair import forcing
from gearchaos_kernels.models.gear_pair.coefficients import Lane
from gearchaos_kernels.models.gear_pair.forcing import phase_table

from .reference import from_python
from .scenes import scene_with

forcing_at = from_python(forcing.forcing_at)
phase_on_grid = from_python(forcing.phase_on_grid)
phase_within = from_python(forcing.phase_within)

ROUNDING = 1e-14
FEW_STEPS = [1, 2, 3, 4, 8, 9, 12, 16]
STEPS = [*FEW_STEPS, 31, 100, 288, 1600, 20_000]
FRACTIONS = np.concatenate([[0.0, 0.25, 0.5, 0.75, 1.0], np.linspace(0.0, 1.0, 37)[1:-1]])


def series(harmonics: int) -> list[tuple[float, ...]]:
    """Return coefficients that decay as slowly as those of a wave with jumps."""
    rng = np.random.default_rng(harmonics)
    order = np.arange(1, harmonics + 1)
    return [tuple(rng.uniform(-1.0, 1.0, harmonics) / order) for _ in range(2)]


def variation(cosine, sine, angle) -> float:
    """eq. 19, as printed."""
    order = np.arange(1, len(cosine) + 1)
    return math.fsum(cosine * np.cos(order * angle) + sine * np.sin(order * angle))


def some_steps(steps: int) -> list[int]:
    return sorted({0, 1 % steps, steps // 3, steps // 2, max(steps - 2, 0), steps - 1})


@pytest.mark.parametrize("harmonics", [0, 1, 6, 13, 30, 200])
@pytest.mark.parametrize("steps", STEPS)
def test_the_mesh_phase_within_a_step_is_that_of_the_trigonometric_functions(steps, harmonics):
    cosine, sine = series(harmonics)
    table = phase_table(cosine, sine, steps)
    # The rounding error of the phase angle, up to 2 pi, is multiplied by the order of a harmonic.
    size = 1.0 + np.sum(np.arange(1, harmonics + 1) * np.hypot(cosine, sine))
    for number in some_steps(steps):
        for fraction in FRACTIONS:
            angle = 2.0 * math.pi * (number + fraction) / steps
            point = phase_within(table, number, fraction)
            assert abs(point.variation - variation(cosine, sine, angle)) < ROUNDING * size
            assert abs(point.value - math.sin(angle)) < ROUNDING
            assert abs(point.slope - math.cos(angle)) < ROUNDING


@pytest.mark.parametrize("steps", STEPS)
def test_on_the_grid_the_phase_within_a_step_is_the_row_of_the_table(steps):
    table = phase_table(*series(6), steps)
    for number in some_steps(steps):
        for half in range(3):
            within = phase_within(table, number, 0.5 * half)
            assert within == phase_on_grid(table, 2 * number + half)


def test_the_last_row_is_the_first_bit_for_bit():
    table = phase_table(*series(6), 77)
    assert np.array_equal(table[0], table[-1])
    assert table.shape[0] == 2 * 77 + 1


ALL, NOTHING = scene_with(True), scene_with(None)
EVERYTHING = scene_with(True, undamped=None)
"""Scene with the sine of eq. 14; errors of teeth (``undamped``) do not drive delta_5."""


def lane(**values: float) -> Lane:
    return Lane(*[0.0] * len(Lane._fields))._replace(**values)


@pytest.mark.parametrize("phi", [0.0, 0.7, -2.9])
@pytest.mark.parametrize("fraction", [0.0, 0.31, 0.5, 1.0])
def test_load_and_pitch_error_follow_the_shifted_phase(fraction, phi):
    steps, number = 40, 7
    table = phase_table(*series(6), steps)
    angle = 2.0 * math.pi * (number + fraction) / steps
    groups = lane(
        mean_stiffness=0.9,
        stiffness_variation=0.6,
        load=0.3,
        error_inertia=0.7,
        error_mean=0.05,
        error_amplitude=1.3,
        error_rate=0.2,
        axial_error_mean=0.4,
        axial_error_amplitude=2.6,
        axial_error_rate=0.5,
        cos_phase=math.cos(phi),
        sin_phase=math.sin(phi),
    )
    found = forcing_at(groups, phase_within(table, number, fraction), EVERYTHING)
    wave, slope = math.sin(angle + phi), math.cos(angle + phi)
    wanted = (
        0.9 + 0.6 * variation(*series(6), angle),
        0.3 + 0.7 * wave,
        0.05 + 1.3 * wave,
        0.2 * slope,
        0.4 + 2.6 * wave,
        0.5 * slope,
    )
    assert found == pytest.approx(wanted, rel=0, abs=10.0 * ROUNDING)


def test_an_error_of_teeth_drives_the_springs_and_not_the_load():
    groups = lane(load=0.3, error_inertia=0.7, error_mean=0.05, error_amplitude=1.3, cos_phase=1.0)
    point = phase_within(phase_table(*series(6), 40), 3, 0.3)
    found = forcing_at(groups, point, ALL)
    assert found.drive == 0.3
    assert found.error == pytest.approx(0.05 + 1.3 * point.value, abs=ROUNDING)


def test_what_a_scene_leaves_out_is_zero_or_constant():
    groups = lane(
        mean_stiffness=0.9,
        stiffness_variation=0.6,
        load=0.3,
        error_inertia=0.7,
        error_mean=0.05,
        error_amplitude=1.3,
        axial_error_amplitude=2.6,
        cos_phase=1.0,
    )
    point = phase_within(phase_table(*series(6), 40), 3, 0.3)
    assert tuple(forcing_at(groups, point, NOTHING)) == (0.9, 0.3, 0.0, 0.0, 0, 0)
    without_axial = forcing_at(
        groups, point, scene_with(True, undamped=None, phase=None, axial=None)
    )
    assert without_axial.axial_error == without_axial.axial_error_rate == 0.0
    assert without_axial.error == pytest.approx(0.05 + 1.3 * point.value, abs=ROUNDING)
