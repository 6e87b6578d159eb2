"""Long runs: energy and phase change exactly as theory predicts for RK4."""

import numpy as np
import pytest
from gearchaos_kernels import Status

from .reference import (
    BASE_HELIX_ANGLE,
    CLEARANCE,
    FULL,
    LINEAR,
    TORSION,
    TORSION_ONLY,
    pan2021,
    run,
    state,
)
from .test_linear import system

COS = np.cos(BASE_HELIX_ANGLE)
UNDAMPED = {
    "load": 0.0,
    "stiffness_variation_scale": 0.0,
    "damping_ratio": 0.0,
    "transverse_damping_p": 0.0,
    "transverse_damping_g": 0.0,
    "axial_damping_p": 0.0,
    "axial_damping_g": 0.0,
}
WAYS = [(LINEAR, False), (FULL, False), (FULL, True)]
NAMED = ["no-backlash", "zero-clearance-plain", "zero-clearance-resolved"]


def after(model, start: np.ndarray, steps: int, periods: int) -> np.ndarray:
    """Return the state of RK4: R(h A)^n with R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24."""
    values, vectors = np.linalg.eig(system(model)[0])
    z = values * 2.0 * np.pi / model.mesh_frequency[0] / steps
    factor = 1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))
    modes = np.linalg.solve(vectors, start.astype(complex))
    return (vectors @ (factor ** (steps * periods) * modes)).real


def energy(model, states: np.ndarray) -> np.ndarray:
    """Return the energy of the pair without axial mesh force; masses are those of eq. 13."""
    ratios = np.array([1.0, *(getattr(model, f"mass_ratio_{gear}")[0] for gear in "pgpg")])
    stiffness = np.array(
        [0.0]
        + [
            getattr(model, f"{way}_stiffness_{gear}")[0]
            for way in ("transverse", "axial")
            for gear in "pg"
        ]
    )
    delta, rate = states[..., 0::2], states[..., 1::2]
    y_1 = delta[..., 0] + delta[..., 1] - delta[..., 2]
    there = delta.shape[-1]
    own = np.sum((rate**2 + stiffness[:there] * delta**2) / ratios[:there], axis=-1)
    return 0.5 * (own + COS * y_1**2)


@pytest.mark.parametrize(("scene", "resolved"), WAYS, ids=NAMED)
@pytest.mark.parametrize("steps", [40, 100])
def test_an_undamped_pair_does_after_ten_thousand_periods_what_the_method_predicts(
    scene, resolved, steps
):
    model = pan2021(0.0, **UNDAMPED, half_backlash=0.0)
    start = state(delta_5=1.0, delta_1_rate=-0.4, delta_2=0.3, delta_3_rate=0.7, delta_4=-0.2)
    periods = 10_000
    outcome = run(
        model,
        scene,
        start,
        steps=steps,
        periods=periods,
        resolved=resolved,
    )
    assert outcome.status.tolist() == [Status.OK]
    assert outcome.crossings.tolist() == [0]
    for number in (1, 100, 1000, periods):
        wanted = after(model, start, steps, number)
        assert outcome.section[0, number - 1] == pytest.approx(wanted, rel=0, abs=1e-8)


@pytest.mark.parametrize(("scene", "resolved"), WAYS, ids=NAMED)
@pytest.mark.parametrize("steps", [40, 288])
def test_energy_without_damping_never_grows_and_falls_as_the_method_predicts(
    scene, resolved, steps
):
    model = pan2021(0.0, **UNDAMPED, half_backlash=0.0)
    start = state(delta_5=1.0)
    outcome = run(model, scene, start, steps=steps, periods=10_000, resolved=resolved)
    # Axial motion does not act back on the other states.
    found = energy(model, outcome.section[0, :, :6])
    assert np.diff(found).max() < 1e-13
    predicted = np.stack([after(model, start, steps, number) for number in (1, 2000, 10_000)])
    wanted = energy(model, predicted[:, :6])
    assert found[[0, 1999, 9999]] == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize("steps", [20, 60])
def test_the_amplitude_of_a_single_oscillator_falls_by_the_sixth_power_of_the_step(steps):
    # |R(ix)|^2 = 1 - x^6/72 + x^8/576.
    scene = CLEARANCE
    model = pan2021(0.0, **UNDAMPED, half_backlash=0.0)
    periods = 10_000
    outcome = run(
        model,
        scene,
        state(delta_5=1.0),
        steps=steps,
        periods=periods,
        resolved=True,
    )
    position, rate = outcome.section[0, :, 0], outcome.section[0, :, 1]
    found = position**2 + rate**2 / COS
    x = 2.0 * np.pi / model.mesh_frequency[0] * np.sqrt(COS) / steps
    wanted = (1.0 - x**6 / 72.0 + x**8 / 576.0) ** (steps * np.arange(1.0, periods + 1.0))
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-300)


