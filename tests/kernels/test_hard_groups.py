"""Bearings, frequencies, damping and starts at the ends of their ranges."""

import numpy as np
import pytest
from gearchaos_kernels import Status, batch
from gearchaos_kernels.batch import steps_between_scalings

from .reference import (
    FLOW_MAP,
    FULL,
    LINEAR,
    NO_AXIAL,
    NO_BACKLASH,
    SOLUTIONS,
    TORSION,
    TORSION_ONLY,
    assert_same_bits,
    lanes_of,
    lanes_out_of,
    pan2021,
    run,
    state,
    system_of,
)
from .test_hard_cases import BOTH, assert_sound
from .test_linear import steady_state, system
from .test_order import measured_order

# Bearings


def test_stiff_bearings_approach_rigid_ones_like_the_inverse_of_their_stiffness():
    # The stiffest mode has 100 radians per unit of time. A period has 7 units and 1000 steps.
    stiffness = np.array([1e2, 1e3, 1e4])
    model = pan2021(
        np.full(3, 5.86),
        transverse_stiffness_p=stiffness,
        transverse_stiffness_g=stiffness,
        transverse_damping_p=0.5 * np.sqrt(stiffness),
        transverse_damping_g=0.5 * np.sqrt(stiffness),
    )
    how = {"steps": 1000, "transient": 300, "periods": 1, "points": 1, "resolved": True}
    outcome = run(model, NO_AXIAL, **how)
    rigid = run(pan2021(5.86), TORSION_ONLY, **how)
    assert_sound(outcome)
    distance = np.abs(outcome.section[:, 0, :2] - rigid.section[:, 0]).max(axis=1)
    assert measured_order(distance, stiffness) == pytest.approx(1.0, abs=0.25)
    assert distance[2] < 1e-3


@BOTH
def test_stiff_bearings_hold_in_the_full_scene_as_long_as_the_step_is_stable(resolved):
    model = pan2021(
        np.linspace(0.0, 15.0, 32),
        **{f"{way}_stiffness_{gear}": 1e4 for way in ("transverse", "axial") for gear in "pg"},
    )
    # h omega is 7.17 x 100 / 400 = 1.8.
    outcome = run(model, FULL, steps=400, transient=20, periods=100, resolved=resolved)
    assert_sound(outcome)
    assert np.abs(outcome.section[:, :, 2::2]).max() < 1e-3


@BOTH
def test_bearings_soft_as_none_give_the_motion_of_a_free_pair(resolved):
    def free(stiffness):
        bearings = {
            f"{way}_{what}_{gear}": value
            for way in ("transverse", "axial")
            for what, value in (("stiffness", stiffness), ("damping", 0.0))
            for gear in "pg"
        }
        return pan2021(5.86, **bearings)

    how = {"steps": 200, "periods": 20, "resolved": resolved}
    soft, none = run(free(1e-6), FULL, **how), run(free(0.0), FULL, **how)
    assert_sound(soft)
    # In 20 periods a bearing of stiffness 1e-6 moves a gear by 1e-6 tau^2/2 = 0.01 of its
    # displacement.
    reach = np.abs(none.section).max()
    assert soft.section == pytest.approx(none.section, rel=0, abs=0.02 * reach)
    assert np.abs(soft.section - none.section).max() > 0.0


# Frequencies and damping


@pytest.mark.parametrize(
    ("frequency", "steps"),
    [(0.01, 30_000), (0.03, 10_000), (0.1, 4000), (0.3, 1600), (1.0, 800), (3.0, 400), (10.0, 400)],
)
def test_the_analytic_response_repeats_at_every_mesh_frequency(frequency, steps):
    model = pan2021(5.86, mesh_frequency=frequency)
    wanted = steady_state(model, False)
    outcome = run(model, LINEAR, wanted, steps=steps, periods=3)
    size = 1.0 + np.abs(wanted).max()
    assert outcome.section[0] == pytest.approx(np.tile(wanted, (3, 1)), rel=0, abs=2e-8 * size)


@pytest.mark.parametrize("frequency", [0.01, 0.05, 0.2, 1.0, 5.0, 10.0])
@BOTH
def test_every_mesh_frequency_gives_a_finite_motion(resolved, frequency):
    # The fastest mode has 6 radians per unit of time, which is half a radian per step.
    steps = max(50, int(np.ceil(12.0 * 2.0 * np.pi / frequency)))
    # Flow maps choose the number of steps that they need.
    steps = 24 if resolved == FLOW_MAP else steps
    model = pan2021(np.linspace(0.0, 15.0, 32), mesh_frequency=frequency)
    start = state(delta_5=1.2)
    assert_sound(run(model, FULL, start, steps=steps, transient=2, periods=3, resolved=resolved))


