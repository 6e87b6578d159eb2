"""Extremes and amplitudes of chosen states against analytic motions, transforms and fine steps."""

from fractions import Fraction

import numpy as np
import pytest
from gearchaos_kernels import STATES, Plan, integrate, mesh_motion

from .reference import assert_same_bits, pan2021, state, swinging, system_of

SMALLEST, LARGEST = range(2)
ORDERS = tuple(map(Fraction, ("1/3", "1/2", "1", "3/2", "2", "3")))
CHOSEN = ("delta_5", "delta_5_rate", "delta_2", "delta_4", "delta_4_rate")
"""Within the kernels, the displacements of the driven gear have the opposite sign."""
PLAN = Plan(200, 400, 12, 1, tangent=True, contact=True, loads=True)
TOLD = PLAN._replace(states=CHOSEN, orders=ORDERS)
MODEL = pan2021([0.3, 2.0, 5.86, 10.75])
"""Lane 0 is held, the others meet the driving flank once per period; lane 3 has period 2."""


@pytest.fixture(scope="module")
def told():
    return integrate(system_of(MODEL), np.zeros((4, 10)), TOLD)


def motion_of(steps):
    """Return the chosen states and the transmission error at every step of the record."""
    plan = Plan(steps, 400, 12, 1, tangent=True, history_periods=12)
    history = integrate(system_of(MODEL), np.zeros((4, 10)), plan).history
    error = history[..., 0] + mesh_motion(system_of(MODEL), history, steps).pitch_error
    chosen = history[..., [STATES.index(name) for name in CHOSEN]]
    return np.concatenate([chosen, error[..., np.newaxis]], axis=2)


@pytest.fixture(scope="module")
def fine():
    return motion_of(16 * 200)


def lines_of(motion):
    """Return the amplitudes of a motion at the orders, from a transform of 12 periods."""
    lines = np.abs(np.fft.rfft(motion[:, 1:], axis=1, norm="forward"))
    return 2.0 * np.moveaxis(lines[:, [int(12 * order) for order in ORDERS]], 1, 2)


def test_a_swinging_mass_has_one_line_and_the_extremes_of_a_sine():
    amplitude, steps = 0.7, 200
    system, frequency = swinging()
    # A mesh period is half an oscillation: delta_5 turns at its ends, the rate in its middle.
    plan = PLAN._replace(transient_periods=0, states=("delta_5", "delta_5_rate"), orders=ORDERS)
    plan = plan._replace(resolved=False, contact=False)
    outcome = integrate(system, state(delta_5=amplitude)[np.newaxis], plan)
    sizes = np.array([amplitude, amplitude * frequency])
    assert outcome.extremes[0] == pytest.approx(np.outer(sizes, [-1.0, 1.0]), rel=1e-7)
    expected = np.outer([*sizes, amplitude], [order == Fraction(1, 2) for order in ORDERS])
    # RK4 slightly reduces the amplitude and shifts the phase.
    assert outcome.amplitudes[0] == pytest.approx(expected, abs=1e-7)
    # From this start, delta_5 turns within a step, and the cubic must reach the full amplitude.
    angle = 0.4 * np.pi / steps
    start = state(delta_5=amplitude * np.cos(angle), delta_5_rate=sizes[1] * np.sin(angle))
    between = integrate(system, start[np.newaxis], plan)
    assert between.extremes[0, 0] == pytest.approx([-amplitude, amplitude], rel=1e-8)


def test_a_pair_at_rest_has_no_amplitudes_and_stands_where_it_is():
    model = pan2021(0.0, half_backlash=0.5, stiffness_variation_scale=0.0)
    plan = TOLD._replace(transient_periods=2000)
    outcome = integrate(system_of(model), np.zeros((1, 10)), plan)
    assert outcome.amplitudes[0] == pytest.approx(0.0, abs=1e-9)
    place = outcome.end_state[0, [STATES.index(name) for name in CHOSEN]]
    assert outcome.extremes[0] == pytest.approx(np.stack([place] * 2, axis=1), abs=1e-9)


def test_amplitudes_are_lines_of_the_transform_of_the_record(told):
    lines = lines_of(motion_of(200))
    assert told.amplitudes == pytest.approx(lines, abs=1e-12)


def test_extremes_and_amplitudes_are_those_of_the_motion_at_sixteen_times_the_steps(told, fine):
    size = np.abs(fine).max(axis=1)
    ends = np.stack([fine.min(axis=1), fine.max(axis=1)], axis=2)[:, :-1]
    apart = np.abs(told.extremes - ends) / size[:, :-1, np.newaxis]
    # Gears on stiff bearings oscillate eight times per period.
    assert apart[:, :2].max() < 2e-6
    assert apart[:, 2:].max() < 3e-5
    assert (np.abs(told.amplitudes - lines_of(fine)) < 2e-5 * size[..., np.newaxis]).all()


def test_a_motion_of_period_2_has_halves_of_the_order_and_one_of_period_1_has_none(told):
    halves = told.amplitudes[..., [ORDERS.index(Fraction(n, 2)) for n in (1, 3)]]
    whole = told.amplitudes[..., ORDERS.index(Fraction(1))]
    assert (halves[:3] < 1e-8 * whole[:3, :, np.newaxis]).all()
    assert (halves[3] > 0.1 * whole[3, :, np.newaxis]).all()


def test_they_change_nothing_else(told):
    nothing = {"extremes": np.zeros((4, 0, 2)), "amplitudes": np.zeros((4, 1, 0))}
    without = integrate(system_of(MODEL), np.zeros((4, 10)), PLAN)
    assert_same_bits(told._replace(**nothing), without)


def test_flow_maps_report_the_same_whatever_steps_are_asked_for(told):
    plan = TOLD._replace(steps_per_period=24, method="flow_map")
    exact = integrate(system_of(MODEL), np.zeros((4, 10)), plan)
    fine = integrate(system_of(MODEL), np.zeros((4, 10)), TOLD._replace(steps_per_period=800))
    for name in ("extremes", "amplitudes"):
        mine, wanted, rough = (getattr(one, name) for one in (exact, fine, told))
        assert np.abs(mine - wanted).max() <= np.abs(rough - wanted).max()
