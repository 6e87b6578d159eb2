"""The error of a lane is its change with half the step; it is reported for checked lanes only."""

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.error_check import (
    CHANGE_MEANINGS,
    CHANGED,
    CHECKED,
    NOT_CHECKED,
    SAME,
    Tally,
    checked_lanes,
)

from .short_sweeps import METHODS, assert_same, computed, simulation

LONG = (
    "integration.transient_periods=300",
    "integration.recorded_periods=60",
    "outputs.section_points=48",
    "integration.steps_per_period=50",
)


@pytest.mark.parametrize(
    ("share", "count"), [(0.0, 0), (0.1, 10), (0.25, 25), (1 / 3, 33), (1.0, 100)]
)
def test_the_share_of_lanes_is_checked_spread_evenly(share, count):
    checked = checked_lanes(np.arange(100), share)
    assert checked.size == count
    if count > 1:
        assert np.ptp(np.diff(checked)) <= 1


def test_which_lanes_are_checked_does_not_depend_on_blocks():
    numbers = np.arange(100)
    blocks = [first + checked_lanes(numbers[first : first + 7], 0.3) for first in range(0, 100, 7)]
    assert np.array_equal(np.concatenate(blocks), checked_lanes(numbers, 0.3))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("carry", ["none", "upwards", "downwards"])
def test_the_check_does_not_depend_on_the_size_of_blocks(carry, method):
    how = f"start.carry={carry}", f"integration.method={method}"
    sweep = simulation("integration.error_check=0.5", *how)
    assert_same(computed(sweep, 4), computed(sweep))


def test_the_error_is_the_difference_to_half_the_step():
    coarse = computed(simulation(*LONG, "integration.error_check=1.0"))
    fine = computed(simulation(*LONG[:-1], "integration.steps_per_period=100"))
    periodic = np.isfinite(coarse["section_error"]) & (coarse["motion_changed"] == SAME)
    assert periodic.sum() > 5
    distance = np.abs(coarse["section_delta_5"] - fine["section_delta_5"]).max(axis=1)
    single = periodic & (np.ptp(fine["section_delta_5"], axis=1) < 1e-6)
    assert single.any()
    assert np.allclose(coarse["section_error"][single], distance[single], rtol=0.1, atol=1e-7)
    exponents = np.abs(coarse["lyapunov_exponent"] - fine["lyapunov_exponent"])
    assert np.array_equal(coarse["exponent_step_error"], exponents)


def test_flow_maps_of_half_the_step_differ_by_rounding():
    # A chaotic transient, as beyond 10.0, may leave an error in a lane that ends on an orbit.
    calm = ("sweep.to=10.0", "integration.error_check=1.0", "integration.method=flow_map")
    exact = computed(simulation(*LONG, *calm))
    assert (exact["motion_changed"] == SAME).all()
    # The limit allows a thousand roundings in each recent step; earlier errors have decayed.
    assert np.nanmax(exact["section_error"]) < 1e-11
    assert np.nanmax(exact["exponent_step_error"]) < 1e-11


def test_the_check_looks_at_what_the_labels_know_and_not_at_what_the_file_keeps():
    few = computed(simulation(*LONG, "integration.error_check=1.0", "outputs.section_points=2"))
    many = computed(simulation(*LONG, "integration.error_check=1.0"))
    for name in CHECKED:
        assert np.array_equal(few[name], many[name], equal_nan=True)
    assert np.isfinite(few["section_error"]).sum() > 5


def test_lanes_that_were_not_checked_say_so():
    arrays = computed(simulation("integration.error_check=0.5"))
    unchecked = arrays["motion_changed"] == NOT_CHECKED
    assert 0 < unchecked.sum() < unchecked.size
    assert np.isnan(arrays["section_error"][unchecked]).all()
    assert np.isnan(arrays["exponent_step_error"][unchecked]).all()


def test_a_sweep_without_check_has_no_trace_of_it():
    assert not {"section_error", "motion_changed"} & computed(simulation()).keys()


def test_the_summary_counts_what_was_measured():
    tally = Tally()
    tally.add({"status": np.array([0, 1])})
    assert (tally.diverged, tally.errors) == (1, "")
    tally.add(
        {
            "status": np.zeros(4),
            "section_error": np.array([1e-6, 3e-6, np.nan, np.nan]),
            "exponent_step_error": np.array([1e-7, 1e-7, 0.1, np.nan]),
            "motion_changed": np.array([SAME, SAME, CHANGED, NOT_CHECKED], dtype=np.uint8),
        }
    )
    assert tally.errors == (
        "3 lanes computed again with half the step: section of 2 periodic ones off by "
        "2.0e-06 (median) to 3.0e-06, their exponent by 1.0e-07 (median) to 1.0e-07; "
        "1 settle on a different motion"
    )


def test_the_file_reports_the_errors_and_what_they_mean(tmp_path):
    config = simulation("integration.error_check=0.5").config
    gearchaos.run(config).save(tmp_path / "checked.h5")
    result = gearchaos.open_result(tmp_path / "checked.h5")
    assert result.attributes("motion_changed")["flag_meanings"].split() == list(CHANGE_MEANINGS)
    assert result.metadata["error_check"] == 0.5