@pytest.mark.parametrize("ratio", [0.0, 1e-3, 0.1, 0.5, 1.0, 2.0])
@BOTH
def test_every_damping_ratio_gives_a_finite_motion_that_settles_if_it_is_damped(resolved, ratio):
    model = pan2021([0.5, 5.86], damping_ratio=ratio)
    outcome = run(model, FULL, steps=200, transient=800, periods=50, points=50, resolved=resolved)
    assert_sound(outcome)
    if ratio >= 0.1:
        moved = np.abs(outcome.section - outcome.section[:, :1]).max()
        assert moved < 1e-6


@pytest.mark.parametrize("ratio", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("frequency", [0.01, 1.0])
def test_a_tangent_vector_stays_in_range_over_long_periods_and_gives_the_exponent(frequency, ratio):
    model = pan2021(0.0, load=0.0, damping_ratio=ratio, mesh_frequency=frequency)
    steps = int(np.ceil(15.0 * 2.0 * np.pi / frequency))
    periods = int(np.ceil(3000.0 * frequency / (2.0 * np.pi)))
    outcome = run(model, LINEAR, steps=steps, transient=periods, periods=periods, points=1)
    assert outcome.status.tolist() == [Status.OK]
    found = outcome.growth.sum() * frequency / (2.0 * np.pi * periods)
    largest = np.max(np.linalg.eigvals(system(model)[0]).real)
    assert found == pytest.approx(largest, rel=0, abs=2e-3)


@pytest.fixture
def scaled_every(monkeypatch):
    """Return a function that sets the number of steps between scalings of tangent vectors."""

    def set_interval(steps: int) -> None:
        monkeypatch.setattr(
            batch, "steps_between_scalings", lambda system, _: np.full(system.lanes, steps)
        )

    return set_interval


@pytest.mark.parametrize("between", [1, 7, 50])
@BOTH
def test_the_growth_does_not_depend_on_how_often_the_tangent_vector_is_scaled(
    resolved, between, scaled_every
):
    model = pan2021([5.86, 12.47])
    how = {"steps": 200, "transient": 5, "periods": 20, "resolved": resolved}
    scaled_every(200)
    once = run(model, FULL, **how)
    scaled_every(between)
    often = run(model, FULL, **how)
    assert often.growth == pytest.approx(once.growth, rel=0, abs=1e-10)
    assert np.array_equal(often.section, once.section)


@pytest.mark.parametrize("ratio", [2.0, -0.5], ids=["vanishes", "overflows"])
def test_a_tangent_vector_that_leaves_the_range_of_numbers_is_reported(ratio, scaled_every):
    # The vector leaves the range within one period. The kernels therefore scale it more often.
    model = pan2021(0.0, load=0.0, mesh_frequency=0.001, damping_ratio=ratio)
    how = {"steps": 20_000, "periods": 2}
    assert steps_between_scalings(system_of(model, TORSION), 20_000)[0] < 5000
    assert_sound(run(model, TORSION, **how))
    scaled_every(20_000)
    lost = run(model, TORSION, **how)
    assert lost.status.tolist() == [Status.DIVERGED]
    assert np.isnan(lost.growth).all()


def test_a_tangent_vector_is_scaled_at_its_own_interval_whatever_its_neighbours_need():
    frequency = np.array([0.005, 1.0, 0.03, 5.0, 0.011, 0.2])
    model = pan2021(np.full(6, 1.0), mesh_frequency=frequency, damping_ratio=0.5)
    how = {"steps": 9000, "periods": 2, "resolved": True}
    assert np.unique(steps_between_scalings(system_of(model), 9000)).size > 3
    together = run(model, FULL, **how)
    assert_sound(together)
    for lane in range(6):
        alone = run(lanes_of(model, [lane]), FULL, **how)
        assert_same_bits(lanes_out_of(together, [lane]), alone)


# Start states


@BOTH
def test_a_start_a_million_clearances_away_comes_back_to_the_periodic_motion(resolved):
    orbit = next(
        o for o in SOLUTIONS["periodic_orbits"] if o["scene"] == "full" and o["crossings"] == 4
    )
    rng = np.random.default_rng(1)
    start = 1e6 * rng.uniform(-1.0, 1.0, (32, 10))
    model = pan2021(np.full(32, orbit["pitch_error"]))
    outcome = run(
        model, FULL, start, steps=100, transient=2500, periods=1, points=1, resolved=resolved
    )
    assert_sound(outcome)
    wanted = np.array(orbit["section_points"][0])
    tolerance = 1e-4 if resolved else 1e-3
    home = np.abs(outcome.section[:, 0] - wanted).max(axis=1) < tolerance
    assert home.all()


@BOTH
def test_far_from_the_clearance_a_pair_moves_as_if_it_had_none(resolved):
    start = state(delta_5=1e6, delta_1_rate=-1e5, delta_3=3e5)
    how = {"steps": 400, "periods": 5}
    far = run(pan2021(5.86), FULL, start, **how, resolved=resolved)
    none = run(pan2021(5.86), NO_BACKLASH, start, **how)
    assert_sound(far)
    assert far.section == pytest.approx(none.section, rel=0, abs=50.0)
    assert np.abs(none.section).max() > 1e5
