"""Kaplan-Yorke dimension: textbook values, tori, orbits and unknown exponents."""

import numpy as np
import pytest

from gearchaos.engine.computing import compute_block
from gearchaos.engine.kept import dimensions
from gearchaos.records.dimension import kaplan_yorke
from gearchaos.records.label import PERIODIC, QUASI_PERIODIC, UNRESOLVED

from .short_sweeps import unlabelled


def dimension(exponents, errors=None):
    values = np.array([exponents], dtype=float)
    errors = np.zeros_like(values) if errors is None else np.array([errors], dtype=float)
    found, error = kaplan_yorke(values, errors)
    return found[0], error[0]


def test_the_henon_map_has_its_textbook_dimension():
    # Exponents of the Henon map at a = 1.4, b = 0.3, whose sum is ln 0.3 (Russell et al. 1980).
    found, _ = dimension([0.419, np.log(0.3) - 0.419])
    assert found == pytest.approx(1.258, abs=1e-3)


def test_an_orbit_has_dimension_zero_and_a_torus_one():
    assert dimension([-0.01, -0.1]) == (0.0, 0.0)
    found, error = dimension([-1e-5, -0.1, -0.2], [1e-5, 1e-5, 1e-5])
    assert found == pytest.approx(1.0, abs=1e-3)
    assert 0.0 < error < 1e-3


def test_the_error_bounds_the_spread_of_exponents_that_vary_together():
    rng = np.random.default_rng(3)
    exact, spread = np.array([0.05, -0.02, -0.1]), np.array([3e-3, 2e-3, 1e-3])
    shift = rng.normal(size=(2000, 1))
    for drawn in (shift, rng.normal(size=(2000, 3)), -shift * [1.0, -1.0, 1.0]):
        found, _ = kaplan_yorke(exact + drawn * spread, np.broadcast_to(spread, (2000, 3)))
        _, error = dimension(exact, spread)
        assert 0.2 * error < found.std() < 1.02 * error


@pytest.mark.parametrize(
    ("largest", "least"),
    # The exponent is given in standard errors: a certain orbit, an orbit that may be a torus, a
    # torus, and a torus that may be an orbit.
    [(-9.0, 0.0), (-2.5, 0.9), (-0.5, 0.0), (-1.5, 0.9)],
)
def test_the_error_has_the_step_of_a_decision_that_an_error_can_change(largest, least):
    _, error = dimension([largest * 1e-4, -0.1], [1e-4, 1e-4])
    assert least <= error < least + 0.11


@pytest.mark.parametrize("exponents", [[0.1, 0.1], [np.nan, np.nan], [0.1, np.nan], [0.0, 0.0]])
def test_what_the_exponents_do_not_decide_is_unknown(exponents):
    found, error = dimension(exponents)
    assert np.isnan(found) and np.isnan(error)


def test_a_sweep_with_all_exponents_has_the_dimension_of_each_lane():
    sweep = unlabelled("outputs.exponents=true")
    arrays = compute_block(sweep, (0, 3), {})
    found = kaplan_yorke(arrays["lyapunov_exponents"], arrays["lyapunov_exponents_standard_error"])
    np.testing.assert_array_equal(arrays["kaplan_yorke_dimension"], found[0])
    np.testing.assert_array_equal(arrays["kaplan_yorke_dimension_standard_error"], found[1])


def test_labels_decide_on_tori_and_on_what_is_unresolved():
    values = np.array([[-0.001, -0.1]] * 3)
    labels = np.array([PERIODIC, QUASI_PERIODIC, UNRESOLVED])
    found = dimensions(values, np.full((3, 2), 1e-5), labels)
    own, error = found.values()
    np.testing.assert_allclose(own, [0.0, 0.99, np.nan])
    assert error[0] == 0.0 and error[1] > 0.01 and np.isnan(error[2])
