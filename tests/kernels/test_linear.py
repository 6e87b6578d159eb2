"""The linear scene, whose motions and exponents are known in closed form."""

import numpy as np
import pytest
from gearchaos_kernels import Groups

from gearchaos.records.lyapunov import largest_exponent

from .reference import (
    BASE_HELIX_ANGLE,
    CLEARANCE,
    LINEAR,
    NO_BACKLASH,
    PERIOD,
    TORSION,
    pan2021,
    run,
    state,
)

MODEL = pan2021(5.86, error_mean=0.1, error_phase=0.4, stiffness_variation_scale=0.0)
TORQUE = state(delta_5_rate=1.0)
"""Accelerations by a unit load."""


def one(model: Groups, name: str) -> float:
    return float(getattr(model, name)[0])


def system(model: Groups) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A and the columns B_y, B_z of x' = A x + B_y n_y + B_z n_z + load.

    x contains the states in the order of `STATES`; n_y and n_z are the parts of the mesh forces of
    eq. 13 that the pitch error adds.
    """
    beta = one(model, "base_helix_angle")
    mu_p, mu_g = one(model, "mass_ratio_p"), one(model, "mass_ratio_g")
    y_1 = np.array([1.0, 1.0, -1.0, 0.0, 0.0])
    y_2 = np.array([0.0, 0.0, 0.0, 1.0, -1.0]) - np.tan(beta) * y_1
    row_y = np.cos(beta) * np.array([-1.0, -mu_p, mu_g, 0.0, 0.0])
    row_z = np.sin(beta) * np.array([0.0, 0.0, 0.0, -mu_p, mu_g])
    mesh = np.outer(row_y, y_1) + np.outer(row_z, y_2)
    bearings = [f"{way}_{{}}_{gear}" for way in ("transverse", "axial") for gear in "pg"]
    stiffness = np.diag([0.0] + [one(model, name.format("stiffness")) for name in bearings])
    damping = np.diag([0.0] + [one(model, name.format("damping")) for name in bearings])
    lower = [mesh - stiffness, 2.0 * one(model, "damping_ratio") * mesh - 2.0 * damping]
    matrix = np.zeros((10, 10))
    matrix[0::2, 1::2] = np.eye(5)
    matrix[1::2, 0::2], matrix[1::2, 1::2] = lower
    return matrix, np.kron(row_y, [0.0, 1.0]), np.kron(row_z, [0.0, 1.0])


def response(model: Groups, physical: bool, frequency: float) -> np.ndarray:
    """Return the phasor of the states for a pitch error of amplitude 1 at one frequency."""
    matrix, row_y, row_z = system(model)
    beta = one(model, "base_helix_angle")
    if physical:
        in_y, in_z = 1.0 - np.cos(beta), -np.tan(beta) - np.sin(beta)
    else:
        in_y, in_z = -np.cos(beta), -np.sin(beta)
    damped = 1.0 + 2.0j * one(model, "damping_ratio") * frequency
    force = damped * (in_y * row_y + in_z * row_z) + frequency**2 * TORQUE
    return np.linalg.solve(1.0j * frequency * np.eye(10) - matrix, force)


def resting_state(model: Groups, physical: bool) -> np.ndarray:
    """Return the static state under the load and the mean of the pitch error."""
    loaded = -np.linalg.solve(system(model)[0], one(model, "load") * TORQUE)
    return loaded + one(model, "error_mean") * response(model, physical, 0.0).real


def steady_state(model: Groups, physical: bool) -> np.ndarray:
    """Return the periodic response at tau = 0: a constant and one harmonic."""
    wave = response(model, physical, one(model, "mesh_frequency"))
    # e is the imaginary part of amplitude exp(i (Omega tau + phi)).
    phasor = one(model, "error_amplitude") * np.exp(1.0j * one(model, "error_phase"))
    return resting_state(model, physical) + np.imag(phasor * wave)


def exponent_of(model: Groups, scene, start=None, **how) -> float:
    period = 2.0 * np.pi / model.mesh_frequency
    outcome = run(model, scene, start, points=1, **how)
    return float(largest_exponent(outcome.growth, period)[0][0])


@pytest.mark.parametrize("physical", [False, True])
def test_motion_from_rest_settles_on_the_analytic_response(physical):
    outcome = run(
        MODEL, NO_BACKLASH, steps=400, transient=600, periods=1, points=1, physical=physical
    )
    wanted = steady_state(MODEL, physical)
    assert np.abs(wanted).max() > 0.3
    assert outcome.section[0, 0] == pytest.approx(wanted, rel=0, abs=1e-8)


@pytest.mark.parametrize("physical", [False, True])
def test_analytic_response_repeats_every_period(physical):
    wanted = steady_state(MODEL, physical)
    outcome = run(MODEL, NO_BACKLASH, wanted, steps=1600, periods=5, physical=physical)
    assert outcome.section[0] == pytest.approx(np.tile(wanted, (5, 1)), rel=0, abs=1e-10)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"damping_ratio": 0.3},
        {"transverse_damping_p": 1.5, "axial_damping_p": 1.5, "damping_ratio": 0.1},
        {"mass_ratio_g": 0.9, "transverse_stiffness_g": 3.0, "base_helix_angle": 0.5},
        {"transverse_damping_g": -0.05},
    ],
)
def test_exponent_of_linear_scene_is_largest_real_part_of_eigenvalues(changes):
    # Without load and error the state stays at rest, even in an unstable scene.
    model = pan2021(0.0, load=0.0, **changes)
    largest = np.max(np.linalg.eigvals(system(model)[0]).real)
    found = exponent_of(model, LINEAR, steps=200, transient=1200, periods=600)
    assert found == pytest.approx(largest, rel=0, abs=1e-6)


def test_exponent_of_a_stable_focus_is_its_decay_rate_and_not_zero():
    model = pan2021(0.0, damping_ratio=0.05)
    found = exponent_of(model, TORSION, steps=200, transient=100, periods=1000)
    assert found == pytest.approx(-0.05 * np.cos(BASE_HELIX_ANGLE), rel=0, abs=1e-8)


def test_exponent_of_a_node_is_its_slow_decay_rate():
    cosine = np.cos(BASE_HELIX_ANGLE)
    slow, _ = sorted(np.roots([1.0, 2.0 * 2.0 * cosine, cosine]).real)[::-1]
    model = pan2021(0.0, damping_ratio=2.0)
    found = exponent_of(model, TORSION, steps=200, transient=20, periods=100)
    assert found == pytest.approx(slow, rel=1e-6)


def test_exponent_without_any_damping_is_zero():
    model = pan2021(0.0, damping_ratio=0.0)
    found = exponent_of(model, TORSION, steps=400, transient=100, periods=1000)
    assert abs(found) < 1e-8


def test_exponent_with_negative_damping_is_positive():
    model = pan2021(0.0, damping_ratio=-0.02)
    found = exponent_of(model, TORSION, steps=200, transient=100, periods=1000)
    assert found == pytest.approx(0.02 * np.cos(BASE_HELIX_ANGLE), rel=0, abs=1e-8)


def test_exponent_inside_the_clearance_is_that_of_the_mesh_damping_alone():
    # Without load and far from both flanks only 2 xi y' acts: the position does not decay.
    model = pan2021(0.0, load=0.0, half_backlash=1e6)
    start = state(delta_5=0.3)
    how = {"steps": 100, "transient": 100, "periods": 200, "resolved": True}
    found = exponent_of(model, CLEARANCE, start, **how)
    assert abs(found) < 1e-12


def test_free_oscillation_keeps_its_frequency_and_decay():
    model = pan2021(0.0, load=0.0, damping_ratio=0.05)
    outcome = run(model, TORSION, state(delta_5=1.0), steps=800, periods=10)
    cosine = np.cos(BASE_HELIX_ANGLE)
    decay = 0.05 * cosine
    frequency = np.sqrt(cosine - decay**2)
    tau = PERIOD * np.arange(1, 11)
    wanted = np.exp(-decay * tau) * (
        np.cos(frequency * tau) + decay / frequency * np.sin(frequency * tau)
    )
    assert outcome.section[0, :, 0] == pytest.approx(wanted, rel=0, abs=1e-9)
