"""Sets of section points: their distances, and numbers that stay with an attractor."""

import numpy as np
import pytest

from gearchaos.records.attractor_sets import distances, numbers_along


def at(*points: float) -> np.ndarray:
    """An orbit with these values of two states of different size."""
    values = np.array(points)
    return np.stack([values, 1e-3 * values], axis=1)


def test_distances_are_those_to_the_nearest_point_in_parts_of_the_size():
    others = at(2.0, -4.0)
    assert distances(at(-4.0, 1.0, 3.0), others) == pytest.approx([0.0, 0.25, 0.25])
    assert distances(at(3.0), others, np.array([1.0, 1e-3])) == pytest.approx([1.0])


def test_many_points_are_compared_in_pieces():
    rng = np.random.default_rng(1)
    points, others = rng.normal(size=(1500, 3)), rng.normal(size=(900, 3))
    scale = np.ones(3)
    slow = [np.sqrt(np.mean((point - others) ** 2, axis=1).min()) for point in points]
    assert distances(points, others, scale) == pytest.approx(slow)


LOW, HIGH = [at(0.4 * n) for n in range(5)], [at(9.0 - 0.4 * n) for n in range(6)]
"""Two orbits at five values, which move as far from one value to the next as they like."""


def test_what_goes_on_keeps_its_number_and_what_is_new_gets_the_next():
    sets = [[LOW[0]], [LOW[1], HIGH[1]], [HIGH[2], LOW[2]]]
    ahead = [[LOW[1]], [LOW[2], HIGH[2]], [HIGH[3], LOW[3]]]
    assert numbers_along(sets, ahead) == [[1], [1, 2], [2, 1]]


def test_where_an_attractor_ends_the_one_to_which_it_leads_keeps_its_own_number():
    sets = [[LOW[1], HIGH[1]], [HIGH[2]], [HIGH[3]]]
    ahead = [[HIGH[2], HIGH[2]], [HIGH[3]], [HIGH[4]]]
    assert numbers_along(sets, ahead) == [[1, 2], [2], [2]]


def test_an_attractor_that_no_start_has_met_for_a_while_returns_with_its_number():
    sets = [[at(0.0), at(2.0)], [at(2.0)], [at(2.0), at(0.1)]]
    assert numbers_along(sets, sets) == [[1, 2], [2], [2, 1]]


def test_another_attractor_does_not_take_the_number_of_one_that_is_not_met():
    sets = [[at(0.0)], [at(2.0)], [at(2.0), at(0.0)]]
    assert numbers_along(sets, sets) == [[1], [2], [2, 1]]


def test_a_doubled_period_and_a_window_in_chaos_are_the_same_attractor():
    chaos, window = at(*np.linspace(0.8, 1.2, 200)), at(0.8, 1.0, 1.2)
    sets = [[at(1.0)], [at(0.9, 1.1)], [chaos], [window], [chaos]]
    ahead = [[at(1.1, 0.9)], [chaos], [window], [chaos], [chaos]]
    assert numbers_along(sets, ahead) == [[1]] * 5


def test_values_without_an_attractor_are_left_out():
    sets = [[], [at(1.0)], []]
    assert numbers_along(sets, sets) == [[], [1], []]
    assert numbers_along([[]], [[]]) == [[]]
