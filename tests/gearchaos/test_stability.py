"""The fewest stable steps agree with known limits and with integrations on both sides."""

import itertools

import numpy as np
import pytest
from gearchaos_kernels import Effects, GearPairs, Groups, Plan, Status, jacobian

from gearchaos import ConfigurationError
from gearchaos.dynamics.exponents import period_jacobian
from gearchaos.dynamics.stability import (
    STEPS_CEILING,
    exponent_bias,
    fewest_stable_steps,
    steps_per_time,
)
from gearchaos.models.gear_pair.contact_lines import series_table

from ..kernels.reference import (
    BASE_HELIX_ANGLE,
    COSINE,
    FULL,
    LINEAR,
    PERIOD,
    SINE,
    lanes_of,
    pan2021,
    run,
    state,
    system_of,
)
from .random_pairs import EVERY_SCENE, name_of, random_pairs
from .short_sweeps import simulation

TORSION = Effects(False, False, False, False, False)
LOOSE_TORSION = TORSION._replace(backlash=True)
REACH_OF_DECAY = 2.785293563405282


def fewest(effects: Effects, groups: Groups) -> np.ndarray:
    return fewest_stable_steps(system_of(groups, effects))


def oscillator(damping_ratio, mesh_frequency=0.01) -> Groups:
    """Return a spur pair: delta_5'' + 2 xi delta_5' + delta_5 = 0."""
    return pan2021(
        1.0, damping_ratio=damping_ratio, mesh_frequency=mesh_frequency, base_helix_angle=0.0
    )


@pytest.mark.parametrize("steps", [3, 57, 1000])
def test_undamped_oscillator_needs_steps_of_at_most_the_square_root_of_eight(steps):
    just_enough = 2.0 * np.pi / (np.sqrt(8.0) * steps)
    frequency = just_enough * np.array([1.0, 1.0 - 1e-6, 1.0 + 1e-6])
    found = fewest(TORSION, oscillator(0.0, frequency))
    assert found.tolist() == [steps, steps + 1, steps]


@pytest.mark.parametrize("damping_ratio", [1.0, 1.5, 2.0, 20.0])
def test_overdamped_oscillator_is_limited_by_its_fast_decay(damping_ratio):
    fast = damping_ratio + np.sqrt(damping_ratio**2 - 1.0)
    wanted = np.ceil(2.0 * np.pi / 0.01 * fast / REACH_OF_DECAY)
    assert fewest(TORSION, oscillator(damping_ratio)) == wanted


def test_mesh_damping_without_contact_is_a_branch_of_its_own():
    wanted = np.ceil(2.0 * np.pi / 0.01 * 4.0 / REACH_OF_DECAY)
    assert fewest(LOOSE_TORSION, oscillator(2.0)) == wanted
    assert fewest(TORSION, oscillator(2.0)) < wanted


def test_the_stiffest_moment_of_the_mesh_decides():
    scale = np.array([0.0, 2.0 / 3.0, -1.0])
    model = oscillator(0.0, np.full(3, 0.001))._replace(stiffness_variation_scale=scale)
    largest = [np.max(series_table(s * (COSINE - 1j * SINE), 20_000)) for s in scale]
    wanted = 2.0 * np.pi / 0.001 * np.sqrt(largest) / np.sqrt(8.0)
    found = fewest(TORSION._replace(stiffness_variation=True), model)
    assert found == pytest.approx(wanted, rel=1e-3)


def test_a_mode_that_grows_by_itself_sets_no_limit():
    # The lowest mesh stiffness, -0.5, has the exponents +-0.7; the highest sets the limit.
    model = oscillator(0.0)._replace(stiffness_variation_scale=np.ones(1))
    scene = TORSION._replace(stiffness_variation=True)
    found = fewest_stable_steps(GearPairs(scene, model, np.array([1.5]), np.zeros(1)))
    assert found == np.ceil(200.0 * np.pi * np.sqrt(2.5) / np.sqrt(8.0))


@pytest.mark.parametrize("scene", EVERY_SCENE, ids=name_of)
def test_limit_of_every_scene_is_that_of_its_whole_jacobian(scene):
    model = random_pairs(40, 7)
    stiffness = series_table((COSINE - 1j * SINE) * 2.0 / 3.0, 4096)
    extremes = [np.min(stiffness), np.max(stiffness)] if scene.stiffness_variation else [1.0]
    branches = [*extremes, 0.0] if scene.backlash else extremes
    demand = np.zeros(40)
    for tangential, axial in itertools.product(branches, repeat=2):
        system = system_of(model, scene)
        whole = jacobian(system, np.tile([tangential, axial][: system.elements], (40, 1)))
        demand = np.maximum(demand, steps_per_time(np.linalg.eigvals(whole)).max(axis=1))
    wanted = 2.0 * np.pi / model.mesh_frequency * demand
    found = fewest(scene, model)
    # The tolerances cover another sampling of the stiffness, and rounding up to whole steps.
    assert np.all(found >= wanted * (1.0 - 1e-3))
    assert np.all(found <= wanted * (1.0 + 1e-3) + 1.0)


