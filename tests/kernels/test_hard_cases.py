"""Clearances, contacts and loads that are hard cases for an integrator."""

import numpy as np
import pytest
from gearchaos_kernels import Status

from .reference import (
    BASE_HELIX_ANGLE,
    FLOW_MAP,
    FULL,
    NO_BACKLASH,
    OMEGA,
    TORSION_ONLY,
    pan2021,
    run,
    state,
)
from .test_order import measured_order

COS = np.cos(BASE_HELIX_ANGLE)

BOTH = pytest.mark.parametrize(
    "resolved",
    [False, True, pytest.param(FLOW_MAP, marks=pytest.mark.slow)],
    ids=["plain", "resolved", "flow-map"],
)


def constant(**groups):
    """Return a pair on which only load, mesh and clearance act."""
    return pan2021(0.0, stiffness_variation_scale=0.0, **groups)


def assert_sound(outcome) -> None:
    assert (outcome.status == Status.OK).all()
    for array in outcome[:4]:
        assert np.isfinite(array).all()
    assert not outcome.overflows.any()


# Clearance


@BOTH
def test_a_tiny_clearance_is_a_perturbation_of_its_own_size(resolved):
    model = pan2021([0.5, 5.86, 12.0])
    how = {"steps": 100, "periods": 200}
    tiny = run(model._replace(half_backlash=np.full(3, 1e-9)), FULL, **how, resolved=resolved)
    # Flow maps are exact. They are compared with short steps, which are nearly exact.
    none = run(model, NO_BACKLASH, **how | ({"steps": 800} if resolved == FLOW_MAP else {}))
    assert_sound(tiny)
    # A split step consists of shorter steps. The results differ by the error of the method, not by
    # the clearance.
    assert tiny.section == pytest.approx(none.section, rel=0, abs=2e-6)
    # The growth differs only in the few steps in which the gap is free.
    total, wanted = (np.cumsum(outcome.growth, axis=1) for outcome in (tiny, none))
    assert total == pytest.approx(wanted, rel=0, abs=0.01)


@BOTH
def test_a_clearance_that_is_never_crossed_leaves_a_free_gap_with_its_damping(resolved):
    # N_y is only 2 xi y': the load accelerates the gears to the speed that the damping permits.
    model = constant(half_backlash=1e9, load=0.3)
    outcome = run(model, TORSION_ONLY, steps=100, periods=200, resolved=resolved)
    assert_sound(outcome)
    assert outcome.crossings.tolist() == [0]
    rate = 2.0 * model.damping_ratio[0] * COS
    tau = 2.0 * np.pi / OMEGA * np.arange(1, 201)
    speed = 0.3 / rate * -np.expm1(-rate * tau)
    assert outcome.section[0, :, 1] == pytest.approx(speed, rel=1e-9)
    assert outcome.section[0, :, 0] == pytest.approx((0.3 * tau - speed) / rate, rel=1e-9)


@BOTH
def test_a_huge_clearance_that_is_met_is_met_once_and_held(resolved):
    model = constant(half_backlash=1e9, load=1e3, damping_ratio=2.0)
    start = state(delta_5=1e9 * COS - 1e3)
    outcome = run(model, TORSION_ONLY, start, steps=400, periods=40, resolved=resolved)
    assert_sound(outcome)
    if resolved:
        assert outcome.crossings.tolist() == [1]
    held = 1e9 * COS + 1e3 / COS
    assert outcome.end_state[0, 0] == pytest.approx(held, rel=1e-12)


# Grazing, contact loss and impacts


