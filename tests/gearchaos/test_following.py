"""Orbits lose stability as their multipliers predict, also at bifurcations of Pan 2021's pair."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate

from gearchaos.dynamics.following import Followed, follow
from gearchaos.dynamics.orbits import polish
from gearchaos.dynamics.stability_loss import (
    CONFIRMED,
    STABILITY_LOSS_TEXTS,
    StabilityLoss,
    loss_of_stability,
)
from gearchaos.records.period import coordinate_scale, motion_period

from ..kernels.reference import NO_AXIAL, pan2021, system_of

STEPS = 200
WIDTH = 1e-5

WAYS = {
    "period 1 doubles": (10.2, 10.35, 1, StabilityLoss.PERIOD_DOUBLING),
    "period 2 doubles": (11.35, 11.45, 2, StabilityLoss.PERIOD_DOUBLING),
    "period 3 doubles downwards": (12.97, 12.87, 3, StabilityLoss.PERIOD_DOUBLING),
    "lower period 1 ends": (1.03, 2.0, 1, StabilityLoss.FOLD),
    "upper period 1 ends downwards": (1.07, 0.7, 1, StabilityLoss.FOLD),
    "period 3 ends": (12.97, 13.1, 3, StabilityLoss.FOLD),
    "upper period 1 continues": (1.07, 3.0, 1, StabilityLoss.STAYS_STABLE),
    "period 2 ends in period 1": (10.6, 10.2, 2, StabilityLoss.PERIOD_HALVING),
}
NAMES = list(WAYS)
FIRST, LAST, PERIODS, KINDS = (np.array(column) for column in zip(*WAYS.values(), strict=True))
FOLDS = np.flatnonzero(KINDS == StabilityLoss.FOLD)
DOUBLINGS = np.flatnonzero(KINDS == StabilityLoss.PERIOD_DOUBLING)


def run(multiples, start, transient: int):
    plan = Plan(STEPS, transient, 48, 48, tangent=True)
    return integrate(system_at(multiples), start, plan)


def system_at(multiples):
    return system_of(pan2021(multiples), NO_AXIAL)


def followed_from(start, period, first, last, width=WIDTH) -> Followed:
    period = np.asarray(period, dtype=np.int32)
    first, last = np.asarray(first), np.asarray(last)
    return follow(system_at, start, period, first, last, width, Plan(STEPS, 0, 0, 0))


@pytest.fixture(scope="module")
def begin() -> np.ndarray:
    settled = run(FIRST, np.zeros((FIRST.size, 6)), 500)
    assert np.array_equal(motion_period(settled.section), PERIODS)
    return settled.end_state


@pytest.fixture(scope="module")
def followed(begin) -> Followed:
    return followed_from(begin, PERIODS, FIRST, LAST)


@pytest.mark.parametrize(
    ("stable", "beyond", "kind", "multiplier"),
    [
        ([-0.99, 0.5], [-1.01, 0.5], StabilityLoss.PERIOD_DOUBLING, -1.01),
        ([0.99, 0.5], [1.01, 0.5], StabilityLoss.FOLD, 1.01),
        ([0.8 - 0.5j, 0.8 + 0.5j], [0.8 - 0.7j, 0.8 + 0.7j], "NEIMARK_SACKER", 0.8 + 0.7j),
        ([-0.99, 0.5], [-0.99, 0.5], StabilityLoss.STAYS_STABLE, -0.99),
        ([0.5, 0.2], [np.nan, np.nan], StabilityLoss.NOT_FOLLOWED, np.nan),
        ([-0.99, 0.5], [np.nan, np.nan], StabilityLoss.NOT_FOLLOWED, np.nan),
        ([0.7 + 0.7j, 0.7 - 0.7j], [np.nan, np.nan], StabilityLoss.NOT_FOLLOWED, np.nan),
        # The multiplier that reaches +1 need not be the largest one before.
        ([-0.98, 0.97], [np.nan, np.nan], StabilityLoss.FOLD, 0.97),
        ([np.nan, np.nan], [np.nan, np.nan], StabilityLoss.NOT_FOLLOWED, np.nan),
        ([np.nan, np.nan], [-1.01, 0.5], StabilityLoss.NOT_FOLLOWED, np.nan),
        # An unstable orbit of another branch, and orbits that are unstable for another reason.
        ([0.2, 0.1], [2.69, 0.0], StabilityLoss.UNCONFIRMED, 2.69),
        ([-0.8, 0.5], [-1.01, 0.5], StabilityLoss.UNCONFIRMED, -1.01),
        ([-0.99, 0.5], [-1.2, 0.5], StabilityLoss.UNCONFIRMED, -1.2),
        ([-0.99, 0.5], [1.01, 0.5], StabilityLoss.UNCONFIRMED, 1.01),
        ([0.99, 0.5], [0.8 + 0.7j, 0.8 - 0.7j], StabilityLoss.UNCONFIRMED, 0.8 + 0.7j),
        # The multiplier that leaves the unit circle need not be the largest one before.
        ([-0.99, 0.98], [1.01, -0.99], StabilityLoss.FOLD, 1.01),
    ],
)
def test_the_multiplier_that_leaves_the_unit_circle_reports_the_kind(
    stable, beyond, kind, multiplier
):
    sides = (np.array([side], dtype=complex) for side in (stable, beyond))
    (told,), (found,) = loss_of_stability(*sides)
    kind = StabilityLoss[kind] if isinstance(kind, str) else kind
    assert StabilityLoss(told) == kind
    assert found == pytest.approx(multiplier, nan_ok=True)
    assert abs(found) == pytest.approx(abs(multiplier), nan_ok=True)


def test_every_kind_has_a_text():
    assert len(STABILITY_LOSS_TEXTS) == len(StabilityLoss)


def test_orbits_of_pan_2021_lose_stability_in_these_ways(followed):
    found = dict(zip(NAMES, map(StabilityLoss, followed.loss), strict=True))
    assert found == {name: kind for name, (*_, kind) in WAYS.items()}


def test_the_brackets_are_as_narrow_as_wanted_and_stable_on_one_side(followed):
    assert np.all(np.abs(followed.beyond_value - followed.stable_value) <= WIDTH)
    assert np.all(np.abs(followed.stable.multipliers) < 1.0)
    stays = NAMES.index("upper period 1 continues")
    assert followed.stable_value[stays] == followed.beyond_value[stays] == LAST[stays]


def test_every_loss_has_a_multiplier_on_the_unit_circle_on_both_sides(followed):
    lost = ~np.isin(KINDS, (StabilityLoss.STAYS_STABLE, StabilityLoss.PERIOD_HALVING))
    inside, outside = (side.multipliers[lost, 0] for side in (followed.stable, followed.beyond))
    assert np.all(np.abs(inside) < 1.0)
    assert np.all(np.abs(outside) >= 1.0)
    # At the steepest doubling, the multiplier changes by 1 over 0.01.
    assert np.abs(inside - outside).max() < 100.0 * WIDTH < CONFIRMED
    assert followed.multiplier[FOLDS] == pytest.approx(1.0, rel=0, abs=2e-6)


def test_half_the_width_behind_a_fold_there_is_no_orbit(followed):
    behind, points = followed.beyond_value[FOLDS], followed.stable.points[FOLDS]
    width = np.abs(behind - followed.stable_value[FOLDS])
    assert width == pytest.approx(WIDTH / 2.0, rel=1e-3)
    found = polish(system_at(behind), points, PERIODS[FOLDS].astype(np.int32), Plan(STEPS, 0, 0, 0))
    assert not found.converged.any()


def test_an_orbit_born_in_a_period_doubling_is_followed_back_to_it(followed):
    (halving,) = np.flatnonzero(KINDS == StabilityLoss.PERIOD_HALVING)
    doubling = NAMES.index("period 1 doubles")
    born = followed.stable_value[halving], followed.beyond_value[halving]
    assert born == pytest.approx(2 * (followed.stable_value[doubling],), rel=0, abs=2 * WIDTH)
    assert followed.multiplier[halving] == pytest.approx(1.0, rel=0, abs=1e-3)


def test_a_fold_is_located_alike_whatever_the_width(followed, begin):
    coarse = followed_from(begin[FOLDS], PERIODS[FOLDS], FIRST[FOLDS], LAST[FOLDS], 1e-2)
    assert np.all(coarse.loss == StabilityLoss.FOLD)
    assert coarse.stable_value == pytest.approx(followed.stable_value[FOLDS], rel=0, abs=1e-7)


def test_a_multiplier_passes_minus_one_where_the_period_doubles(followed):
    inside, outside = (
        side.multipliers[DOUBLINGS, 0] for side in (followed.stable, followed.beyond)
    )
    assert np.all((inside.imag == 0.0) & (outside.imag == 0.0))
    assert np.all((inside.real > -1.0) & (outside.real < -1.0))
    assert inside.real == pytest.approx(-1.0, abs=1e-3)
    assert outside.real == pytest.approx(-1.0, abs=1e-3)


def test_motions_double_their_period_where_the_multiplier_passes_minus_one(followed):
    there = followed.stable_value[DOUBLINGS]
    onward = np.sign(LAST - FIRST)[DOUBLINGS]
    start = followed.stable.points[DOUBLINGS] + 1e-4
    before = motion_period(run(there - 5e-3 * onward, start, 3000).section)
    after = motion_period(run(there + 5e-3 * onward, start, 3000).section)
    assert np.array_equal(before, PERIODS[DOUBLINGS])
    assert np.array_equal(after, 2 * PERIODS[DOUBLINGS])


def test_motions_leave_where_the_orbit_ends(followed):
    there = followed.stable_value[FOLDS]
    onward = np.sign(LAST - FIRST)[FOLDS]
    start = followed.stable.points[FOLDS]
    stayed = run(there - 1e-3 * onward, start, 500)
    left = run(there + 1e-3 * onward, start, 500)
    distances = [
        np.max(np.abs(one.section - start[:, np.newaxis]), axis=2).min(axis=1)
        for one in (stayed, left)
    ]
    assert np.all(distances[0] < 0.05)
    assert np.array_equal(motion_period(stayed.section), PERIODS[FOLDS])
    assert np.all(distances[1] > 5.0 * distances[0])


@pytest.mark.slow
def test_a_multiplier_nears_one_like_the_root_of_the_distance_from_a_fold(followed):
    near, start = followed.stable_value[FOLDS], followed.stable.points[FOLDS]
    fold = followed_from(start, PERIODS[FOLDS], near, followed.beyond_value[FOLDS], 1e-8)
    distances = 3e-5 / 3.0 ** np.arange(3)
    lanes = np.repeat(np.arange(FOLDS.size), distances.size)
    onward = np.sign(LAST - FIRST)[FOLDS][lanes]
    short_of = fold.stable_value[lanes] - onward * np.tile(distances, FOLDS.size)
    found = followed_from(start[lanes], PERIODS[FOLDS][lanes], near[lanes], short_of, 1e-8)
    assert found.stable_value == pytest.approx(short_of, rel=1e-12)
    multipliers = found.stable.multipliers
    largest = np.max(np.where(multipliers.imag == 0.0, multipliers.real, 0.0), axis=1)
    margins = np.log(1.0 - largest).reshape(-1, distances.size)
    exponents = np.diff(margins, axis=1) / np.diff(np.log(distances))
    # The difference of the exponents from their limit also falls like the root of the distance.
    ratio = 3.0**-0.5
    limit = (exponents[:, 1] - ratio * exponents[:, 0]) / (1.0 - ratio)
    assert np.all(np.abs(exponents[:, 1] - 0.5) < np.abs(exponents[:, 0] - 0.5))
    assert limit == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("name", ["lower period 1 ends", "period 3 ends"])
def test_beyond_a_fold_newton_takes_no_step_that_hardly_helps(followed, begin, name):
    """A quarter of a step must reduce the return distance by an eighth, a longer step by more."""
    lane = NAMES.index(name)
    there, period = followed.stable_value[lane], int(PERIODS[lane])
    before = followed_from(begin[[lane]], [period], [FIRST[lane]], [there - 1e-3])
    beyond = np.geomspace(1e-5, 1e-2, 16)
    guess = np.repeat(before.stable.points, beyond.size, axis=0)
    system, plan = system_at(there + beyond), Plan(STEPS, 0, period, period, tangent=True)
    found = polish(system, guess, np.full(beyond.size, period, np.int32), plan)
    section = integrate(system, guess, plan).section
    distance = np.abs(section[:, -1] - guess) / coordinate_scale(section)
    left = found.residual / np.max(distance, axis=1)
    assert not found.converged.any()
    unmoved = np.isclose(left, 1.0, rtol=0, atol=1e-12)
    assert np.all((left < 0.875) | unmoved)
    # Some guesses move; those far beyond the fold do not.
    assert unmoved[-1] and not unmoved.all()


def test_the_boundary_is_the_same_from_wherever_the_orbit_is_followed(followed, begin):
    doubling = NAMES.index("period 1 doubles")
    start = begin[[doubling]]
    further = followed_from(start, [1], [FIRST[doubling]], [10.9])
    assert further.stable_value == pytest.approx(followed.stable_value[doubling], abs=2 * WIDTH)


def test_where_there_is_no_orbit_at_the_beginning_nothing_is_reported(begin):
    start = np.concatenate([begin[:1], np.full((1, 6), 5.0)])
    none = followed_from(start, [0, 1], [10.2, 10.2], [10.3, 10.3])
    assert np.all(none.loss == StabilityLoss.NOT_FOLLOWED)
    for value in (none.stable_value, none.beyond_value):
        assert np.isnan(value).all()


def test_an_orbit_that_is_unstable_at_the_beginning_is_not_followed_further(followed):
    doubling = NAMES.index("period 1 doubles")
    there = followed.beyond_value[[doubling]]
    start = followed.beyond.points[[doubling]]
    unstable = followed_from(start, [1], there, there + 0.1)
    assert unstable.loss[0] == StabilityLoss.PERIOD_DOUBLING
    assert unstable.stable_value == unstable.beyond_value == there
