"""All Lyapunov exponents: their exact sum, stored multipliers and the exponent of one vector."""

import numpy as np
import pytest
from gearchaos_kernels import LANES, Effects, Groups, Plan, integrate, jacobian
from gearchaos_kernels.methods.rk4.stability import amplification

from gearchaos.dynamics.exponents import (
    contact_shares,
    exponents,
    period_jacobian,
    sum_of_exponents,
)
from gearchaos.dynamics.labelling import admits_tori
from gearchaos.dynamics.largest_exponents import largest_exponents
from gearchaos.records.lyapunov import largest_exponent

from ..kernels.piecewise import lanes_of as machines_of
from ..kernels.piecewise import random_machine
from ..kernels.reference import (
    FULL,
    LINEAR,
    NO_AXIAL,
    PERIOD,
    SOLUTIONS,
    TORSION_ONLY,
    lanes_of,
    pan2021,
    system_of,
)

ORBITS = SOLUTIONS["periodic_orbits"]
NO_TRANSVERSE = Effects(transverse=False)
PERIODIC_AND_CHAOTIC = [0.5, 5.86, 10.75, 12.5, 14.2]


def plan(steps: int, periods: int, transient: int = 0, resolved: bool = True) -> Plan:
    return Plan(steps, transient, periods, 0, resolved=resolved)


def exponents_of(effects, groups, steps, periods, transient=0, resolved=True):
    """Return the exponents of motions from rest."""
    system = system_of(groups, effects)
    start = np.zeros((system.lanes, len(system.states)))
    return exponents(system, start, plan(steps, periods, transient, resolved))


def multipliers(orbit: dict, steps: int) -> np.ndarray:
    effects = {"full": FULL, "no_axial": NO_AXIAL}[orbit["scene"]]
    system, point = system_of(pan2021(orbit["pitch_error"]), effects), orbit["section_points"][0]
    monodromy = period_jacobian(system, np.array([point]), plan(steps, orbit["period"]))
    return np.linalg.eigvals(monodromy[0])


def distance(found: np.ndarray, wanted: np.ndarray) -> float:
    """Return the largest distance of a multiplier in one set from the nearest in the other set."""
    between = np.abs(found[:, np.newaxis] - wanted)
    return float(max(between.min(axis=0).max(), between.min(axis=1).max()))


def sum_error(scene, model, steps, resolved=True) -> float:
    total = exponents_of(scene, model, steps, 6, 2, resolved=resolved).values.sum(axis=1)
    return float(np.max(np.abs(total - sum_of_exponents(system_of(model, scene)))))


@pytest.mark.parametrize(
    ("scene", "steps"),
    [(TORSION_ONLY, 800), (NO_AXIAL, 6400), (FULL, 6400)],
    ids=["torsion", "transverse", "full"],
)
def test_sum_of_all_exponents_is_the_trace_whether_periodic_or_chaotic(scene, steps):
    assert sum_error(scene, pan2021(PERIODIC_AND_CHAOTIC), steps) < 1e-10


def test_frames_of_the_kernels_are_those_of_a_decomposition_after_every_period(monkeypatch):
    groups = pan2021(PERIODIC_AND_CHAOTIC)
    found = exponents_of(NO_AXIAL, groups, 200, 8, 4)
    # Use the method for systems with more states than a block has lanes.
    monkeypatch.setattr("gearchaos.dynamics.exponents.LANES", 1)
    assert found.values == pytest.approx(
        exponents_of(NO_AXIAL, groups, 200, 8, 4).values, abs=1e-12
    )


def test_a_frame_of_more_states_than_a_block_has_lanes_is_refused():
    system = machines_of(34 * [random_machine(0, 17, 1)])
    with pytest.raises(ValueError, match=f"34 states is larger than a block of {LANES}"):
        integrate(system, np.zeros((34, 34)), Plan(8, 0, 1, 0, tangent=True, frame=True))