def rattling(steps: int, resolved: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return relative energy gains of undamped motions between the flanks, and crossings."""
    speeds = np.linspace(0.5, 2.0, 32)
    starts = np.stack([state(delta_5_rate=speed) for speed in speeds])
    outcome = run(
        pan2021(np.zeros(32), **UNDAMPED),
        TORSION_ONLY,
        starts,
        steps=steps,
        periods=500,
        resolved=resolved,
    )
    position, rate = outcome.section[..., 0], outcome.section[..., 1]
    deflection = np.maximum(np.abs(position) - 0.94518 * COS, 0.0)
    found = 0.5 * (rate**2 + COS * deflection**2)
    return found / (0.5 * speeds[:, np.newaxis] ** 2) - 1.0, outcome.crossings


@pytest.mark.parametrize(("steps", "largest"), [(100, 1e-4), (200, 4e-6), (400, 1.2e-7)])
def test_split_steps_keep_the_energy_of_an_undamped_pair_that_rattles(steps, largest):
    gain, crossings = rattling(steps, resolved=True)
    # In contact the method dissipates with the fifth power of the step; nothing adds energy.
    assert gain.max() < 1e-11
    assert gain.min() > -largest
    assert (crossings > 1000).all()


def test_plain_steps_gain_and_lose_energy_at_every_impact():
    gain, _ = rattling(200, resolved=False)
    assert gain.max() > 1e-5
    assert np.abs(gain).max() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("resolved", [False, True], ids=["plain", "resolved"])
@pytest.mark.parametrize(("steps", "multiple"), [(24, 0.5), (32, 5.86), (101, 5.86)])
def test_a_periodic_motion_stays_where_it_is_for_twenty_thousand_periods(resolved, steps, multiple):
    outcome = run(
        pan2021(multiple),
        TORSION_ONLY,
        steps=steps,
        transient=2000,
        periods=20_000,
        points=20_000,
        resolved=resolved,
    )
    assert outcome.status.tolist() == [Status.OK]
    # The motion drifts neither in place nor in phase: both coordinates keep their digits.
    assert np.ptp(outcome.section, axis=1).max() < 1e-13
    assert np.ptp(outcome.growth[0].reshape(20, 1000).mean(axis=1)) < 1e-2
    if resolved:
        assert outcome.crossings[0] == (40_000 if multiple > 1.0 else 0)


def test_a_hundred_thousand_periods_of_free_oscillation_keep_the_phase_of_the_method():
    model = pan2021(0.0, **UNDAMPED, half_backlash=0.0)
    steps, periods = 200, 100_000
    outcome = run(
        model,
        TORSION,
        state(delta_5=1.0),
        steps=steps,
        periods=periods,
        points=1,
    )
    x = 2.0 * np.pi / model.mesh_frequency[0] * np.sqrt(COS) / steps
    turn = np.angle(1.0 - x**2 / 2.0 + x**4 / 24.0 + 1j * (x - x**3 / 6.0))
    length = (1.0 - x**6 / 72.0 + x**8 / 576.0) ** (0.5 * steps * periods)
    phase = turn * steps * periods
    position, rate = outcome.section[0, 0]
    assert position == pytest.approx(length * np.cos(phase), rel=0, abs=1e-6)
    assert rate == pytest.approx(-length * np.sqrt(COS) * np.sin(phase), rel=0, abs=1e-6)


def test_the_exponent_of_the_full_scene_does_not_depend_on_how_the_run_is_cut():
    model = pan2021([0.5, 5.86])
    whole = run(model, FULL, steps=100, periods=400, resolved=True)
    first = run(model, FULL, steps=100, periods=150, resolved=True)
    second = run(model, FULL, first.end_state, steps=100, periods=250, resolved=True)
    assert second.section == pytest.approx(whole.section[:, 150:], rel=0, abs=1e-9)
    assert (first.crossings + second.crossings).tolist() == whole.crossings.tolist()


def test_what_a_tangent_vector_loses_never_becomes_denormal():
    # Torsion decays faster than axial motion. After 40 000 periods, their ratio is below the range
    # of numbers.
    tangent = run(pan2021(0.5), FULL, steps=40, periods=40_000, points=1, resolved=True).end_tangent
    assert not np.any((tangent != 0.0) & (np.abs(tangent) < 1e-160))
    assert np.linalg.norm(tangent) == pytest.approx(1.0)
    assert tangent[0, 0] == 0.0 != tangent[0, -1]
