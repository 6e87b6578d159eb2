"""Pitch errors of single teeth in the linear scene, whose response to any error is known."""

import numpy as np
import pytest
from gearchaos_kernels import Teeth

from .reference import NO_BACKLASH, OMEGA, drawn_teeth, pan2021, run
from .test_linear import one, response, resting_state, system
from .test_order import measured_order

# With this damping, a transient decays within a few dozen periods.
MODEL = pan2021(
    5.86,
    error_mean=0.1,
    damping_ratio=0.1,
    stiffness_variation_scale=0.0,
    transverse_damping_p=0.5,
    transverse_damping_g=0.5,
    axial_damping_p=0.5,
    axial_damping_g=0.5,
)
AMPLITUDE = float(MODEL.error_amplitude[0])
SHARED = drawn_teeth(1, 1)
TRANSIENT = 60


def teeth_with(driving, driven) -> Teeth:
    """Return teeth with helical shares and the errors of one profile."""
    return SHARED._replace(driving=np.array([driving], float), driven=np.array([driven], float))


def share_wave(order: np.ndarray) -> np.ndarray:
    """Return the integral of one pair's share times exp(-2 pi i order phase) over the phase."""
    angle = 2.0 * np.pi * order / SHARED.cells_per_period
    cells = np.exp(-1.0j * np.outer(angle, np.arange(SHARED.share.size))) @ SHARED.share
    # A spline of degree 5 is a rectangle of one cell, convolved with itself five times.
    spline = (np.exp(-0.5j * angle) * np.sinc(angle / (2.0 * np.pi))) ** 6
    return np.exp(-2.0j * np.pi * order * SHARED.begins) * cells * spline / SHARED.cells_per_period


def error_lines(teeth: Teeth, repeats: int, orders: np.ndarray) -> np.ndarray:
    """Return Fourier coefficients of the shared error at the given mesh orders."""
    pairs = np.arange(repeats)
    errors = teeth.driven[0][pairs % teeth.driven.size]
    errors = errors - teeth.driving[0][pairs % teeth.driving.size]
    return np.exp(-2.0j * np.pi * np.outer(orders, pairs)) @ errors / repeats * share_wave(orders)


def response_to_teeth(physical: bool, frequency: float) -> np.ndarray:
    """Return the phasor of the states for an error of the teeth of amplitude 1."""
    if not physical:
        return response(MODEL, physical, frequency)
    # If delta_5 is measured from rest, the error acts on the mesh springs but not on the dampers.
    matrix, row_y, row_z = system(MODEL)
    springs = -row_y - np.tan(one(MODEL, "base_helix_angle")) * row_z
    moved = np.linalg.solve(1.0j * frequency * np.eye(10) - matrix, springs)
    # Measure delta_5 from the error.
    moved[:2] -= 1.0, 1.0j * frequency
    return moved


def resting(physical: bool) -> np.ndarray:
    """Return the static state under the load and the mean of the errors."""
    loaded = resting_state(MODEL._replace(error_mean=np.zeros(1)), physical)
    return loaded + one(MODEL, "error_mean") * response_to_teeth(physical, 0.0).real


def measured_lines(teeth: Teeth, repeats: int, steps: int, physical: bool = False) -> np.ndarray:
    """Return the Fourier coefficients of the states over ``repeats`` mesh periods."""
    outcome = run(
        MODEL,
        NO_BACKLASH,
        steps=steps,
        transient=TRANSIENT + -TRANSIENT % repeats,
        periods=repeats,
        points=1,
        physical=physical,
        teeth=teeth,
        history=repeats,
    )
    return np.fft.rfft(outcome.history[0, :-1], axis=0) / (repeats * steps)


@pytest.mark.parametrize("physical", [False, True])
@pytest.mark.parametrize(
    ("driving", "driven", "every"),
    [(np.zeros(4), np.eye(6)[0], 2), (np.eye(4)[1], np.zeros(6), 3)],
    ids=["driven", "driving"],
)
def test_one_wrong_tooth_gives_the_comb_of_its_gear(driving, driven, every, physical):
    repeats = 12
    teeth = teeth_with(driving, driven)
    found = measured_lines(teeth, repeats, 1600, physical)
    orders = np.arange(20 * repeats) / repeats
    wanted = np.stack([response_to_teeth(physical, OMEGA * order) for order in orders])
    wanted *= AMPLITUDE * error_lines(teeth, repeats, orders)[:, np.newaxis]
    wanted[0] += resting(physical)
    largest = np.abs(wanted[1:, 0]).max()
    assert found[: orders.size] == pytest.approx(wanted, rel=0, abs=1e-9 * largest)
    # Only whole orders of the gear occur. Mesh orders are absent, because the shares add up to one.
    number = np.arange(1, orders.size)
    comb = (number % every == 0) & (number % repeats != 0)
    assert np.abs(found[number[~comb]]).max() < 1e-12 * largest
    assert np.abs(wanted[number[comb], 0])[: repeats // every].min() > 1e-4 * largest


def test_a_sine_over_the_teeth_of_a_gear_tends_to_the_sine_of_its_shaft_order():
    # The shares smooth the sine like a weight over the phase with this mean and variance.
    weight = SHARED.share / SHARED.cells_per_period
    phase = SHARED.begins + (np.arange(weight.size) + 3.0) / SHARED.cells_per_period
    delay = np.sum(weight * phase)
    variance = np.sum(weight * (phase - delay) ** 2) + 0.5 / SHARED.cells_per_period**2
    numbers = np.array([16, 32, 64, 128])
    smoothed, remaining = [], []
    for teeth in numbers:
        sine = teeth_with([0.0], np.sin(2.0 * np.pi * np.arange(teeth) / teeth))
        lines = measured_lines(sine, int(teeth), 200)[:, 0]
        assert lines[0] == pytest.approx(resting_state(MODEL, False)[0], rel=0, abs=1e-9)
        wave = AMPLITUDE * response(MODEL, False, OMEGA / teeth)[0]
        wanted = -0.5j * wave * np.exp(-2.0j * np.pi * delay / teeth)
        smoothed.append(abs(lines[1] / wanted - 1.0))
        lines[:2] = 0.0
        remaining.append(np.abs(np.fft.irfft(lines)).max() * lines.size / abs(wanted))
    assert smoothed[-1] == pytest.approx(2.0 * (np.pi / numbers[-1]) ** 2 * variance, rel=1e-3)
    assert measured_order(smoothed, numbers) > 1.95
    # The sine has a step from tooth to tooth; these steps have orders near the mesh orders.
    assert measured_order(remaining, numbers) > 0.95
