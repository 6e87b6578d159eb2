"""Flow maps are exact on a contact branch, between crossings, for any step."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate, maps_memory
from gearchaos_kernels.batch import scene_of as compiled_scene
from gearchaos_kernels.methods.flow_map.layout import layout_of
from gearchaos_kernels.methods.flow_map.store import maps_of
from scipy.linalg import expm

from gearchaos.dynamics.exponents import exponents, period_jacobian, sum_of_exponents
from gearchaos.dynamics.stability import fewest_stable_steps

from .reference import (
    BASE_HELIX_ANGLE,
    FLOW_MAP,
    FULL,
    LINEAR,
    NO_AXIAL,
    PERIOD,
    TORSION_ONLY,
    assert_same_bits,
    lanes_out_of,
    pan2021,
    run,
    state,
    stored_state,
    system_of,
)
from .test_linear import steady_state, system
from .test_oracle import ORBITS, RUNS, error, follow, name_of, scene_of

STEPS = 24
"""Steps per period, unless a test sets others."""

SCENES = (TORSION_ONLY, NO_AXIAL, FULL)
SOLUTIONS = [solution for solution in RUNS + ORBITS if scene_of(solution) in SCENES]


@pytest.mark.parametrize("solution", SOLUTIONS, ids=name_of)
def test_every_stored_solution_is_met_with_all_its_crossings(solution):
    turns = 2 if "section_points" in solution else 1
    # The solutions were computed to 1e-13. From rest at P = 12.97 chaos amplifies this to 3e-11.
    largest = 1e-9 if solution["pitch_error"] == 12.97 else 1e-11
    for steps in (STEPS, 48):
        outcome = follow(solution, steps, resolved=FLOW_MAP)
        assert error(solution, outcome) < largest
        assert outcome.crossings.tolist() == [turns * solution["crossings"]]
        assert outcome.overflows.tolist() == [0]


@pytest.mark.parametrize("steps", [1, 7, STEPS])
@pytest.mark.parametrize("physical", [False, True])
def test_a_linear_scene_is_the_matrix_exponential_at_any_number_of_steps(steps, physical):
    model = pan2021(5.86, error_mean=0.1, error_phase=0.4)
    start = state(delta_5=1.0, delta_1_rate=-0.4, delta_2=0.3, delta_3_rate=0.7, delta_4=-0.2)
    how = {"steps": steps, "periods": 1000, "physical": physical, "resolved": FLOW_MAP}
    outcome = run(model, LINEAR, start, **how)
    flow, settled = expm(system(model)[0] * PERIOD), steady_state(model, physical)
    wanted = start - settled
    for section in outcome.section[0]:
        wanted = flow @ wanted
        assert section == pytest.approx(wanted + settled, rel=0, abs=1e-12)


def test_a_free_gap_and_a_held_contact_are_exact_at_one_step_a_period():
    cosine = np.cos(BASE_HELIX_ANGLE)
    load, tau = 0.3, PERIOD * np.arange(1, 101)
    free = pan2021(0.0, load=load, half_backlash=1e9, stiffness_variation_scale=0.0)
    rate = 2.0 * free.damping_ratio[0] * cosine
    apart = run(free, TORSION_ONLY, steps=1, periods=100, resolved=FLOW_MAP).section[0]
    speed = load / rate * -np.expm1(-rate * tau)
    assert apart[:, 1] == pytest.approx(speed, rel=1e-12)
    assert apart[:, 0] == pytest.approx((load * tau - speed) / rate, rel=1e-12)

    held = free._replace(half_backlash=np.array([0.5]))
    start = state(delta_5=0.5 * cosine + load / cosine + 0.1)
    outcome = run(held, TORSION_ONLY, start, steps=1, periods=100, resolved=FLOW_MAP)
    frequency = np.sqrt(cosine - 0.25 * rate**2)
    decay = 0.1 * np.exp(-0.5 * rate * tau)
    wave = np.cos(frequency * tau) + 0.5 * rate / frequency * np.sin(frequency * tau)
    wanted = 0.5 * cosine + load / cosine + decay * wave
    assert outcome.section[0, :, 0] == pytest.approx(wanted, rel=0, abs=1e-13)
    assert outcome.crossings.tolist() == [0]


def test_all_exponents_have_the_trace_of_the_jacobian_as_their_sum():
    pair = system_of(pan2021([0.5, 5.86, 10.75, 12.47]), NO_AXIAL)
    plan = Plan(STEPS, 20, 30, 0, method=FLOW_MAP)
    found = exponents(pair, np.zeros((4, 6)), plan).values
    assert found.sum(axis=1) == pytest.approx(sum_of_exponents(pair), rel=0, abs=1e-12)


@pytest.mark.parametrize("orbit", [o for o in ORBITS if o["scene"] == "no_axial"], ids=name_of)
def test_the_multipliers_of_a_stored_orbit_are_met(orbit):
    point = stored_state(orbit["section_points"][0])[np.newaxis, :6]
    plan = Plan(STEPS, 0, orbit["period"], 0, method=FLOW_MAP)
    found = np.linalg.eigvals(
        period_jacobian(system_of(pan2021(orbit["pitch_error"]), NO_AXIAL), point, plan)[0]
    )
    wanted = [complex(*one) for one in orbit["floquet_multipliers"]]
    apart = np.abs(found[:, np.newaxis] - wanted)
    assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 1e-9


def test_lanes_share_maps_or_not_with_the_same_result():
    values = np.linspace(0.0, 10.0, 40)
    frequency = np.where(np.arange(40) % 3 == 0, 0.9, 1.1)
    frequency[7] = 0.7
    pair = system_of(pan2021(values, mesh_frequency=frequency), NO_AXIAL)
    plan = Plan(STEPS, 0, 20, 20, True, method=FLOW_MAP)
    whole = integrate(pair, np.zeros((40, 6)), plan)
    for lanes in ([7], [0, 1, 2, 3], list(range(39, -1, -1))):
        some = integrate(pair.of(lanes), np.zeros((len(lanes), 6)), plan)
        assert_same_bits(some, lanes_out_of(whole, lanes))


@pytest.mark.parametrize("scene", [TORSION_ONLY, NO_AXIAL])
@pytest.mark.parametrize("steps", [1, STEPS])
def test_the_memory_of_maps_is_predicted_within_a_factor_of_two(scene, steps):
    for frequency in (0.06, 0.3, 1.5):
        pair = system_of(pan2021(1.0, mesh_frequency=frequency), scene)
        plan = Plan(steps, 0, 1, 0, method=FLOW_MAP)
        compiled = compiled_scene(pair, plan)
        _, places = maps_of(pair, steps, compiled)
        made = 8 * places[0, 0] * layout_of(compiled).step_size
        # The prediction includes maps that are kept and maps that are being made.
        told = maps_memory(pair, plan, fewest_stable_steps(pair))
        assert 1 <= told / (2 * made) <= 2


def random_pairs(count: int, seed: int) -> dict:
    """Return groups of ``count`` random pairs, with base helix angles from 0 to 45 degrees."""
    draw = np.random.default_rng(seed).uniform
    ratio = {name: draw(0.3, 1.5, count) for name in ("mass_ratio_p", "mass_ratio_g")}
    bearings = {
        f"{way}_{kind}_{gear}": draw(*span, count)
        for way in ("transverse", "axial")
        for kind, span in (("stiffness", (0.2, 9.0)), ("damping", (0.01, 0.3)))
        for gear in "pg"
    }
    return (
        ratio
        | bearings
        | {
            "mesh_frequency": draw(0.4, 1.6, count),
            "load": draw(0.05, 0.4, count),
            "damping_ratio": draw(0.01, 0.1, count),
            "base_helix_angle": np.radians(draw(0.0, 45.0, count)),
            "half_backlash": draw(0.1, 1.5, count),
            "error_mean": draw(-0.2, 0.2, count),
            "stiffness_variation_scale": draw(0.0, 2.0, count),
        }
    )


@pytest.mark.parametrize(
    "count", [16, pytest.param(250, marks=pytest.mark.slow)], ids=["few", "many"]
)
@pytest.mark.parametrize("physical", [False, True])
def test_random_pairs_move_as_with_fine_runge_kutta_steps(count, physical):
    model = pan2021(np.linspace(0.0, 12.0, count), **random_pairs(count, seed=3 + physical))
    how = {"periods": 4, "physical": physical}
    exact = run(model, steps=STEPS, **how, resolved=FLOW_MAP)
    fine, finer = (run(model, steps=n, **how, resolved=True) for n in (800, 1600))
    # Richardson: halving the step changes the result by at least 15 times the remaining error.
    left = np.abs(finer.section - fine.section).max(axis=(1, 2)) / 15.0
    apart = np.abs(finer.section - exact.section).max(axis=(1, 2))
    assert (apart < 2.0 * left + 1e-11).all()
    assert exact.crossings.tolist() == finer.crossings.tolist()
    assert exact.crossings.sum() > count
