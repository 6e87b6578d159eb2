"""Randomly drawn gears just reach one of their two limits, and are the same on every machine."""

import numpy as np
import pytest

from gearchaos.models.gear_pair.tooth_deviations import drawn_gears

GOLDEN = [0.0, -1.543392, -5.151616, -11.991532, -11.366002, -0.366002, 4.104212]
ROUNDING = 2e-6
"""Deviations are rounded to 1e-6 um."""


def singles(cumulative):
    return cumulative - np.roll(cumulative, 1, axis=1)


@pytest.mark.parametrize("teeth", [5, 21, 38, 200])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_both_limits_are_kept_and_one_is_met(teeth, share):
    drawn = drawn_gears(np.arange(50), 3, 0, teeth, 11.0, 30.0, share)
    assert drawn.shape == (50, teeth) and (drawn[:, 0] == 0.0).all()
    single, spread = np.abs(singles(drawn)).max(axis=1) / 11.0, np.ptp(drawn, axis=1) / 30.0
    assert np.maximum(single, spread) == pytest.approx(np.ones(50), abs=ROUNDING)
    assert singles(drawn).sum(axis=1) == pytest.approx(np.zeros(50), abs=1e-9)


def test_an_eccentricity_alone_is_a_sine_of_the_rotation():
    drawn = drawn_gears([0, 1], 3, 0, 40, 100.0, 30.0, 1.0)
    spectrum = np.abs(np.fft.rfft(drawn, axis=1))[:, 1:]
    assert (spectrum[:, 1:] < 1e-4 * spectrum[:, :1]).all()


def test_single_deviations_are_normal_and_independent():
    f = singles(drawn_gears(np.arange(4000), 0, 0, 21, 1e9, 1.0, 0.0))
    f /= f.std(axis=1, keepdims=True)
    # The tolerances are four standard errors, for 84000 numbers, of the mean fourth power and of
    # the mean product of neighbours. As each gear is scaled by its own spread, the fourth power of
    # z teeth is 3 (z - 1) / (z + 1) instead of 3.
    assert np.mean(f**4) == pytest.approx(3.0 * 20 / 22, abs=4 * np.sqrt(96 / f.size))
    assert np.mean(f * np.roll(f, 1, axis=1)) == pytest.approx(-1 / 20, abs=4 / np.sqrt(f.size))


def test_a_gear_depends_on_seed_gear_and_its_number_alone():
    every = drawn_gears(np.arange(10), 5, 1, 21, 11.0, 30.0)
    assert np.array_equal(drawn_gears([7, 2], 5, 1, 21, 11.0, 30.0), every[[7, 2]])
    assert not np.isclose(every, drawn_gears(np.arange(10), 6, 1, 21, 11.0, 30.0))[:, 1:].any()
    assert not np.isclose(every, drawn_gears(np.arange(10), 5, 0, 21, 11.0, 30.0))[:, 1:].any()


def test_other_limits_scale_the_same_gear():
    fine, coarse = drawn_gears([4, 4], 0, 0, 21, [11.0, 22.0], [30.0, 60.0])
    assert coarse == pytest.approx(2.0 * fine, abs=ROUNDING)


def test_the_bits_are_those_of_every_machine():
    drawn = drawn_gears([3], 2021, 0, 7, 11.0, 30.0)
    assert drawn.tolist() == [GOLDEN]
