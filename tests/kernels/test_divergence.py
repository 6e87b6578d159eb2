"""A lane that leaves the range of numbers is flagged and does not affect other lanes."""

import numpy as np
import pytest
from gearchaos_kernels import LANES, STATUS_TEXTS, Status

from .reference import (
    FULL,
    TORSION_ONLY,
    assert_same_bits,
    lanes_of,
    lanes_out_of,
    pan2021,
    run,
    state,
)

STEPS = 50
HOW = {"steps": STEPS, "transient": 3, "periods": 12, "points": 10}
SICK = 5
REST = np.zeros((LANES, 10))


@pytest.fixture(params=[False, True], ids=["plain", "resolved"])
def how(request):
    """Plain steps or resolved steps."""
    return {**HOW, "resolved": request.param}


def healthy():
    return pan2021(np.linspace(0.0, 12.0, LANES))


def assert_only_one_lane_diverged(outcome, model, start, how):
    """Compare all other lanes with a run without the diverging lane."""
    assert np.flatnonzero(outcome.status == Status.DIVERGED).tolist() == [SICK]
    others = np.delete(np.arange(LANES), SICK)
    assert (outcome.diverged_period[others] == -1).all()
    for kept in (outcome.section, outcome.growth, outcome.end_state):
        assert np.isfinite(kept[others]).all()
    without = run(lanes_of(model, others), FULL, start[others], **how)
    assert_same_bits(lanes_out_of(outcome, others), without)


def assert_nan_from(outcome, period):
    """Check that the outputs of the diverging lane are NaN from ``period`` on."""
    assert outcome.diverged_period[SICK] == period
    assert np.isnan(outcome.end_state[SICK]).all()
    first_point = HOW["transient"] + HOW["periods"] - HOW["points"]
    for array, first in ((outcome.section, first_point), (outcome.growth, HOW["transient"])):
        kept = max(period - first, 0)
        assert np.isfinite(array[SICK, :kept]).all()
        assert np.isnan(array[SICK, kept:]).all()


def test_a_step_too_long_for_stiff_bearings_diverges_and_leaves_its_neighbours_untouched(how):
    model = healthy()
    step = 2.0 * np.pi / model.mesh_frequency[SICK] / STEPS
    # RK4 is stable for an oscillator up to h omega = 2.8. If a gear jumps across the clearance in
    # every step, each step is split into parts. They are stable up to twice this value or more.
    model.transverse_stiffness_p[SICK] = ((8.0 if how["resolved"] else 3.2) / step) ** 2
    outcome = run(model, FULL, **how)
    assert_only_one_lane_diverged(outcome, model, REST, how)
    assert_nan_from(outcome, outcome.diverged_period[SICK])


def test_a_lane_that_grows_slowly_is_kept_until_the_period_in_which_it_diverges(how):
    model = healthy()
    model.transverse_damping_g[SICK] = -2.5
    outcome = run(model, FULL, **how)
    assert_only_one_lane_diverged(outcome, model, REST, how)
    assert HOW["transient"] + 2 < outcome.diverged_period[SICK]
    assert_nan_from(outcome, outcome.diverged_period[SICK])


@pytest.mark.parametrize("value", [1e300, -1e300, np.inf, np.nan])
@pytest.mark.parametrize("name", ["delta_5", "delta_2_rate", "delta_4"])
def test_a_start_out_of_range_diverges_in_the_first_period(name, value, how):
    start = REST.copy()
    start[SICK] = state(**{name: value})
    model = healthy()
    outcome = run(model, FULL, start, **how)
    assert_only_one_lane_diverged(outcome, model, start, how)
    assert_nan_from(outcome, 0)


def test_a_group_that_is_not_a_number_diverges_in_the_first_period(how):
    model = healthy()
    model.load[SICK] = np.nan
    outcome = run(model, FULL, **how)
    assert_only_one_lane_diverged(outcome, model, REST, how)
    assert_nan_from(outcome, 0)


def test_a_large_state_within_range_is_no_divergence(how):
    start = state(delta_5=1e60)
    outcome = run(pan2021(1.0), FULL, start, **how)
    assert outcome.status.tolist() == [Status.OK]
    assert np.isfinite(outcome.section).all()


def test_a_state_out_of_range_that_the_scene_leaves_out_is_nothing(how):
    start = state(delta_5=1.0, delta_2=np.nan, delta_4_rate=1e300)
    outcome = run(pan2021(1.0), TORSION_ONLY, start, **how)
    assert outcome.status.tolist() == [Status.OK]
    assert np.isfinite(outcome.end_state).all()


def test_all_lanes_may_diverge(how):
    model = pan2021(np.ones(LANES + 3), transverse_stiffness_p=1e6)
    outcome = run(model, FULL, **how)
    assert (outcome.status == Status.DIVERGED).all()
    assert np.isnan(outcome.end_state).all()


def test_a_growth_beyond_all_numbers_is_not_reported_as_a_sound_lane():
    # At rest without load nothing moves, but these steps are unstable: the tangent vector diverges.
    model = pan2021(0.0, load=0.0, transverse_stiffness_p=1e12)
    how = {"steps": 100, "periods": 5, "resolved": True}
    outcome = run(model, FULL, **how)
    assert not run(model, FULL, **how, tangent=False).end_state.any()
    assert outcome.status.tolist() == [Status.DIVERGED]


def test_every_status_has_its_text():
    assert set(STATUS_TEXTS) == set(Status)
    assert all(STATUS_TEXTS.values())
