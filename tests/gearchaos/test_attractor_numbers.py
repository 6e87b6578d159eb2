"""An attractor keeps its number along a sweep."""

import numpy as np

from gearchaos.dynamics.attractors import numbers_along


def at(*points: float) -> np.ndarray:
    """Return mean and extent of an orbit with these values, for two states of different size."""
    values = np.array(points)
    both = np.stack([values, 1e-3 * values], axis=1)
    return np.stack([both.mean(axis=0), both.std(axis=0)])


def numbered(*sets: list[np.ndarray]) -> list[list[int]]:
    """Return the numbers of the attractors at each value; the first has the largest basin."""
    value = np.repeat(np.arange(len(sets)), [len(found) for found in sets])
    sizes = np.concatenate([-np.arange(len(found)) for found in sets])
    averages = np.array([one for found in sets for one in found]).reshape(-1, 2, 2)
    numbers = numbers_along(value, sizes, averages)
    return [numbers[value == one].tolist() for one in range(len(sets))]


LOW, HIGH = [at(3.0 + 0.4 * n) for n in range(5)], [at(9.0 - 0.4 * n) for n in range(6)]
"""Two orbits that move with the parameter, at five and at six values."""


def test_what_goes_on_keeps_its_number_and_what_is_new_gets_the_next():
    assert numbered([LOW[0]], [LOW[1], HIGH[1]], [HIGH[2], LOW[2]]) == [[1], [1, 2], [2, 1]]


def test_where_an_attractor_ends_the_other_one_keeps_its_own_number():
    assert numbered([LOW[1], HIGH[1]], [HIGH[2]], [HIGH[3]]) == [[1, 2], [2], [2]]


def test_what_is_nearest_goes_together_first_however_large_the_basins():
    assert numbered([at(1.0)], [at(1.2), at(1.01)]) == [[1], [2, 1]]


def test_new_attractors_are_numbered_by_the_size_of_their_basins():
    sizes, averages = np.array([3, 5]), np.array([at(1.0), at(2.0)])
    assert numbers_along(np.zeros(2, int), sizes, averages).tolist() == [2, 1]


def test_an_attractor_that_no_start_has_met_for_a_while_returns_with_its_number():
    assert numbered([at(1.0), at(2.0)], [at(2.0)], [at(2.0), at(1.1)]) == [[1, 2], [2], [2, 1]]


def test_another_attractor_does_not_take_the_number_of_one_that_is_not_met():
    assert numbered([at(0.0)], [at(2.0)], [at(2.0), at(0.0)]) == [[1], [2], [2, 1]]


def test_a_doubled_period_and_a_window_in_chaos_are_the_same_attractor():
    chaos, window = at(*np.linspace(0.8, 1.2, 200)), at(0.8, 1.0, 1.2)
    assert numbered([at(1.0)], [at(0.9, 1.1)], [chaos], [window], [chaos]) == [[1]] * 5


def test_values_without_an_attractor_are_left_out():
    assert numbered([], [at(1.0)], []) == [[], [1], []]
    assert numbered([], []) == [[], []]
