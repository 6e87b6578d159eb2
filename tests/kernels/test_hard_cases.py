"""Scenes that break careless integrators, each with what must hold in it.

Step sizes lie within the stability limit of the method unless a test says otherwise: what happens
beyond it is the last part.
"""

import numpy as np
import pytest
from gearchaos_kernels import Scene, Status, batch
from gearchaos_kernels.coefficients import steps_between_scalings

from .reference import (
    BASE_HELIX_ANGLE,
    FULL,
    NO_AXIAL,
    NO_BACKLASH,
    OMEGA,
    SOLUTIONS,
    TORSION_ONLY,
    assert_same_bits,
    lanes_of,
    lanes_out_of,
    pan2021,
    run,
    state,
    stored_state,
)
from .test_linear import steady_state, system
from .test_order import measured_order

COS = np.cos(BASE_HELIX_ANGLE)
CLEARANCE = Scene(False, False, True, False, False)
"""Torsion with constant stiffness: nothing acts but load, mesh and clearance."""

UNDAMPED = {
    "damping_ratio": 0.0,
    "transverse_damping_p": 0.0,
    "transverse_damping_g": 0.0,
    "axial_damping_p": 0.0,
    "axial_damping_g": 0.0,
}
BOTH = pytest.mark.parametrize("resolved", [False, True], ids=["plain", "resolved"])


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
    none = run(model, NO_BACKLASH, **how)
    assert_sound(tiny)
    # A split step is two shorter ones: what differs is the error of the method, not the clearance.
    assert tiny.section == pytest.approx(none.section, rel=0, abs=2e-6)
    # Its slope is that of the free gap for no more than a step now and then.
    total, wanted = (np.cumsum(outcome.growth, axis=1) for outcome in (tiny, none))
    assert total == pytest.approx(wanted, rel=0, abs=0.01)


@BOTH
def test_a_clearance_that_is_never_crossed_leaves_a_free_gap_with_its_damping(resolved):
    # N_y is 2 xi y' alone: under the load the gears run away to the speed that damping allows.
    model = pan2021(0.0, half_backlash=1e9, load=0.3)
    outcome = run(model, CLEARANCE, steps=100, periods=200, resolved=resolved)
    assert_sound(outcome)
    assert outcome.crossings.tolist() == [0]
    rate = 2.0 * model.damping_ratio[0] * COS
    tau = 2.0 * np.pi / OMEGA * np.arange(1, 201)
    speed = 0.3 / rate * -np.expm1(-rate * tau)
    assert outcome.section[0, :, 5] == pytest.approx(speed, rel=1e-9)
    assert outcome.section[0, :, 0] == pytest.approx((0.3 * tau - speed) / rate, rel=1e-9)


@BOTH
def test_a_huge_clearance_that_is_met_is_met_once_and_held(resolved):
    model = pan2021(0.0, half_backlash=1e9, load=1e3, damping_ratio=2.0)
    start = state(delta_5=1e9 * COS - 1e3)
    outcome = run(model, CLEARANCE, start, steps=400, periods=40, resolved=resolved)
    assert_sound(outcome)
    if resolved:
        assert outcome.crossings.tolist() == [1]
    held = 1e9 * COS + 1e3 / COS
    assert outcome.end_state[0, 0] == pytest.approx(held, rel=1e-12)


# Contact that is grazed, lost and hit


