"""Mesh forces and transmission error of a record, against analytic motions and fine steps."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate, mesh_motion

from .reference import FLOW_MAP, assert_same_bits, pan2021, state, swinging, system_of

FORCE, AXIAL, ERROR = range(3)
LARGEST, SMALLEST, MEAN, SQUARE = range(4)
MODEL = pan2021([0.3, 2.0, 5.86, 10.75])
"""Lane 0 is held, the others meet the driving flank once per period."""
PLAN = Plan(200, 60, 12, 1, tangent=True, contact=True, loads=True)
PLAIN = PLAN._replace(resolved=False, contact=False, states=("delta_5",))
"""Extremes of a state are recorded, because other tests have compiled this loop."""


def test_teeth_at_rest_carry_the_static_load():
    model = pan2021([0.0, 0.0], load=[0.3, -0.3], half_backlash=0.5)
    model = model._replace(stiffness_variation_scale=np.zeros(2))
    system = system_of(model)
    cosine = np.cos(system.groups.base_helix_angle)
    static = system.groups.load / cosine
    start = np.zeros((2, 10))
    start[:, 0] = 0.8 * np.sign(static)
    loads = integrate(system, start, PLAN._replace(transient_periods=2000)).loads
    for number in (LARGEST, SMALLEST, MEAN):
        assert loads[:, FORCE, number] == pytest.approx(static, rel=1e-9)
    assert loads[:, FORCE, SQUARE] == pytest.approx(static**2, rel=1e-9)
    # The transmission error is constant: half the backlash and the static deflections.
    assert np.ptp(loads[:, ERROR, :3], axis=1) == pytest.approx(0.0, abs=1e-9)


def test_a_swinging_mass_carries_its_own_inertia():
    amplitude, periods = 0.7, 8
    system, _ = swinging()
    plan = PLAIN._replace(transient_periods=0, recorded_periods=periods)
    (loads,) = integrate(system, state(delta_5=amplitude)[np.newaxis], plan).loads
    # For a step of h radians, the error of the parabola's height is less than (h / 2)^3.
    assert loads[FORCE, [LARGEST, SMALLEST]] == pytest.approx([amplitude, -amplitude], rel=4e-6)
    assert loads[FORCE, SQUARE] == pytest.approx(amplitude**2 / 2.0, rel=1e-7)
    assert loads[ERROR, [LARGEST, SMALLEST]] == pytest.approx([amplitude, -amplitude], rel=4e-6)
    assert loads[ERROR, SQUARE] == pytest.approx(amplitude**2 / 2.0, rel=1e-7)
    assert np.abs(loads[[FORCE, ERROR], MEAN]).max() < 1e-7


def test_loads_are_those_of_the_motion_at_sixteen_times_the_steps():
    system, start = system_of(MODEL), np.zeros((4, 10))
    loads = integrate(system, start, PLAN).loads
    fine = integrate(system, start, Plan(3200, 60, 12, 1, tangent=True, history_periods=12))
    motion = mesh_motion(system, fine.history, 3200)
    error = fine.history[..., 0] + motion.pitch_error
    signals = motion.force_tangential, motion.force_axial, error
    for number, values in enumerate(signals):
        size = np.abs(values).max(axis=1)
        extremes = loads[:, number, [LARGEST, SMALLEST]].T
        # The samples of the motion may miss a kink by half their distance.
        missed = np.abs(np.diff(values, axis=1)).max(axis=1)
        difference = np.abs(extremes - [values.max(axis=1), values.min(axis=1)])
        assert (difference <= missed + 1e-5 * size).all()
        squares = (values[:, :-1] ** 2).mean(axis=1)
        assert loads[:, number, SQUARE] == pytest.approx(squares, rel=1e-5)
        mean = values[:, :-1].mean(axis=1)
        assert (np.abs(loads[:, number, MEAN] - mean) < 1e-5 * size).all()


def test_a_kink_is_not_missed():
    # The force has its minimum where the teeth part, and is then the damping force alone. Only the
    # crossing itself shows this minimum.
    system, start = system_of(MODEL), np.zeros((4, 10))
    loads = integrate(system, start, PLAN).loads
    fine = integrate(system, start, PLAN._replace(steps_per_period=3200)).loads
    assert loads[1:, FORCE, SMALLEST] == pytest.approx(fine[1:, FORCE, SMALLEST], rel=5e-5)
    assert (loads[1:, FORCE, SMALLEST] < 0.0).all()


def test_loads_and_contact_change_nothing_else_and_plain_steps_have_loads_too():
    system, start = system_of(MODEL), np.zeros((4, 10))
    without = integrate(system, start, PLAN._replace(loads=False, contact=False))
    assert without.loads.size == without.contact.size == 0
    with_loads = integrate(system, start, PLAN)
    assert with_loads.contact.any()
    nothing = {"loads": without.loads, "contact": without.contact}
    assert_same_bits(with_loads._replace(**nothing), without)
    plain = integrate(system, start, PLAIN)
    assert plain.loads[0, FORCE] == pytest.approx(with_loads.loads[0, FORCE], rel=1e-6)


def test_flow_maps_follow_a_swinging_mass_at_any_phase_of_their_steps():
    amplitude, periods = 0.7, 8
    system, rate = swinging()
    plan = Plan(12, 0, periods, 1, tangent=True, loads=True, method=FLOW_MAP)
    # For different phases the crest of the cosine lies at different places within a step.
    for phase in (0.0, 0.1, 1.0):
        start = state(
            delta_5=amplitude * np.cos(phase), delta_5_rate=-amplitude * rate * np.sin(phase)
        )[np.newaxis]
        (loads,) = integrate(system, start, plan).loads
        for signal in (FORCE, ERROR):
            extremes = loads[signal, [LARGEST, SMALLEST]]
            # The bearings move by a billionth of the amplitude.
            assert extremes == pytest.approx([amplitude, -amplitude], rel=2e-9)
            assert loads[signal, SQUARE] == pytest.approx(amplitude**2 / 2.0, rel=4e-9)
            assert loads[signal, MEAN] == pytest.approx(0.0, abs=2e-9)


def test_flow_maps_record_the_loads_of_very_fine_steps():
    system, start = system_of(MODEL), np.zeros((4, 10))
    wanted = integrate(system, start, PLAN._replace(steps_per_period=12800)).loads
    exact = integrate(system, start, PLAN._replace(steps_per_period=12, method=FLOW_MAP)).loads
    size = np.abs(wanted[..., :2]).max(axis=2)
    # The fine steps are accurate to 2e-11, and their means at kinks to 3e-10.
    assert np.abs(exact[..., :2] - wanted[..., :2]).max(axis=2) == pytest.approx(0.0, abs=1e-10)
    assert (np.abs(exact[..., MEAN] - wanted[..., MEAN]) <= 1e-9 * size).all()
    assert exact[..., SQUARE] == pytest.approx(wanted[..., SQUARE], rel=1e-9)


def test_flow_maps_sample_states_as_well_as_200_runge_kutta_steps():
    system, start = system_of(MODEL), np.zeros((4, 10))
    fine = integrate(system, start, PLAN._replace(steps_per_period=3200))
    # Extremes of a state are recorded, because other tests have compiled this loop.
    plan = PLAN._replace(steps_per_period=24, method=FLOW_MAP, section_points=72)
    exact = integrate(system, start, plan._replace(states=("delta_5",)))
    wanted = fine.loads
    # The errors of 200 Runge-Kutta steps are 4e-6 for extremes, 7e-6 for means and 9e-7 for mean
    # squares.
    size = np.abs(wanted[..., :2]).max(axis=2)
    extremes = np.abs(exact.loads[..., :2] - wanted[..., :2]).max(axis=2)
    assert (extremes <= 1e-6 * size).all()
    assert (np.abs(exact.loads[..., MEAN] - wanted[..., MEAN]) <= 3e-6 * size).all()
    assert exact.loads[..., SQUARE] == pytest.approx(wanted[..., SQUARE], rel=6e-7)
    same = integrate(system, start, plan._replace(loads=False, contact=False))
    assert same.section.shape[1] == 72
    assert exact.section == pytest.approx(same.section, rel=0, abs=1e-11)
    assert exact.crossings.tolist() == same.crossings.tolist()