@pytest.mark.parametrize("excess", [-1e-3, -1e-9, 0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
@BOTH
def test_a_grazing_motion_is_the_motion_in_contact_as_near_as_it_grazes(resolved, excess):
    load, half_backlash = 0.3, 0.5
    deflection = load / COS
    model = constant(load=load, half_backlash=half_backlash, damping_ratio=0.0)
    amplitude = (1.0 + excess) * deflection
    middle = half_backlash * COS + deflection
    periods = 10
    outcome = run(
        model,
        TORSION_ONLY,
        state(delta_5=middle + amplitude),
        steps=400,
        periods=periods,
        resolved=resolved,
    )
    assert_sound(outcome)
    tau = 2.0 * np.pi / OMEGA * np.arange(1, periods + 1)
    wanted = middle + amplitude * np.cos(np.sqrt(COS) * tau)
    # The time apart grows like the root of the excess, the distance like the excess: power 3/2.
    departure = 20.0 * max(excess, 0.0) ** 1.5
    method = 1e-7 if resolved else 1e-6
    assert outcome.section[0, :, 0] == pytest.approx(wanted, rel=0, abs=departure + method)
    if resolved:
        # In each oscillation the motion leaves the flank and returns, or stays in contact.
        assert outcome.crossings[0] % 2 == 0
        assert outcome.crossings[0] <= 2 * periods * np.sqrt(COS) / OMEGA + 2
        assert (outcome.crossings[0] > 0) == (outcome.slowest_crossing[0] < np.inf)
        if excess < 0.0:
            assert outcome.crossings[0] == 0
        if excess >= 1e-6:
            assert outcome.crossings[0] >= 20


@BOTH
def test_sustained_impacts_on_both_flanks_stay_within_reach_and_alternate(resolved):
    model = pan2021(np.linspace(20.0, 40.0, 24), load=0.0)
    outcome = run(model, TORSION_ONLY, steps=200, transient=100, periods=300, resolved=resolved)
    assert_sound(outcome)
    reach = 2.0 * (COS * model.half_backlash + 10.0 * model.error_amplitude)
    assert (np.abs(outcome.section[:, :, 0]).max(axis=1) < reach).all()
    if resolved:
        # Without load both flanks are equivalent: the motion crosses the gap and returns in every
        # period.
        assert (outcome.crossings == 4 * 300).all()


def test_the_first_periods_of_impacts_on_both_flanks_converge_with_order_four():
    model = pan2021(40.0, load=0.0)
    how = {"periods": 3, "resolved": True}
    truth = run(model, FULL, steps=12_800, **how)
    assert truth.crossings[0] > 12
    steps = np.array([200, 283, 400, 566, 800])
    errors = [np.abs(run(model, FULL, steps=s, **how).section - truth.section).max() for s in steps]
    assert measured_order(errors, steps) > 3.5


# Load and error


@BOTH
def test_a_pair_at_rest_with_nothing_acting_on_it_stays_at_rest(resolved):
    outcome = run(pan2021(0.0, load=0.0), FULL, steps=100, periods=100, resolved=resolved)
    assert_sound(outcome)
    assert not outcome.section.any()
    assert outcome.crossings.tolist() == [0]


@BOTH
def test_a_load_that_turns_around_takes_the_teeth_to_the_other_flank(resolved):
    how = {"steps": 100, "transient": 600, "periods": 1, "points": 1, "resolved": resolved}
    model = pan2021(0.0)
    forward = run(model, FULL, **how)
    turned = model._replace(load=-model.load)
    backward = run(turned, FULL, forward.end_state, **how)
    assert_sound(backward)
    assert forward.section[0, 0, 0] > 0.5
    assert backward.section == pytest.approx(-forward.section, rel=0, abs=1e-7)
    again = run(model, FULL, backward.end_state, **how)
    assert again.section == pytest.approx(forward.section, rel=0, abs=1e-7)


@BOTH
def test_any_pitch_error_up_to_a_hundred_multiples_gives_a_bounded_motion(resolved):
    multiples = np.linspace(0.0, 100.0, 96)
    model = pan2021(multiples)
    outcome = run(model, FULL, steps=100, transient=100, periods=200, resolved=resolved)
    assert_sound(outcome)
    # A generous bound: the pair amplifies load and error by much less than 10.
    reach = model.half_backlash + 10.0 * (model.load + model.error_amplitude)
    assert (np.abs(outcome.section).max(axis=(1, 2)) < 3.0 * reach).all()