def largest_state(model: Groups, steps: int) -> float:
    outcome = run(model, LINEAR, start_of_all_modes(), steps=steps, periods=400, points=1)
    if outcome.status[0] == Status.DIVERGED:
        return np.inf
    return float(np.max(np.abs(outcome.end_state)))


def start_of_all_modes() -> np.ndarray:
    return np.random.default_rng(1).standard_normal(10)


@pytest.mark.parametrize("lane", range(12))
def test_integration_grows_with_one_step_less_and_is_bounded_with_the_fewest(lane):
    model = lanes_of(random_pairs(12, 3), [lane])._replace(error_amplitude=np.zeros(1))
    steps = int(fewest(LINEAR, model)[0])
    assert largest_state(model, steps) < 1e3
    assert largest_state(model, steps - 1) > 1e6


def test_stiffer_bearings_never_need_fewer_steps():
    stiffness = np.geomspace(1e-3, 1e4, 500)
    dampings = [name for name in Groups._fields if "damping" in name]
    undamped = pan2021(1.0, **dict.fromkeys(dampings, 0.0))
    for name in ("transverse_stiffness_p", "axial_stiffness_g"):
        steps = fewest(FULL, pan2021(1.0, **undamped_with(undamped, name, stiffness)))
        assert np.all(np.diff(steps) >= 0)
        assert steps[-1] == np.ceil(2.0 * np.pi / undamped.mesh_frequency[0] * 100.0 / np.sqrt(8))


def undamped_with(model: Groups, name: str, values: np.ndarray) -> dict:
    return {**{group: value[0] for group, value in model._asdict().items()}, name: values}


def test_pan2021_is_stable_from_sixteen_steps_per_period_on_whatever_its_pitch_error():
    assert np.all(fewest(FULL, pan2021(np.linspace(0.0, 15.0, 1501))) == 16)


def test_a_lane_does_not_depend_on_its_neighbours_or_their_number():
    pairs = random_pairs(50, 5)
    many = np.random.default_rng(0).integers(0, 50, 40_000)
    alone = np.concatenate([fewest(FULL, lanes_of(pairs, [lane])) for lane in range(50)])
    assert np.array_equal(fewest(FULL, lanes_of(pairs, many)), alone[many])


def test_lanes_that_share_some_groups_but_not_all_are_distinguished():
    p, g = np.array([5.0, 5.0, 50.0, 50.0]), np.array([5.0, 500.0, 500.0, 2000.0])
    grid = pan2021(1.0, transverse_stiffness_p=p, transverse_stiffness_g=g)
    stiffest = np.sqrt(np.maximum.reduce([p, g, np.full(4, 36.315)]))
    wanted = PERIOD * stiffest / np.sqrt(8.0)
    assert fewest(FULL, grid) == pytest.approx(wanted, rel=0.02, abs=1.0)


def test_friction_stiffens_the_mesh_on_one_side_of_the_pitch_point():
    # delta_5'' = -cos(beta_b) (1 + mu lambda) delta_5; on that axis RK4 is stable up to sqrt(8).
    share, cosine = 0.5, np.cos(BASE_HELIX_ANGLE)
    model = pan2021(1.0, damping_ratio=0.0, friction_coefficient=share, friction_lever=1.0)
    wanted = PERIOD * 100.0 * np.sqrt(cosine * (1.0 + share) / 8.0)
    slow = model._replace(mesh_frequency=model.mesh_frequency / 100.0)
    assert fewest(TORSION._replace(friction=True), slow) == pytest.approx(wanted, abs=1.0)


def test_the_refusal_names_lanes_and_steps():
    swept = 'sweep={parameter="transverse_stiffness_g", from=10.0, to=1000.0, count=100}'
    fixed = ("groups.pitch_error=1.0", "integration.steps_per_period=60")
    with pytest.raises(ConfigurationError) as refused:
        simulation(swept, *fixed)
    stiffness = np.linspace(10.0, 1000.0, 100)
    steps = fewest(Effects(axial=False), pan2021(1.0, transverse_stiffness_g=stiffness))
    first = stiffness[steps > 60][0]
    (text,) = refused.value.problems
    assert text.split(": ", 1)[1] == (
        "integration.steps_per_period = 60: RK4 is unstable below "
        f"{steps.max()} steps per period for {np.sum(steps > 60)} of 100 lanes "
        f"(transverse_stiffness_g from {first:g} to 1000); "
        f'raise it to {steps.max()} or more, or set integration.unstable = "raise"'
    )


def test_the_refusal_of_two_parameters_names_both():
    both = (
        'sweep={parameter="damping_ratio", values=[2.0]}',
        'second_sweep={parameter="mesh_frequency", values=[0.01, 0.9]}',
        'scene.effects=["pitch_error"]',
        "integration.steps_per_period=100",
    )
    with pytest.raises(ConfigurationError) as refused:
        simulation(*both)
    text, *_ = refused.value.problems
    assert "1 of 2 lanes (mesh_frequency = 0.01, damping_ratio = 2); raise it to" in text


