"""Runs with steps beyond the stability limit of RK4."""

import numpy as np
import pytest
from gearchaos_kernels import Status

from .reference import (
    FULL,
    OMEGA,
    TORSION_ONLY,
    pan2021,
    run,
    state,
)
from .test_hard_cases import COS, assert_sound

RK4 = pytest.mark.parametrize("resolved", [False, True], ids=["plain", "resolved"])
"""Flow maps have no stability limit."""


CONSTANT = {"error_amplitude": 0.0, "stiffness_variation_scale": 0.0}


def swinging(radians_a_step: np.ndarray, steps: int = 20, **groups):
    """Return lanes whose oscillation in contact has the given radians per step."""
    frequency = 2.0 * np.pi * np.sqrt(COS) / (steps * radians_a_step)
    return pan2021(5.86, mesh_frequency=frequency, **groups)


@pytest.mark.parametrize("groups", [CONSTANT, {}], ids=["constant", "varying"])
@RK4
def test_a_run_far_beyond_the_stability_limit_diverges_in_a_few_periods(resolved, groups):
    model = swinging(np.linspace(4.5, 15.0, 64), **groups)
    outcome = run(
        model,
        TORSION_ONLY,
        state(delta_5=1.0),
        steps=20,
        transient=0,
        periods=60,
        resolved=resolved,
    )
    assert (outcome.status == Status.DIVERGED).all()
    assert (outcome.diverged_period >= 0).all()
    assert np.isnan(outcome.end_state).all()
    for lane, period in enumerate(outcome.diverged_period):
        assert np.isfinite(outcome.section[lane, :period]).all()
        assert np.isnan(outcome.section[lane, period:]).all()


@RK4
def test_just_beyond_the_limit_lost_contact_bounds_what_the_method_blows_up(resolved):
    # Between 2.83 and 3.3 radians per step the method amplifies in contact, but not apart. The run
    # does not diverge, but its result is wrong: this scene can only settle. No status reports this;
    # the limit is therefore computed before a run.
    below, beyond = (swinging(np.array(turns), **CONSTANT) for turns in ([2.5, 2.7], [3.0, 3.1]))
    how = {"steps": 20, "transient": 500, "periods": 500, "points": 10, "resolved": resolved}
    rest = state(delta_5=1.0)
    settled = run(below, TORSION_ONLY, rest, **how)
    assert_sound(settled)
    held = 0.94518 * COS + below.load[0] / COS
    assert settled.section[:, :, 0] == pytest.approx(held, rel=0, abs=1e-6)
    blown = run(beyond, TORSION_ONLY, rest, **how)
    assert (blown.status == Status.OK).all()
    assert (np.ptp(blown.section[:, :, 0], axis=1) > 0.01).all()


def test_split_steps_can_hold_an_unstable_bearing_which_leaps_across_the_clearance():
    # The gear jumps from flank to flank in every step, so that each step is split into stable
    # parts. Plain steps diverge. Again no status reports this; the number of crossings shows it.
    steps = 50
    stiffness = (2.9 * OMEGA * steps / (2.0 * np.pi)) ** 2
    model = pan2021(5.86, transverse_stiffness_p=stiffness)
    how = {"steps": steps, "transient": 100, "periods": 400, "points": 1}
    assert run(model, FULL, **how).status.tolist() == [Status.DIVERGED]
    held = run(model, FULL, **how, resolved=True)
    assert held.status.tolist() == [Status.OK]
    assert held.crossings[0] > 0.5 * steps * 400
    sound = run(model, FULL, **{**how, "steps": 4 * steps}, resolved=True)
    assert sound.crossings.tolist() == [4 * 400]


@RK4
def test_a_lane_out_of_the_range_of_numbers_within_a_period_stops_as_diverged(resolved):
    # A gap beyond the range of numbers has no time of crossing: no step is split or counted.
    start = np.stack([state(delta_5=value) for value in (1e300, -1e307)])
    outcome = run(swinging(np.full(2, 12.0)), TORSION_ONLY, start, steps=20, resolved=resolved)
    assert outcome.status.tolist() == [Status.DIVERGED] * 2
    assert outcome.diverged_period.tolist() == [0, 0]
    assert outcome.crossings.tolist() == outcome.overflows.tolist() == [0, 0]
    assert outcome.slowest_crossing.tolist() == [np.inf] * 2
