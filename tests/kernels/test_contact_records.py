"""Records of contact, that is shares of time and impacts, against the motion itself."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate, mesh_motion

from .reference import FLOW_MAP, pan2021, system_of

PERIODS = 12
DRIVING, ON_DRIVING, BACK, ON_BACK, SPEEDS, FASTEST = range(6)
TIMES, IMPACTS = [DRIVING, BACK], [ON_DRIVING, ON_BACK, SPEEDS, FASTEST]
MODEL = pan2021([0.3, 2.0, 5.86, 10.75])
"""Lane 0 is held, the others meet the driving flank once per period."""
METHODS = {"rk4": 200, FLOW_MAP: 24}


def reported(system, start, periods=PERIODS, **plan):
    """Integrate, and return the contact record, (lanes, directions, 6); times in mesh periods."""
    plan = {"transient_periods": 60, "recorded_periods": periods, "section_points": 1, **plan}
    # Loads, and with flow maps extremes, are also recorded: other tests have compiled these loops.
    states = ("delta_5",) if plan.get("method") == FLOW_MAP else ()
    plan = Plan(**plan, tangent=True, contact=True, loads=True, states=states)
    return integrate(system, start, plan).contact


def fine_history(system, start):
    """Return the state at every step, with 3200 steps per period."""
    plan = Plan(3200, 60, PERIODS, 1, tangent=True, history_periods=PERIODS)
    return integrate(system, start, plan).history


@pytest.mark.parametrize("method", METHODS)
def test_shares_and_impacts_are_those_of_the_motion_at_sixteen_times_the_steps(method):
    system, start = system_of(MODEL), np.zeros((4, 10))
    found = reported(system, start, steps_per_period=METHODS[method], method=method)
    motion = mesh_motion(system, fine_history(system, start), 3200)
    for way, contact in enumerate((motion.contact_tangential, motion.contact_axial)):
        for flank, time, impacts in ((1, DRIVING, ON_DRIVING), (2, BACK, ON_BACK)):
            here = contact == flank
            # Up to two samples per period may lie on the other side of a crossing.
            share = here[:, :-1].mean(axis=1)
            assert found[:, way, time] / PERIODS == pytest.approx(share, rel=0, abs=2.0 / 3200)
            meets = (here[:, 1:] & ~here[:, :-1]).sum(axis=1)
            assert found[:, way, impacts].tolist() == meets.tolist()


def test_the_speed_of_approach_is_that_of_the_gap_where_it_meets_the_flank():
    system, start = system_of(MODEL), np.zeros((4, 10))
    found = reported(system, start, steps_per_period=3200)
    states = fine_history(system, start)[1:]
    step = system.of(slice(1, 4)).mesh_period[:, np.newaxis] / 3200
    # The printed gap is delta_1 - delta_2 + delta_5 - cos(beta_b) e; e repeats every period.
    motion = states[..., 2] - states[..., 4] + states[..., 0]
    groups = system.of(slice(1, 4)).groups
    angle = 2.0 * np.pi * np.arange(motion.shape[1]) / 3200
    error = groups.error_amplitude[:, np.newaxis] * np.sin(angle)
    gap = motion - error * np.cos(groups.base_helix_angle[:, np.newaxis])
    rate = np.gradient(gap, axis=1) / step
    for lane in range(3):
        limit = groups.half_backlash[lane] * np.cos(groups.base_helix_angle[lane])
        meets = np.flatnonzero((gap[lane, 1:] >= limit) & (gap[lane, :-1] < limit))
        speeds = rate[lane, meets]
        assert found[lane + 1, 0, FASTEST] == pytest.approx(speeds.max(), rel=2e-3)
        assert found[lane + 1, 0, SPEEDS] == pytest.approx(speeds.sum(), rel=2e-3)


@pytest.mark.parametrize("method", METHODS)
def test_teeth_that_never_part_are_held_and_teeth_in_the_middle_are_free(method):
    model = pan2021([0.0, 0.0, 0.0], load=[0.3, 0.0, -0.3], half_backlash=0.5)
    start = np.zeros((3, 10))
    start[:, 0] = [0.8, 0.0, -0.8]
    found = reported(system_of(model), start, steps_per_period=METHODS[method], method=method)
    shares = found[:, 0, TIMES] / PERIODS
    assert shares == pytest.approx(np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]))
    assert not found[:, 0, IMPACTS].any()


def test_a_free_flight_meets_the_flanks_when_it_should():
    # Without damping and load, a lane with speed v in the middle of the gap meets the flank after
    # b / v.
    speed, clearance = 0.37, 0.9
    absent = "load", "damping_ratio", "base_helix_angle", "stiffness_variation_scale"
    # The masses in the bearings are a billion times larger.
    own = {"half_backlash": clearance, "mass_ratio_p": 1e-9, "mass_ratio_g": 1e-9}
    system = system_of(pan2021(0.0, **dict.fromkeys(absent, 0.0), **own))
    start = np.pad([[0.0, speed]], ((0, 0), (0, 8)))
    periods = 20
    found = reported(system, start, periods, transient_periods=0, steps_per_period=400)
    # A contact with stiffness 1 is half an oscillation and lasts pi. The flight between the flanks
    # lasts 2 b / v.
    flight, turn = 2.0 * clearance / speed, np.pi
    total = periods * system.mesh_period[0]
    landings = np.arange(1, 99) * (flight + turn) - flight / 2.0 - turn
    landings = landings[landings < total]
    on_flank = np.minimum(landings + turn, total) - landings
    assert found[0, 0, ON_DRIVING] == landings[::2].size
    assert found[0, 0, ON_BACK] == landings[1::2].size
    times = found[0, 0, TIMES] * system.mesh_period[0]
    assert times == pytest.approx([on_flank[::2].sum(), on_flank[1::2].sum()], rel=1e-7)
    assert found[0, 0, FASTEST] == pytest.approx(speed, rel=1e-8)
    assert found[0, 0, SPEEDS] == pytest.approx(landings.size * speed, rel=1e-8)
