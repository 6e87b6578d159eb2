"""Pitch errors of single teeth: their shares, their repetition, and independent lanes."""

import numba
import numpy as np
import pytest
from gearchaos_kernels import LANES, Effects, Plan, Teeth, integrate, mesh_motion
from gearchaos_kernels.models.gear_pair.teeth import share_table
from scipy.interpolate import BSpline

from .reference import FULL, assert_same_bits, drawn_teeth, lanes_out_of, pan2021, run, system_of
from .test_determinism import joined
from .test_evaluation import accelerations, lane
from .test_teeth_order import spur_teeth
from .twin import Twin, shared_error

STEPS = 60
TOTAL = 2 * LANES + 5
"""Number of lanes; each one has its own teeth."""
MODEL = pan2021(np.linspace(1.0, 15.0, TOTAL), error_mean=np.linspace(-0.1, 0.1, TOTAL))
START = np.random.default_rng(7).uniform(-1.5, 1.5, (TOTAL, 10))
TEETH = drawn_teeth(4, 6, TOTAL)
SYSTEM = system_of(MODEL, teeth=TEETH)
PLAN = Plan(STEPS, 2, 10, 5, tangent=True, history_periods=1)


def follow(chosen=slice(None), teeth: Teeth = TEETH, **plan):
    """Integrate some lanes of this test, with resolved steps."""
    system = SYSTEM.replace(teeth=teeth).of(chosen)
    return integrate(system, START[chosen], PLAN._replace(**plan))


@pytest.fixture(scope="module")
def whole():
    return follow()


@pytest.mark.parametrize(
    "teeth",
    [drawn_teeth(3, 2), spur_teeth(3, 2, 1), drawn_teeth(3, 2, contact_ratio=6.4)],
    ids=["helical", "spur", "seven pairs"],
)
def test_the_shares_are_splines_that_add_up_to_one(teeth):
    table = share_table(teeth, STEPS)
    cells = teeth.cells_per_period
    knots = teeth.begins + teeth.ahead + np.arange(-5, teeth.share.size + 11) / cells
    spline = BSpline(knots, np.pad(teeth.share, 5), 5, extrapolate=False)
    phase = np.arange(2 * STEPS + 1) / (2 * STEPS)
    pairs = 1 + table.shape[2]
    for order in range(3):
        places = phase[:, np.newaxis] + np.arange(pairs)
        shares = np.nan_to_num(spline.derivative(order)(places)) / (2.0 * np.pi) ** order
        # The place within the cells is rounded, too.
        tolerance = 1e-14 * (cells / (2.0 * np.pi)) ** order
        assert table[:, order] == pytest.approx(shares[:, 1:], rel=0, abs=tolerance)
        assert shares.sum(axis=1) == pytest.approx(float(order == 0), rel=0, abs=tolerance)
    # The end of a mesh period is the beginning of the next one, with each pair one place later.
    assert np.array_equal(table[-1, :, :-1], table[0, :, 1:])


@pytest.mark.parametrize("entry", [0.0, 0.05, 0.125, 0.3, 0.99])
@pytest.mark.parametrize("first", [0, 7])
def test_a_pair_comes_into_mesh_at_its_own_phase(entry, first):
    # Only pair 0 has an error, once in five periods. A cell is a twentieth of a period.
    teeth = spur_teeth(1, 5, 1)._replace(entry=entry, profile=np.zeros(3, np.intp))
    teeth = teeth._replace(driving=np.zeros((1, 1)), driven=np.eye(5)[:1])
    model = MODEL._replace(error_mean=np.zeros(TOTAL), error_amplitude=np.ones(TOTAL))
    system = system_of(model, teeth=teeth).replace(physical=True).of([0, 1, 2])
    states = np.zeros((3, 5 * STEPS + 1, 10))
    error = mesh_motion(system, states, STEPS, first).pitch_error[0]
    phase = first + np.arange(error.size) / STEPS
    wanted = [shared_error(teeth, 0, at)[0] for at in phase]
    assert error == pytest.approx(np.array(wanted), rel=0, abs=1e-12)
    since = (phase - entry + 1.0) % 5.0 - 1.0
    margin = 3.0 / teeth.cells_per_period
    apart = (since < -margin) | (since > 1.5 + margin)
    assert np.abs(error[apart]).max() < 1e-14 and apart.sum() > STEPS
    assert error[(since > margin) & (since < 0.5 - margin)] == pytest.approx(0.5)
    assert error[(since > 0.5 + margin) & (since < 1.0 - margin)] == pytest.approx(1.0)


def test_more_than_seven_pairs_in_mesh_are_refused():
    with pytest.raises(ValueError, match="8 tooth pairs in mesh at once, more than 7"):
        run(pan2021(1.0), teeth=drawn_teeth(3, 2, contact_ratio=7.0))


def test_seven_pairs_in_mesh_act_as_those_of_the_twin():
    scene = Effects(backlash=False, transverse=False, axial=False)
    teeth = drawn_teeth(3, 5, contact_ratio=6.4)
    outcome = run(pan2021(5.86), scene, steps=STEPS, periods=4, teeth=teeth)
    groups = lane(pan2021(5.86), 0)
    groups.profile = 0
    wanted = Twin(groups, scene, False, teeth).integrate(np.zeros(10), STEPS, 4)
    assert outcome.section[0] == pytest.approx(wanted.states[:, :2], rel=0, abs=2e-11)