def test_steps_are_raised_to_the_limit_of_the_strictest_lane():
    swept = 'sweep={parameter="transverse_stiffness_g", from=10.0, to=1000.0, count=20}'
    raised = simulation(
        swept,
        "groups.pitch_error=1.0",
        "integration.steps_per_period=60",
        'integration.unstable="raise"',
        "start.kind=random",
        "start.count=3",
    )
    steps = fewest_stable_steps(raised.lanes.system_of(np.arange(60)))
    assert raised.plan.steps_per_period == steps.max()
    # The second note: exponents are inaccurate at the limit itself.
    note, further = raised.notes
    assert "shift Lyapunov exponents" in further
    assert f"raised from 60 to {steps.max()}" in note
    assert note.endswith(f"the stability limit of {np.sum(steps > 60)} of 60 lanes")


@pytest.mark.parametrize("direction", ["transverse", "axial"])
@pytest.mark.parametrize("gear", ["p", "g"])
def test_the_stiffest_bearing_sets_the_limit(direction, gear):
    model = pan2021(1.0, **{f"{direction}_stiffness_{gear}": 1e4})
    assert fewest(FULL, model)[0] == pytest.approx(PERIOD * 100.0 / np.sqrt(8.0), rel=0.02)


@pytest.mark.parametrize("name", ["transverse_stiffness_p", "damping_ratio", "axial_damping_g"])
def test_groups_beyond_all_measure_ask_for_more_steps_than_there_are(name):
    model = pan2021(1.0, **{name: np.array([1.0, 1e300, 1.7e308])})
    assert fewest(FULL, model)[1:].tolist() == [STEPS_CEILING, STEPS_CEILING]


def test_a_state_at_rest_without_load_stays_there_with_any_number_of_steps():
    outcome = run(pan2021(0.0, load=0.0), LINEAR, state(), steps=2, periods=50)
    assert np.all(outcome.end_state == 0.0)


def test_more_flow_maps_than_are_kept_are_reported():
    swept = "sweep={parameter='mesh_frequency',from=0.5,to=1.5,count=1000}"
    finer = "integration.steps_per_period=200"
    for settings, many in (
        ([swept, finer], True),
        ([swept, "integration.steps_per_period=12"], False),
        ([finer], False),
        # One lane has more maps than are kept, but all lanes share them.
        (["integration.steps_per_period=25000"], False),
        ([swept, finer, "outputs.loads=true"], True),
        ([swept, finer, "integration.method=rk4"], False),
    ):
        sweep = simulation("integration.method=flow_map", *settings)
        assert any("there are too many to keep" in note for note in sweep.notes) == many


def test_flow_maps_have_no_limit_and_say_so():
    sweep = simulation("integration.method=flow_map", "integration.steps_per_period=3")
    assert sweep.plan.steps_per_period == 3
    (note,) = sweep.notes
    assert note.endswith("RK4 would need 16 steps to be stable; flow maps have no such limit")


@pytest.mark.parametrize(("steps", "warned"), [(16, True), (25, True), (64, False), (200, False)])
def test_steps_that_are_stable_but_too_few_for_exponents_are_reported(steps, warned):
    sweep = simulation("integration.unstable='raise'", f"integration.steps_per_period={steps}")
    assert any("shift Lyapunov exponents" in note for note in sweep.notes) == warned


@pytest.mark.parametrize("steps", [20, 25, 40])
def test_the_shift_of_an_exponent_by_the_step_is_that_of_the_linear_pair(steps):
    linear = "groups.half_backlash=0.0", "groups.stiffness_variation_scale=0.0"
    system = simulation(*linear).lanes.system_of(np.arange(1))
    bias, true = exponent_bias(system, steps, "rk4")
    once = Plan(steps, 0, 1, 0, tangent=True)
    multipliers = np.linalg.eigvals(period_jacobian(system, np.zeros((1, 6)), once)[0])
    computed = np.log(np.abs(multipliers).max()) / system.mesh_period[0]
    assert true[0] + bias[0] == pytest.approx(computed, rel=1e-6)


def test_groups_whose_products_overflow_need_more_steps_than_there_are():
    groups = pan2021(1.0, damping_ratio=np.array([0.1, 1e300]), mass_ratio_g=1e300)
    found = fewest(FULL._replace(axial=True), groups)
    assert found.tolist() == [STEPS_CEILING, STEPS_CEILING]


def test_a_lane_that_overflows_leaves_the_limits_of_the_others():
    alone = fewest(TORSION, oscillator(np.array([0.1])))
    both = fewest(TORSION, oscillator(np.array([0.1, 1e200])))
    assert both[0] == alone[0] and both[1] == STEPS_CEILING
