"""The stages of Pan 2021, figure 7, computed with the pair identified from the paper."""

import numpy as np
import pytest

from gearchaos.records.lyapunov import largest_exponent

from .reference import NO_AXIAL, PERIOD, pan2021, run, state

PERIODIC = {5.0: 1, 10.75: 2, 12.97: 3}
CHAOTIC = [12.47, 13.8]
MULTIPLES = [*PERIODIC, *CHAOTIC]
POINTS = 240


@pytest.fixture(scope="module")
def stages() -> dict[float, tuple[np.ndarray, float, float]]:
    """Section points, exponent and standard error of the exponent for each multiple, from rest."""
    # The slowest multiplier is about 0.95 per period, and 0.95^800 is below 1e-17.
    how = {"steps": 200, "transient": 800, "periods": 1200, "points": POINTS, "resolved": True}
    outcome = run(pan2021(MULTIPLES), NO_AXIAL, **how)
    exponent, error = largest_exponent(outcome.growth, np.full(len(MULTIPLES), PERIOD))
    results = zip(outcome.section, exponent, error, strict=True)
    return dict(zip(MULTIPLES, results, strict=True))


@pytest.mark.parametrize("multiple", PERIODIC)
def test_periodic_stage_has_its_number_of_section_points(stages, multiple):
    section, _, _ = stages[multiple]
    number = PERIODIC[multiple]
    assert np.abs(section[number:] - section[:-number]).max() < 1e-9
    for fewer in range(1, number):
        assert np.abs(section[fewer:, 0] - section[:-fewer, 0]).max() > 1e-3


@pytest.mark.parametrize("multiple", PERIODIC)
def test_periodic_stage_has_a_negative_exponent(stages, multiple):
    _, exponent, error = stages[multiple]
    assert exponent < -5e-3
    assert error < 1e-3


@pytest.mark.parametrize("multiple", CHAOTIC)
def test_chaotic_stage_never_repeats(stages, multiple):
    section, _, _ = stages[multiple]
    for period in range(1, 33):
        assert np.abs(section[period:, 0] - section[:-period, 0]).max() > 0.05
    # The section fills bands, not only a few points.
    assert np.unique(np.round(section[:, 0], 3)).size > 100


@pytest.mark.parametrize("multiple", CHAOTIC)
def test_chaotic_stage_has_a_positive_exponent_far_beyond_its_standard_error(stages, multiple):
    _, exponent, error = stages[multiple]
    assert exponent > 5e-3
    assert exponent > 5.0 * error


def test_the_start_decides_between_two_periodic_motions_at_the_hop():
    # Pan 2021 has the jump at 1.12. Here it is at 1.05 from rest and at 1.09 from contact.
    starts = np.stack([state(), state(delta_5=1.1626540685832338)])
    how = {"steps": 200, "transient": 800, "periods": 2, "resolved": True}
    settled = run(pan2021([1.07, 1.07]), NO_AXIAL, starts, **how, points=2)
    assert settled.section[:, 0] == pytest.approx(settled.section[:, 1], rel=0, abs=1e-9)
    assert abs(settled.section[0, 0, 0] - settled.section[1, 0, 0]) > 0.01