def test_error_of_the_sum_falls_with_the_fourth_power_of_the_step():
    steps = np.array([200, 400, 800, 1600])
    model = pan2021(PERIODIC_AND_CHAOTIC)
    errors = [sum_error(TORSION_ONLY, model, number) for number in steps]
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] > 3.8


@pytest.mark.parametrize("steps", [16, 50, 200, 3200])
def test_sum_in_a_linear_scene_is_that_of_the_amplifications_of_a_step(steps):
    model, stiffness = pan2021(5.86), np.ones((1, 2))
    step = PERIOD / steps
    modes = np.linalg.eigvals(jacobian(system_of(model, LINEAR), stiffness)[0])
    wanted = np.sum(np.log(amplification(step * modes))) / step
    found = exponents_of(LINEAR, model, steps, 6, 2).values.sum()
    assert found == pytest.approx(wanted, rel=0, abs=1e-12)


def test_sum_in_closed_form_follows_every_damping_and_nothing_else():
    rng = np.random.default_rng(0)
    names = [name for name in Groups._fields if name != "error_amplitude"]
    model = pan2021(np.ones(20), **{name: rng.uniform(0.1, 1.0, 20) for name in names})
    cosine, sine = np.cos(model.base_helix_angle), np.sin(model.base_helix_angle)
    masses = model.mass_ratio_p + model.mass_ratio_g
    torsion = -2.0 * model.damping_ratio * cosine
    transverse = torsion * masses - 2.0 * (model.transverse_damping_p + model.transverse_damping_g)
    axial = -2.0 * model.damping_ratio * sine * masses
    axial -= 2.0 * (model.axial_damping_p + model.axial_damping_g)
    for scene, wanted in (
        (TORSION_ONLY, torsion),
        (NO_AXIAL, torsion + transverse),
        (NO_TRANSVERSE, torsion + axial),
        (FULL, torsion + transverse + axial),
    ):
        assert sum_of_exponents(system_of(model, scene)) == pytest.approx(wanted, rel=1e-13)


@pytest.mark.parametrize("orbit", ORBITS, ids=lambda o: f"{o['scene']}-{o['pitch_error']}")
def test_multipliers_of_a_periodic_orbit_are_the_stored_ones(orbit):
    # The tests of polished orbits show how the error falls with the step.
    stored = np.array([complex(*pair) for pair in orbit["floquet_multipliers"]])
    assert distance(multipliers(orbit, 1600), stored) < 2e-7


@pytest.mark.parametrize("orbit", ORBITS, ids=lambda o: f"{o['scene']}-{o['pitch_error']}")
def test_largest_exponent_of_a_periodic_orbit_is_that_of_its_largest_multiplier(orbit):
    largest = np.max(np.abs(multipliers(orbit, 1600)))
    exponent = np.log(largest) / (orbit["period"] * PERIOD)
    assert exponent == pytest.approx(orbit["largest_exponent"], rel=0, abs=1e-9)


def test_exponents_of_a_linear_scene_are_the_stored_real_parts():
    stored = sorted((real for real, _ in SOLUTIONS["linear_scene_eigenvalues"]), reverse=True)
    found = exponents_of(LINEAR, pan2021(5.86), 400, 400, 800)
    assert found.values[0] == pytest.approx(stored, rel=0, abs=2e-6)


def test_largest_of_all_exponents_is_the_exponent_of_a_single_vector():
    model, start = pan2021([5.86, 10.75, 12.5, 14.2]), np.zeros((4, 6))
    single = plan(200, 400, 300)._replace(tangent=True)
    growth = integrate(system_of(model, NO_AXIAL), start, single).growth
    exponent, error = largest_exponent(growth, np.full(4, PERIOD))
    found = exponents_of(NO_AXIAL, model, 200, 400, 300)
    assert found.values[:2, 0] == pytest.approx(exponent[:2], rel=0, abs=1e-6)
    # In chaos, the two exponents belong to different records of one motion.
    margin = 4.0 * np.hypot(error, found.standard_errors[:, 0])
    assert np.all(np.abs(found.values[2:, 0] - exponent[2:]) < margin[2:])
    assert np.all(found.values[2:, 0] > 0.03)
    assert np.all(np.diff(found.values, axis=1) <= 0.0)


