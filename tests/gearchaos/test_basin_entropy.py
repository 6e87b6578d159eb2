"""Basin entropy of basins whose entropy is known."""

import numpy as np
import pytest

from gearchaos.results.reading.ensembles import basin_entropy


def test_where_there_is_one_attractor_nothing_is_uncertain():
    assert basin_entropy(np.full((20, 30), 7)) == (0.0, 0.0)


@pytest.mark.parametrize("column", [1, 2, 3, 4])
def test_a_straight_boundary_cuts_one_column_of_boxes(column):
    """The fifth of eight columns of boxes holds both attractors, with shares k/5 and 1 - k/5."""
    side = np.arange(40) < 20 + column
    share = column / 5.0
    boundary = -share * np.log(share) - (1.0 - share) * np.log(1.0 - share)
    found = basin_entropy(np.broadcast_to(side, (60, 40)).astype(int))
    assert found == pytest.approx((boundary / 8.0, boundary))


def test_a_boundary_between_the_boxes_is_not_seen():
    assert basin_entropy(np.repeat([0, 1], 20)[:, np.newaxis] * np.ones((1, 10), int)) == (0.0, 0.0)


@pytest.mark.parametrize("attractors", [2, 3, 6])
def test_random_attractors_have_the_logarithm_of_their_number(attractors):
    drawn = np.random.default_rng(3).integers(attractors, size=(400, 400))
    whole, boundary = basin_entropy(drawn, box=20)
    # The entropy of 400 draws is lower by chi-square / 800, with the degrees of freedom
    # attractors - 1 (Miller 1955).
    freedom = attractors - 1.0
    error = np.sqrt(2.0 * freedom) / 800.0 / np.sqrt(400.0)
    assert whole == pytest.approx(np.log(attractors) - freedom / 800.0, abs=4.0 * error)
    assert boundary == whole


def test_boxes_have_as_many_dimensions_as_the_grid_and_what_is_left_does_not_count():
    line = np.array([0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 3, 4])
    entropy = -0.8 * np.log(0.8) - 0.2 * np.log(0.2)
    assert basin_entropy(line) == pytest.approx((entropy / 2.0, entropy))
    solid = np.broadcast_to(line, (5, 11, 12))
    assert basin_entropy(solid) == pytest.approx((entropy / 2.0, entropy))


def test_a_grid_without_a_whole_box_has_none():
    assert np.isnan(basin_entropy(np.zeros((4, 9), int))).all()
