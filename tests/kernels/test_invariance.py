"""Scaling and symmetry of piecewise-linear systems, bit for bit."""

import numpy as np
import pytest

from .reference import FULL, pan2021, run, state

LENGTHS = ("load", "half_backlash", "error_mean", "error_amplitude")
MODEL = pan2021([0.5, 5.86, 12.47, 14.2], error_mean=0.05)
START = np.tile(state(delta_5=1.0, delta_1_rate=0.1, delta_3=0.02), (4, 1))
HOW = {"steps": 144, "transient": 5, "periods": 20}


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "resolved"])
def how(request):
    """Plain steps or resolved steps."""
    return {**HOW, "resolved": request.param}


@pytest.fixture(scope="module")
def scaled(how):
    """Return a function that integrates with all lengths of the model multiplied by a factor."""

    def integrate(factor: float, start_factor: float | None = None):
        lengths = {name: factor * getattr(MODEL, name) for name in LENGTHS}
        start = START * (factor if start_factor is None else start_factor)
        return run(MODEL._replace(**lengths), FULL, start, **how)

    return integrate


@pytest.fixture(scope="module")
def original(scaled):
    return scaled(1.0)


@pytest.mark.parametrize("power", [-40, -1, 3, 60])
def test_scaling_all_lengths_by_a_power_of_two_scales_every_bit(scaled, original, power):
    outcome = scaled(2.0**power)
    assert np.array_equal(outcome.section, 2.0**power * original.section)
    assert np.array_equal(outcome.end_state, 2.0**power * original.end_state)
    assert np.array_equal(outcome.growth, original.growth)
    assert np.array_equal(outcome.crossings, original.crossings)
    assert np.array_equal(outcome.slowest_crossing, 2.0**power * original.slowest_crossing)


def test_scaling_all_lengths_by_ten_scales_the_motion_to_rounding(scaled, original):
    outcome = scaled(10.0)
    # Rounding errors grow along the chaotic lane, by e^(0.1 tau) at most.
    assert outcome.section[:, :5] == pytest.approx(10.0 * original.section[:, :5], abs=1e-10)
    regular = slice(0, 2)
    assert outcome.section[regular] == pytest.approx(10.0 * original.section[regular], abs=1e-10)


@pytest.mark.parametrize("left_out", LENGTHS)
def test_scaling_all_lengths_but_one_changes_the_motion(how, original, left_out):
    lengths = {name: 8.0 * getattr(MODEL, name) for name in LENGTHS if name != left_out}
    outcome = run(MODEL._replace(**lengths), FULL, 8.0 * START, **how)
    assert not np.allclose(outcome.section, 8.0 * original.section, rtol=1e-3)


def test_scaling_the_model_but_not_the_start_changes_the_motion(scaled, original):
    outcome = scaled(8.0, start_factor=1.0)
    assert not np.allclose(outcome.section, 8.0 * original.section, rtol=1e-3)


def test_turning_state_load_and_error_around_turns_the_motion_around(how, original):
    turned = {name: -getattr(MODEL, name) for name in LENGTHS if name != "half_backlash"}
    outcome = run(MODEL._replace(**turned), FULL, -START, **how)
    assert np.array_equal(outcome.section, -original.section)
    assert np.array_equal(outcome.growth, original.growth)


def test_a_full_turn_of_phase_changes_nothing():
    how = {**HOW, "resolved": True}
    one = run(MODEL._replace(error_phase=np.full(4, 0.5)), FULL, START, **how)
    other = run(MODEL._replace(error_phase=np.full(4, 0.5 + 2.0 * np.pi)), FULL, START, **how)
    assert other.section[:2] == pytest.approx(one.section[:2], abs=1e-9)


def test_half_of_every_frequency_is_the_same_motion_at_half_the_rates(how):
    # The mesh stiffness defines the unit of time, so the mesh must transmit no force here.
    nothing = np.zeros(4)
    free = MODEL._replace(half_backlash=np.full(4, 1e9), damping_ratio=nothing, load=nothing)
    slower = {
        f"{way}_{what}_{gear}": getattr(free, f"{way}_{what}_{gear}") / by
        for way in ("transverse", "axial")
        for what, by in (("stiffness", 4.0), ("damping", 2.0))
        for gear in "pg"
    }
    slow = free._replace(mesh_frequency=free.mesh_frequency / 2.0, **slower)
    one = run(free, FULL, START, **how)
    other = run(slow, FULL, START * np.tile([1.0, 0.5], 5), **how)
    assert np.array_equal(other.section, one.section * np.tile([1.0, 0.5], 5))