def equal_teeth(error: float, driving: int, driven: int) -> Teeth:
    """Return teeth with the same error for every pair."""
    shared = drawn_teeth(1, 1)
    profile = np.zeros(TOTAL, dtype=np.intp)
    return shared._replace(
        driving=np.full((1, driving), -0.25 * error),
        driven=np.full((1, driven), 0.75 * error),
        profile=profile,
    )


@pytest.mark.parametrize(("driving", "driven"), [(4, 6), (1, 6), (1, 1)])
def test_teeth_with_the_same_error_have_an_error_mean_and_no_more(driving, driven):
    def with_mean(error: float):
        mean = MODEL.error_mean + error * MODEL.error_amplitude
        groups = MODEL._replace(error_mean=mean, error_amplitude=np.zeros(TOTAL))
        return integrate(SYSTEM.replace(groups=groups, teeth=None), START, PLAN)

    assert_same_bits(follow(teeth=equal_teeth(1.0, driving, driven)), with_mean(1.0))
    found = follow(teeth=equal_teeth(-0.3, driving, driven))
    assert found.history == pytest.approx(with_mean(-0.3).history, rel=0, abs=1e-11)


def test_the_excitation_repeats_when_the_same_teeth_meet(whole):
    assert SYSTEM.repeats_after == 12
    assert SYSTEM.replace(effects=FULL._replace(pitch_error=False)).repeats_after == 1
    assert SYSTEM.excitation_period == pytest.approx(12.0 * SYSTEM.mesh_period)
    for turned in (12, 24, 12 * 10**9):
        assert_same_bits(follow(first_period=turned), whole)
    for turned in (4, 6):
        other = follow(first_period=turned)
        assert not np.any(np.all(other.section == whole.section, axis=(1, 2)))


@pytest.mark.parametrize("turned", [1, 5, 11])
def test_other_teeth_first_are_the_same_teeth_in_another_order(turned):
    rolled = TEETH._replace(
        driving=np.roll(TEETH.driving, -turned, axis=1),
        driven=np.roll(TEETH.driven, -turned, axis=1),
    )
    assert_same_bits(follow(first_period=turned), follow(teeth=rolled))


def test_a_motion_goes_on_with_the_teeth_that_it_has_come_to():
    first = follow(recorded_periods=5)
    second = integrate(
        SYSTEM,
        first.end_state,
        PLAN._replace(transient_periods=0, recorded_periods=5, first_period=7),
        tangent_start=first.end_tangent,
    )
    # States are stored in the units of eq. 13, which rounds them.
    assert second.section == pytest.approx(follow().section, rel=0, abs=1e-11)


def test_a_lane_is_the_same_among_any_neighbours(whole):
    order = np.random.default_rng(3).permutation(TOTAL)
    assert_same_bits(follow(order), lanes_out_of(whole, order))
    for size in (7, LANES, LANES + 1):
        parts = [follow(slice(first, first + size)) for first in range(0, TOTAL, size)]
        assert_same_bits(joined(parts), whole)
    for number in (0, LANES, TOTAL - 1):
        assert_same_bits(follow([number]), lanes_out_of(whole, [number]))
    assert np.unique(whole.end_state[:, 0]).size == TOTAL


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="needs two threads")
def test_any_number_of_threads_gives_the_same_bits(whole):
    threads = numba.get_num_threads()
    try:
        for number in (1, 2):
            numba.set_num_threads(number)
            assert_same_bits(follow(), whole)
    finally:
        numba.set_num_threads(threads)


@pytest.mark.parametrize("physical", [False, True])
def test_forces_along_a_motion_are_those_of_the_teeth_then_in_mesh(physical):
    first = 8
    system = SYSTEM.replace(physical=physical).of([0, LANES, TOTAL - 1])
    plan = Plan(STEPS, 2, 2, 0, tangent=True, history_periods=2, first_period=first)
    states = integrate(system, START[: system.lanes], plan).history
    motion = mesh_motion(system, states, STEPS, first + 2)
    for number in range(system.lanes):
        groups = lane(system.groups, number)
        groups.profile = system.teeth.profile[number]
        twin = Twin(groups, FULL, physical, system.teeth)
        step = 2.0 * np.pi / groups.mesh_frequency / STEPS
        tau = ((first + 2) * STEPS + np.arange(2 * STEPS + 1)) * step
        wanted = np.array(
            [accelerations(twin, *at) for at in zip(tau, states[number], strict=True)]
        )
        # The order is that of the coordinates: delta_5 first, as in the twin.
        assert motion.accelerations[number] == pytest.approx(wanted, rel=0, abs=1e-10)
        forces = np.array([mesh_forces(twin, *at) for at in zip(tau, states[number], strict=True)])
        found = np.stack([motion.force_tangential[number], motion.force_axial[number]], axis=1)
        assert found == pytest.approx(forces, rel=0, abs=1e-11)


def mesh_forces(twin: Twin, tau: float, state: np.ndarray) -> list[float]:
    """Return N_y and N_z of the twin at one state in the order of `STATES`."""
    error, error_rate, _ = twin.error(tau)
    beta, damping = twin.groups.base_helix_angle, 2.0 * twin.groups.damping_ratio
    limits = twin.groups.half_backlash * np.array([np.cos(beta), np.sin(beta)])
    gaps = twin.relative(state[0::2], error)
    rates = twin.damped_rates(state[1::2], error_rate)
    return [
        twin.stiffness(tau) * twin.clearance(gap, limit)[0] + damping * rate
        for gap, rate, limit in zip(gaps, rates, limits, strict=True)
    ]
