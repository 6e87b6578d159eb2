"""A motion is labelled by its section and the growth of its tangent vector."""

import numpy as np
import pytest

from gearchaos.records.label import (
    AGREEMENT,
    CHAOTIC,
    DIVERGED,
    GROWS,
    PERIODIC,
    QUASI_PERIODIC,
    UNRESOLVED,
    Record,
    doubtful,
    halves_differ_by,
    label,
    settling_periods,
)
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.records.period import LONGEST_PERIOD, TOLERANCE, return_distances

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
POINTS = 500
RANDOM = np.random.default_rng(11)


def record(section: np.ndarray, growth: np.ndarray | None = None, torus: bool = True) -> Record:
    """Return the record of one lane; without a growth, its tangent vector is neutral."""
    growth = np.zeros(section.shape[0]) if growth is None else growth
    sections = section[np.newaxis].astype(float)
    broken = ~np.isfinite(sections).all(axis=(1, 2))
    return Record(sections, growth[np.newaxis], broken, np.array([torus]))


def labelled(*arguments, **options) -> tuple[int, int, float]:
    labels = label(record(*arguments, **options))
    return int(labels.motion[0]), int(labels.period[0]), float(labels.return_distance[0])


def logistic(r: float, points: int = POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Return section and growth of the logistic map after a transient."""
    x = 0.4
    for _ in range(3000):
        x = r * x * (1.0 - x)
    orbit = np.empty(points + 1)
    for number in range(points + 1):
        orbit[number] = x
        x = r * x * (1.0 - x)
    return orbit[1:, np.newaxis], np.log(np.abs(r * (1.0 - 2.0 * orbit[:-1])))


def circle(rotation: float, points: int = POINTS) -> np.ndarray:
    """Return points of a dented ellipse, visited at equal steps of the angle."""
    angle = 2.0 * np.pi * rotation * np.arange(points)
    radius = 1.0 + 0.2 * np.cos(3.0 * angle)
    return np.stack([3.0 + radius * np.cos(angle), 0.5 * radius * np.sin(angle)], axis=1)


def spiral(contraction: float, rotation: float) -> np.ndarray:
    shrinking = contraction ** np.arange(POINTS)
    return 3.0 + (circle(rotation) - 3.0) * shrinking[:, np.newaxis]


@pytest.mark.parametrize("period", range(1, LONGEST_PERIOD + 1))
def test_a_section_that_repeats_is_periodic_with_its_shortest_period(period):
    section = np.resize(RANDOM.uniform(1.0, 2.0, (period, 3)), (POINTS, 3))
    assert labelled(section) == (PERIODIC, period, 0.0)
    noise = 1e-7 * RANDOM.normal(size=section.shape)
    motion, found, distance = labelled(section + noise)
    assert (motion, found) == (PERIODIC, period)
    assert 1e-8 < distance < TOLERANCE


def test_a_coordinate_that_is_not_looked_at_alone_can_break_the_period():
    section = np.resize(RANDOM.uniform(-1.0, 1.0, (4, 1)), (POINTS, 1))
    other = np.resize(RANDOM.uniform(-1.0, 1.0, (6, 1)), (POINTS, 1))
    assert labelled(section)[:2] == (PERIODIC, 4)
    assert labelled(np.hstack([section, other]))[:2] == (PERIODIC, 12)


def test_a_period_beyond_the_longest_is_unresolved_and_reports_its_distance():
    section = np.resize(RANDOM.uniform(-1.0, 1.0, (17, 2)), (POINTS, 2))
    motion, period, distance = labelled(section, np.full(POINTS, -0.1))
    assert (motion, period) == (UNRESOLVED, 0)
    assert distance == np.nanmin(return_distances(section[np.newaxis])) > 0.1


@pytest.mark.parametrize("rotation", [GOLDEN, np.sqrt(2.0), np.pi, np.e / 10.0])
def test_an_irrational_rotation_is_quasi_periodic_where_a_torus_can_exist(rotation):
    assert labelled(circle(rotation))[:2] == (QUASI_PERIODIC, 0)
    assert labelled(circle(rotation), torus=False)[:2] == (UNRESOLVED, 0)


@pytest.mark.parametrize("torus", [True, False])
@pytest.mark.parametrize("r", [4.0, 3.9, 3.7])
def test_the_logistic_map_is_chaotic_where_it_is_known_to_be(r, torus):
    section, growth = logistic(r)
    assert labelled(section, growth, torus)[:2] == (CHAOTIC, 0)


@pytest.mark.parametrize(("r", "period"), [(2.8, 1), (3.2, 2), (3.5, 4), (3.83, 3), (3.845, 6)])
def test_the_logistic_map_is_periodic_where_it_is_known_to_be(r, period):
    assert labelled(*logistic(r))[:2] == (PERIODIC, period)


def test_averages_of_two_halves_agree_on_a_torus_and_on_nothing_else():
    torus = circle(GOLDEN)[np.newaxis]
    assert halves_differ_by(torus)[0] < 1e-5
    assert halves_differ_by(circle(GOLDEN, 2000)[np.newaxis])[0] < 1e-9
    assert halves_differ_by(logistic(4.0)[0][np.newaxis])[0] > AGREEMENT
    assert halves_differ_by(spiral(0.999, GOLDEN)[np.newaxis])[0] > 10.0 * AGREEMENT
    drifting = circle(GOLDEN) + 1e-3 * np.arange(POINTS)[:, np.newaxis]
    assert halves_differ_by(drifting[np.newaxis])[0] > 10.0 * AGREEMENT
    assert np.isnan(halves_differ_by(torus[:, :1])).all()


@pytest.mark.parametrize("contraction", [0.999, 0.9995])
def test_a_spiral_that_has_not_arrived_is_unresolved(contraction):
    growth = np.log(contraction) + 0.1 * np.sin(np.arange(POINTS))
    assert labelled(spiral(contraction, GOLDEN), growth)[:2] == (UNRESOLVED, 0)


def test_chaos_that_has_ended_is_labelled_by_its_end():
    section, growth = logistic(4.0)
    section[-60:], growth[-60:] = 0.75, -1.0
    assert labelled(section, growth)[:2] == (PERIODIC, 1)
    section[-60:, 0] += 0.1 * 0.95 ** np.arange(60.0)
    growth[POINTS // 2 :] = -0.05
    assert labelled(section, growth)[:2] == (UNRESOLVED, 0)


def test_chaos_that_ends_with_the_record_may_have_settled():
    section, growth = logistic(4.0)
    ending = record(section, growth)
    assert settling_periods(ending, label(ending)).tolist() == [0]
    ending.section[0, -16:, 0] = np.resize([0.3, 0.9], 16) + 0.003 * 0.8 ** np.arange(16.0)
    assert label(ending).motion.tolist() == [CHAOTIC]
    assert settling_periods(ending, label(ending)).tolist() == [2]


def test_growth_within_its_error_or_over_too_short_a_record_is_not_chaos():
    section, _ = logistic(4.0)
    assert labelled(section, 0.001 + 2.0 * RANDOM.normal(size=POINTS))[0] == UNRESOLVED
    assert labelled(section, np.full(POINTS, 1e-3))[0] == UNRESOLVED
    assert labelled(section[:12], np.full(12, 0.1))[0] == UNRESOLVED


def test_without_an_exponent_a_motion_is_periodic_or_unresolved():
    for section, wanted in ((circle(GOLDEN), UNRESOLVED), (np.ones((60, 2)), PERIODIC)):
        without = record(section)._replace(growth=np.zeros((1, 0)))
        labels = label(without)
        assert labels.motion.tolist() == [wanted]


def test_a_diverged_lane_is_reported_as_such_and_its_neighbours_keep_their_labels():
    section = np.stack([circle(GOLDEN), np.full((POINTS, 2), np.nan), circle(0.25)])
    growth = np.zeros((3, POINTS))
    diverged = np.array([False, True, False])
    growth[1] = np.nan
    labels = label(Record(section, growth, diverged, np.ones(3, dtype=bool)))
    assert labels.motion.tolist() == [QUASI_PERIODIC, DIVERGED, PERIODIC]
    assert labels.period.tolist() == [0, 0, 4]
    assert np.isnan(labels.return_distance).tolist() == [False, True, False]


def test_a_slow_approach_is_reported_with_the_period_on_which_it_settles():
    orbit = np.resize(RANDOM.uniform(1.0, 2.0, (3, 2)), (POINTS, 2))
    slowly = 0.05 * 0.998 ** np.arange(POINTS)[:, np.newaxis]
    settling = record(orbit + slowly, np.full(POINTS, np.log(0.998)))
    labels = label(settling)
    assert labels.motion.tolist() == [UNRESOLVED]
    assert settling_periods(settling, labels).tolist() == [3]
    leaving = record(orbit + slowly[::-1], np.full(POINTS, -np.log(0.998)))
    assert settling_periods(leaving, label(leaving)).tolist() == [0]


def test_a_slow_approach_from_alternating_sides_returns_best_after_twice_the_period():
    orbit = np.resize(RANDOM.uniform(1.0, 2.0, (3, 2)), (POINTS, 2))
    slowly = 0.05 * (-0.998) ** np.arange(POINTS)[:, np.newaxis]
    settling = record(orbit + slowly, np.full(POINTS, np.log(0.998)))
    assert settling_periods(settling, label(settling)).tolist() == [6]
    # Closer to the orbit, the motion returns after twice the period; its period is not doubled.
    close = record(orbit + 1e-2 * slowly, np.full(POINTS, np.log(0.998)))
    assert label(close).period.tolist() == [6]
    assert settling_periods(close, label(close)).tolist() == [3]
    arrived = record(np.resize(RANDOM.uniform(1.0, 1.001, (6, 2)), (POINTS, 2)))
    assert settling_periods(arrived, label(arrived)).tolist() == [0]


def test_the_end_of_a_short_record_is_compared_with_its_begin():
    # If an excitation has many mesh periods, a record holds few points.
    slowly = 1.0 + 1e-5 * (-0.6) ** np.arange(24)[:, np.newaxis]
    settling = record(slowly, np.full(24, np.log(0.6)))
    assert label(settling).period.tolist() == [2]
    assert settling_periods(settling, label(settling)).tolist() == [1]


def test_a_record_too_short_for_anything_is_unresolved_without_a_distance():
    labels = label(record(np.ones((2, 2)), np.zeros(2)))
    assert labels.motion.tolist() == [UNRESOLVED]
    assert np.isnan(labels.return_distance).all()


def in_doubt(section: np.ndarray, growth: np.ndarray | None = None) -> bool:
    one = record(section, growth)
    return bool(doubtful(one.growth, label(one))[0])


def test_a_turn_as_long_as_the_record_needs_a_longer_record():
    slow = GOLDEN / POINTS
    assert labelled(circle(slow))[0] == UNRESOLVED
    assert in_doubt(circle(slow))
    assert labelled(circle(slow, 40 * POINTS))[0] == QUASI_PERIODIC


def test_a_torus_is_doubted_and_a_period_is_not():
    assert in_doubt(circle(GOLDEN))
    assert not in_doubt(circle(0.25))
    broken = record(np.full((POINTS, 2), np.nan), np.full(POINTS, np.nan))
    assert not doubtful(broken.growth, label(broken)).any()


@pytest.mark.parametrize(("errors", "doubted"), [(4.0, True), (8.0, False)])
def test_chaos_is_doubted_as_long_as_it_is_within_six_standard_errors(errors, doubted):
    section, _ = logistic(4.0)
    noise = np.repeat(np.resize([1.0, -1.0], 10), POINTS // 10)
    growth = 0.1 + noise
    _, error = largest_exponent(growth[np.newaxis], np.ones(1))
    growth = noise + errors * error[0]
    assert labelled(section, growth)[0] == CHAOTIC
    assert in_doubt(section, growth) is doubted


def test_without_an_exponent_a_longer_record_would_not_show_chaos():
    without = record(circle(GOLDEN / POINTS))._replace(growth=np.zeros((1, 0)))
    assert not doubtful(without.growth, label(without)).any()


def test_few_points_do_not_show_that_a_motion_grows():
    """Three points of bounded chaos lie far apart; teeth with errors give few points per lane."""
    few = np.array([[0.33], [0.9], [1.36]])
    assert labelled(few, np.full(3, 0.8))[0] == CHAOTIC
    grown = np.exp(0.3 * np.arange(40.0))[:, np.newaxis]
    assert labelled(grown, np.full(40, 0.3))[0] == GROWS