@pytest.mark.parametrize("excess", [-1e-3, -1e-9, 0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
@BOTH
def test_a_grazing_motion_is_the_motion_in_contact_as_near_as_it_grazes(resolved, excess):
    load, half_backlash = 0.3, 0.5
    deflection = load / COS
    model = pan2021(0.0, load=load, half_backlash=half_backlash, damping_ratio=0.0)
    amplitude = (1.0 + excess) * deflection
    middle = half_backlash * COS + deflection
    periods = 10
    outcome = run(
        model,
        CLEARANCE,
        state(delta_5=middle + amplitude),
        steps=400,
        periods=periods,
        resolved=resolved,
    )
    assert_sound(outcome)
    tau = 2.0 * np.pi / OMEGA * np.arange(1, periods + 1)
    wanted = middle + amplitude * np.cos(np.sqrt(COS) * tau)
    # Off the flank for a time like the root of the excess, and by the excess: the power 3/2.
    departure = 20.0 * max(excess, 0.0) ** 1.5
    method = 1e-7 if resolved else 1e-6
    assert outcome.section[0, :, 0] == pytest.approx(wanted, rel=0, abs=departure + method)
    if resolved:
        # In and out: once or not at all for each oscillation, and always both.
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
        # Without load nothing prefers a side: across the gap and back in every period.
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
    scene = Scene(pitch_error=False)
    how = {"steps": 100, "transient": 600, "periods": 1, "points": 1, "resolved": resolved}
    model = pan2021(0.0)
    forward = run(model, scene, **how)
    turned = model._replace(load=-model.load)
    backward = run(turned, scene, forward.end_state, **how)
    assert_sound(backward)
    assert forward.section[0, 0, 0] > 0.5
    assert backward.section == pytest.approx(-forward.section, rel=0, abs=1e-7)
    again = run(model, scene, backward.end_state, **how)
    assert again.section == pytest.approx(forward.section, rel=0, abs=1e-7)


@BOTH
def test_any_pitch_error_up_to_a_hundred_multiples_gives_a_bounded_motion(resolved):
    multiples = np.linspace(0.0, 100.0, 96)
    model = pan2021(multiples)
    outcome = run(model, FULL, steps=100, transient=100, periods=200, resolved=resolved)
    assert_sound(outcome)
    # The response of the pair is far from ten times its resonance at rest.
    reach = model.half_backlash + 10.0 * (model.load + model.error_amplitude)
    assert (np.abs(outcome.section).max(axis=(1, 2)) < 3.0 * reach).all()


# Bearings


def test_stiff_bearings_approach_rigid_ones_like_the_inverse_of_their_stiffness():
    # The stiffest mode has a hundred radians in a unit of time: 7 units a period, 1000 steps.
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
    distance = np.abs(outcome.section[:, 0, [0, 5]] - rigid.section[:, 0, [0, 5]]).max(axis=1)
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
    assert np.abs(outcome.section[:, :, 1:5]).max() < 1e-3


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
    # A bearing of 1e-6 acts by 1e-6 tau^2/2 = 0.01 of its displacement in 20 periods.
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
    linear = Scene(stiffness_variation=False, backlash=False)
    wanted = steady_state(model, False)
    outcome = run(model, linear, wanted, steps=steps, periods=3)
    size = 1.0 + np.abs(wanted).max()
    assert outcome.section[0] == pytest.approx(np.tile(wanted, (3, 1)), rel=0, abs=2e-8 * size)


@pytest.mark.parametrize("frequency", [0.01, 0.05, 0.2, 1.0, 5.0, 10.0])
@BOTH
def test_every_mesh_frequency_gives_a_finite_motion(resolved, frequency):
    # 6 rad per unit of time is the fastest mode: half a radian a step.
    steps = max(50, int(np.ceil(12.0 * 2.0 * np.pi / frequency)))
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
    linear = Scene(False, False, False, True, True)
    steps = int(np.ceil(15.0 * 2.0 * np.pi / frequency))
    periods = int(np.ceil(3000.0 * frequency / (2.0 * np.pi)))
    outcome = run(model, linear, steps=steps, transient=periods, periods=periods, points=1)
    assert outcome.status.tolist() == [Status.OK]
    found = outcome.growth.sum() * frequency / (2.0 * np.pi * periods)
    largest = np.max(np.linalg.eigvals(system(model)[0]).real)
    assert found == pytest.approx(largest, rel=0, abs=2e-3)


@pytest.fixture
def scaled_every(monkeypatch):
    """Set after how many steps every tangent vector is scaled."""

    def set_interval(steps: int) -> None:
        monkeypatch.setattr(
            batch, "steps_between_scalings", lambda model, _: np.full(model.load.size, steps)
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
    # One period is far too long for it, and the kernels know: they scale it more often.
    model = pan2021(0.0, load=0.0, mesh_frequency=0.001, damping_ratio=ratio)
    scene = Scene(False, False, False, False, False)
    how = {"steps": 20_000, "periods": 2}
    assert steps_between_scalings(model, 20_000)[0] < 5000
    assert_sound(run(model, scene, **how))
    scaled_every(20_000)
    lost = run(model, scene, **how)
    assert lost.status.tolist() == [Status.DIVERGED]
    assert np.isnan(lost.growth).all()


def test_a_tangent_vector_is_scaled_at_its_own_interval_whatever_its_neighbours_need():
    frequency = np.array([0.005, 1.0, 0.03, 5.0, 0.011, 0.2])
    model = pan2021(np.full(6, 1.0), mesh_frequency=frequency, damping_ratio=0.5)
    how = {"steps": 9000, "periods": 2, "resolved": True}
    assert np.unique(steps_between_scalings(model, 9000)).size > 3
    together = run(model, FULL, **how)
    assert_sound(together)
    for lane in range(6):
        alone = run(lanes_of(model, [lane]), FULL, **how)
        assert_same_bits(lanes_out_of(together, [lane]), alone)


# Start states


@BOTH
def test_a_start_a_million_clearances_away_comes_back_to_the_periodic_motion(resolved):
    orbit = next(
        o for o in SOLUTIONS["periodic_orbits"] if o["scene"] == "no_axial" and o["crossings"] == 2
    )
    rng = np.random.default_rng(1)
    start = 1e6 * rng.uniform(-1.0, 1.0, (32, 10))
    model = pan2021(np.full(32, orbit["pitch_error"]))
    outcome = run(
        model, NO_AXIAL, start, steps=100, transient=2500, periods=1, points=1, resolved=resolved
    )
    assert_sound(outcome)
    wanted = stored_state(orbit["section_points"][0])
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


# Beyond the stability limit of the method


def swinging(radians_a_step: np.ndarray, steps: int = 20):
    """Return lanes whose mesh, in contact, turns by so many radians a step."""
    frequency = 2.0 * np.pi * np.sqrt(COS) / (steps * radians_a_step)
    return pan2021(np.full(radians_a_step.size, 5.86), mesh_frequency=frequency)


@pytest.mark.parametrize("scene", [CLEARANCE, TORSION_ONLY], ids=["constant", "varying"])
@BOTH
def test_a_run_far_beyond_the_stability_limit_diverges_in_a_few_periods(resolved, scene):
    model = swinging(np.linspace(4.5, 15.0, 64))
    outcome = run(
        model, scene, state(delta_5=1.0), steps=20, transient=0, periods=60, resolved=resolved
    )
    assert (outcome.status == Status.DIVERGED).all()
    assert (outcome.diverged_period >= 0).all()
    assert np.isnan(outcome.end_state).all()
    for lane, period in enumerate(outcome.diverged_period):
        assert np.isfinite(outcome.section[lane, :period]).all()
        assert np.isnan(outcome.section[lane, period:]).all()


@BOTH
def test_just_beyond_the_limit_lost_contact_bounds_what_the_method_blows_up(resolved):
    # Between 2.83 and 3.3 radians a step the method amplifies in contact and not off the flank:
    # the run neither diverges nor means anything, in a scene that can only settle. No status tells
    # it, which is why the limit is computed before a run.
    below, beyond = swinging(np.array([2.5, 2.7])), swinging(np.array([3.0, 3.1]))
    how = {"steps": 20, "transient": 500, "periods": 500, "points": 10, "resolved": resolved}
    rest = state(delta_5=1.0)
    settled = run(below, CLEARANCE, rest, **how)
    assert_sound(settled)
    held = 0.94518 * COS + below.load[0] / COS
    assert settled.section[:, :, 0] == pytest.approx(held, rel=0, abs=1e-6)
    blown = run(beyond, CLEARANCE, rest, **how)
    assert (blown.status == Status.OK).all()
    assert (np.ptp(blown.section[:, :, 0], axis=1) > 0.01).all()


def test_split_steps_can_hold_an_unstable_bearing_which_leaps_across_the_clearance():
    # Its gear leaps from flank to flank in every step, each of which is then split in stable parts.
    # Plain steps run away. Again no status tells it; the number of crossings does.
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


@BOTH
def test_a_lane_out_of_the_range_of_numbers_within_a_period_stops_as_diverged(resolved):
    # Beyond all numbers, a gap has no moment at which it crosses: nothing is split or counted.
    start = np.stack([state(delta_5=value) for value in (1e300, -1e307)])
    outcome = run(swinging(np.full(2, 12.0)), CLEARANCE, start, steps=20, resolved=resolved)
    assert outcome.status.tolist() == [Status.DIVERGED] * 2
    assert outcome.diverged_period.tolist() == [0, 0]
    assert outcome.crossings.tolist() == outcome.overflows.tolist() == [0, 0]
    assert outcome.slowest_crossing.tolist() == [np.inf] * 2
