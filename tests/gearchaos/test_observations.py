"""Observations are computed from sections of known motions."""

import numpy as np
import pytest

from gearchaos.identification.evaluation import RETURN, CandidateRecords
from gearchaos.identification.observations import (
    change_place,
    has_motion,
    misfit,
    stage_length,
)
from gearchaos.identification.search import distinct, steps_alone
from gearchaos.identification.targets import ObservedPlace, ObservedStage
from gearchaos.records.period import return_distances

POINTS = np.arange(96)


def records(*sections, exponent=-0.1):
    """Return the records of one candidate whose lanes have these sections."""
    section = np.stack(np.broadcast_arrays(*sections, POINTS * 0.0)[:-1])[np.newaxis]
    returns = return_distances(section[0][..., np.newaxis]) <= RETURN
    period = np.where(returns.any(axis=1), np.argmax(returns, axis=1) + 1, 0)
    shape = section.shape[:2]
    return CandidateRecords(
        section,
        period.reshape(shape).astype(np.int32),
        np.where(period == 0, abs(exponent), exponent).reshape(shape),
        np.zeros((*shape, 1)),
        np.ones(shape, dtype=np.bool_),
    )


def chaos(extent, seed=0):
    values = np.random.default_rng(seed).random(POINTS.size)
    values[:2] = 0.0, 1.0
    return extent * values


CYCLES = {n: np.sin(1.0 + 2.0 * np.pi * POINTS / n) for n in (1, 2, 4, 6)}
TWO_BANDS = np.where(POINTS % 2, 2.0, 0.0) + chaos(1.0)


@pytest.mark.parametrize(
    ("motion", "lanes"),
    [
        ("period 1", [1, 0, 0, 0, 0, 0]),
        ("period 2", [0, 1, 0, 0, 0, 0]),
        ("chaotic", [0, 0, 0, 0, 1, 1]),
        ("aperiodic", [0, 0, 0, 0, 1, 1]),
    ],
)
def test_motions_are_distinguished(motion, lanes):
    seen = records(CYCLES[1], CYCLES[2], CYCLES[4], CYCLES[6], TWO_BANDS, chaos(3.0))
    assert has_motion(seen, motion)[0].tolist() == [bool(one) for one in lanes]


def test_on_two_bands_are_chaos_and_longer_periods_that_alternate_between_them():
    doubled = np.array([0.0, 2.0, 0.1, 2.1])[POINTS % 4]
    crossed = np.array([0.0, 2.0, 2.1, 0.1])[POINTS % 4]
    seen = records(CYCLES[1], CYCLES[2], doubled, crossed, TWO_BANDS, chaos(3.0))
    assert has_motion(seen, "bands 2")[0].tolist() == [False, False, True, False, True, False]


def test_the_length_of_a_wrong_motion_counts():
    stage = stage_length(ObservedStage(motion="period 2", **{"from": 1.0, "to": 2.0}, width=0.1))
    lanes = [CYCLES[1] if value < 1.3 else CYCLES[2] for value in stage.values]
    (length,) = stage.computed(records(*lanes))
    # A cell counts as a whole: the cell that contains 1.3 may be counted or not.
    cell = np.max(np.diff(stage.values))
    assert length == pytest.approx(0.3, abs=cell)
    assert stage.computed(records(*[CYCLES[2]] * stage.values.size)) == [0.0]
    assert stage.computed(records(*[CYCLES[1]] * stage.values.size)) == pytest.approx([1.0])
    # A boundary that is wrong by one width is detected.
    assert stage.values[0] - 1.0 < 0.1 and 2.0 - stage.values[-1] < 0.1


@pytest.mark.parametrize("place", [0.7, 1.0, 1.31])
def test_a_jump_lies_between_the_lanes_of_different_branches(place):
    jump = change_place("jump", ObservedPlace(at=1.0, within=(0.5, 1.5), width=0.02))
    lanes = [0.3 * value + (value > place) for value in jump.values]
    (found,) = jump.computed(records(*lanes))
    below, above = jump.values[jump.values <= place][-1], jump.values[jump.values > place][0]
    assert found == pytest.approx((below + above) / 2.0)
    assert np.any(np.isclose((jump.values[1:] + jump.values[:-1]) / 2.0, 1.0))


def test_a_branch_without_a_jump_has_none():
    jump = change_place("jump", ObservedPlace(at=1.0, within=(0.5, 1.5), width=0.02))
    computed = jump.computed(records(*[0.3 * value + 1.0 for value in jump.values]))
    assert np.isnan(computed).all()
    # The error of a missing jump is the length of the span.
    assert jump.residual(computed) == pytest.approx([1.0 / 0.02])


def test_a_crisis_lies_where_the_section_first_grows():
    crisis = change_place("crisis", ObservedPlace(at=1.0, within=(0.5, 1.5), width=0.02))
    seeds = range(crisis.values.size)
    # Above the crisis, only every third lane has left the former part of the section.
    wide = [value > 1.1 and seed % 3 == 0 for seed, value in zip(seeds, crisis.values, strict=True)]
    lanes = [chaos(2.0 if one else 1.0, seed) for seed, one in zip(seeds, wide, strict=True)]
    (found,) = crisis.computed(records(*lanes))
    first = wide.index(True)
    assert found == pytest.approx(np.mean(crisis.values[first - 1 : first + 1]))
    assert np.isnan(crisis.computed(records(*[chaos(1.0, seed) for seed in seeds]))).all()


def test_the_misfit_is_quadratic_near_the_target_and_linear_far_from_it():
    assert misfit(np.array([[0.01, 0.0]])) == pytest.approx([1e-4], rel=1e-4)
    assert misfit(np.array([[1e4, 0.0]])) == pytest.approx([2e4], rel=1e-3)


def test_sets_differ_where_one_parameter_does():
    points = np.array([[0.5, 0.5], [0.55, 0.45], [0.5, 0.7], [0.1, 0.5]])
    assert distinct(points, np.array([1.0, 2.0, 4.0, 3.0]), apart=0.1, most=3) == [0, 3, 2]


def test_steps_move_one_parameter_at_a_time():
    centre = np.array([0.5, 0.9])
    points = steps_alone(centre, 6)
    assert np.array_equal(points[0], centre)
    assert np.all(np.count_nonzero(points[1:] != centre, axis=1) == 1)
    assert points.min() == 0.0 and points.max() == 1.0