def test_jacobian_over_several_periods_is_the_product_of_those_over_one():
    system, start = system_of(pan2021([5.86, 14.2])), np.full((2, 10), 0.1)
    once, product, state = plan(100, 1), np.eye(10), start
    for _ in range(3):
        product = period_jacobian(system, state, once) @ product
        state = integrate(system, state, once).end_state
    whole = period_jacobian(system, start, plan(100, 3))
    assert whole == pytest.approx(product, rel=0, abs=1e-12 * np.max(np.abs(product)))


@pytest.mark.parametrize(("resolved", "steps", "apart"), [(False, 100, 1e-8), (True, 1600, 2e-6)])
def test_jacobian_is_the_difference_of_neighbouring_motions(resolved, steps, apart):
    # A split step uses the crossing of the motion also for its neighbours: an error of order 4.
    start = np.random.default_rng(2).standard_normal((1, 10))
    system, wanted = system_of(pan2021(5.86)), plan(steps, 1, resolved=resolved)
    wanted = wanted._replace(tangent=True)
    found = period_jacobian(system, start, wanted)[0]
    shifts = 1e-6 * np.eye(10)
    both = np.concatenate([start + shifts, start - shifts])
    ends = integrate(system.repeated(20), both, wanted).end_state
    quotients = (ends[:10] - ends[10:]).T / 2e-6
    assert found == pytest.approx(quotients, rel=0, abs=apart)


def test_a_lane_that_diverges_has_no_spectrum_and_leaves_the_others_alone():
    model = pan2021([5.86, 5.86, 10.75], transverse_stiffness_p=[36.315, 1e5, 36.315])
    found = exponents_of(NO_AXIAL, model, 50, 20)
    assert np.isnan(found.values[1]).all()
    assert np.isnan(found.standard_errors[1]).all()
    alone = exponents_of(NO_AXIAL, lanes_of(model, [0, 2]), 50, 20)
    assert np.array_equal(found.values[[0, 2]], alone.values)


def test_directions_that_become_parallel_within_a_period_are_not_distinguished():
    # Within 63 units of tau, one direction contracts by e^-100 or more relative to the slowest.
    model = pan2021(0.0, mesh_frequency=0.1, damping_ratio=1.5)
    found = exponents_of(TORSION_ONLY, model, 1000, 20, 5).values[0]
    assert np.isfinite(found[0])
    assert np.isnan(found[1])
    assert np.all(np.isfinite(exponents_of(TORSION_ONLY, pan2021(0.0), 1000, 20).values))


def test_one_period_gives_exponents_without_standard_errors():
    found = exponents_of(TORSION_ONLY, pan2021([1.0, 2.0]), 100, 1)
    assert np.isfinite(found.values).all()
    assert np.isnan(found.standard_errors).all()
    assert found.values.shape == (2, 2)


@pytest.mark.parametrize(("exponent_gap", "resolved"), [(16.0, True), (20.0, False), (30.0, False)])
def test_an_exponent_is_given_as_long_as_rounding_leaves_half_of_its_digits(exponent_gap, resolved):
    # Overdamped and linear: within a mesh period, the decays at the rates xi -+ sqrt(xi^2 - 1)
    # differ by the gap.
    damping_ratio = 1.5
    root = np.sqrt(damping_ratio**2 - 1.0)
    model = pan2021(
        0.0,
        base_helix_angle=0.0,
        damping_ratio=damping_ratio,
        mesh_frequency=2.0 * np.pi * 2.0 * root / exponent_gap,
    )
    found = exponents_of(Effects(*[False] * 5), model, 2000, 30, 5).values[0]
    assert found[0] == pytest.approx(root - damping_ratio, abs=1e-9)
    assert np.isfinite(found[1]) == resolved
    if resolved:
        # The rounding eps / exp(-16) of a vector is 2e-9; the mean of 30 periods is no worse.
        assert found[1] == pytest.approx(-root - damping_ratio, abs=1e-7)


@pytest.mark.parametrize(("multiplier_gap", "resolved"), [(16.0, True), (20.0, False)])
def test_multipliers_that_rounding_hides_give_no_exponents(multiplier_gap, resolved):
    system = system_of(
        pan2021(
            1.0,
            base_helix_angle=0.0,
            damping_ratio=1.5,
            mesh_frequency=2.0 * np.pi * 2.0 * np.sqrt(1.25) / multiplier_gap,
        ),
        Effects(True, False, False, False, False),
    )
    recorded = plan(500, 48, 20)._replace(tangent=True, section_points=48)
    outcome = integrate(system, np.zeros((1, 2)), recorded)
    period = np.ones(1, dtype=np.int32)
    found = largest_exponents(system, outcome, recorded, period, outcome.end_state)
    assert found.values[0] == pytest.approx(np.sqrt(1.25) - 1.5, abs=1e-7)
    assert np.isfinite(found.of_orbit[0]).tolist() == [True, resolved]


def test_two_standard_errors_cover_the_exponent_of_a_weakly_damped_pair():
    weak = pan2021(
        7.0,
        load=0.183,
        half_backlash=0.7215324,
        damping_ratio=0.003,
        error_amplitude=np.full(200, 7.0 * 0.02125545),
        stiffness_variation_scale=1.0,
        transverse_stiffness_p=1.9,
        transverse_damping_p=0.003,
        transverse_stiffness_g=0.9,
        transverse_damping_g=0.002,
    )
    system = system_of(weak, NO_AXIAL)
    start = 0.05 * np.random.default_rng(5).uniform(-1.0, 1.0, (200, 6))
    record = Plan(100, 500, 200, 0, tangent=True)
    outcome = integrate(system, start, record)
    period = np.zeros(200, dtype=np.int32)
    found = largest_exponents(system, outcome, record, period, outcome.end_state)
    mean = np.mean(found.values)
    # The error of the mean of 200 lanes is fourteen times smaller than that of one lane.
    assert mean > 0.01
    assert np.mean(np.abs(found.values - mean) <= 2.0 * found.standard_errors) >= 0.92
    _, blind = largest_exponent(outcome.growth, system.mesh_period)
    assert np.mean(np.abs(found.values - mean) <= 2.0 * blind) < 0.9
    assert np.median(found.standard_errors / blind) < 2.2


@pytest.mark.parametrize(("method", "steps"), [("rk4", 3200), ("flow_map", 60)])
def test_dampers_that_act_in_contact_only_add_to_the_sum_in_proportion_to_the_contact(
    method, steps
):
    system = machines_of([random_machine(seed, 3, 2) for seed in range(6)])
    assert any(system.damped_in_contact) and np.isnan(sum_of_exponents(system)).all()
    start = 0.5 * np.random.default_rng(3).normal(size=(6, 6))
    record = Plan(steps, 0, 4, 4, tangent=True, contact=True, method=method)
    outcome = integrate(system, start, record)
    shares = contact_shares(outcome, record)
    assert ((shares > 0.1) & (shares < 0.9)).any(axis=0).all() and outcome.crossings.sum() > 20
    points = [start, *np.moveaxis(outcome.section, 1, 0)[:-1]]
    once = record._replace(recorded_periods=1, section_points=1, contact=False)
    volumes = [np.linalg.slogdet(period_jacobian(system, point, once))[1] for point in points]
    wanted = np.sum(volumes, axis=0) / (4 * system.mesh_period)
    assert sum_of_exponents(system, shares) == pytest.approx(wanted, abs=1e-9)


def test_a_pair_of_two_states_with_a_damper_in_contact_only_has_no_torus():
    pairs = system_of(pan2021([0.5, 5.86]), TORSION_ONLY).replace(damped_in_contact_only=True)
    assert not admits_tori(pairs).any()
    undamped = pairs.replace(groups=pairs.groups._replace(damping_ratio=np.zeros(2)))
    assert admits_tori(undamped).all()
