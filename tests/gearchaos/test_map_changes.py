"""Changes between neighbouring cells of a map are the starts of boundaries."""

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.map_changes import DOUBLES, JUMP, changes_of
from gearchaos.outputs.variable import Variable


def of_map(period, impacts=None, jump=0.0):
    """Return the changes of a map with periods of the shape (second, first).

    ``jump``: jump of the first state between the fourth and the fifth column.
    """
    period = np.asarray(period)
    second, first = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    first = first + jump * (first > 3.5)
    data = {
        "b": np.arange(5.0),
        "a": np.arange(6.0),
        "period": period,
        "end_state": np.stack([first, second], axis=-1),
    }
    if impacts is not None:
        data["impacts"] = np.asarray(impacts, dtype=float)
    dims = {"a": ("a",), "b": ("b",), "end_state": ("b", "a", "state")}
    variables = [
        Variable(name, dims.get(name, ("b", "a")), str(one.dtype), "1", name)
        for name, one in data.items()
    ]
    result = gearchaos.Result(("b", "a"), variables, data, {}, {})
    ends = np.array([[0.0, 0.0], [5.0, 4.0]])
    return changes_of(result, ("a", "b"), ends, 1, ["impacts"] if impacts is not None else [])


def cells(changes):
    """Return the pair of cells of each change, with the cell of the motion first."""
    return {(*map(tuple, one.tolist()),) for one in changes.cells}


def test_both_sides_of_a_change_are_starts_if_both_are_periodic():
    period = np.zeros((5, 6), dtype=int)
    period[2, 3] = 1
    found = of_map(period)
    around = [(2, 2), (4, 2), (3, 1), (3, 3)]
    assert cells(found) == {((3, 2), other) for other in around}
    assert sorted(found.number.tolist()) == [0, 0, 1, 1]
    assert (found.state == [3.0, 2.0]).all()
    assert (found.shares == [0.6, 0.5]).all()


def test_longer_periods_are_no_starts_and_no_change_is_between_equal_cells():
    assert of_map(np.ones((5, 6), dtype=int)).flank.size == 0
    assert of_map(np.full((5, 6), 2)).flank.size == 0
    half = np.repeat([[1, 1, 1, 2, 2, 2]], 5, axis=0)
    assert cells(of_map(half)) == {((2, row), (3, row)) for row in range(5)}


def test_a_motion_beside_one_of_twice_its_period_is_marked():
    period = np.repeat([[1, 1, 2, 2, 0, 1]], 5, axis=0)
    found = of_map(period)
    assert cells(found.of(found.flank == DOUBLES)) == {((1, row), (2, row)) for row in range(5)}
    assert cells(found.of(found.flank == -1)) == {((5, row), (4, row)) for row in range(5)}


def test_other_impacts_change_the_motion_of_equal_periods():
    period, impacts = np.ones((5, 6), dtype=int), np.zeros((5, 6))
    impacts[:, 4:] = 1.0
    found = of_map(period, impacts)
    sides = {((3, row), (4, row)) for row in range(5)}
    assert cells(found) == sides | {pair[::-1] for pair in sides}
    assert (found.flank == 0).all()


@pytest.mark.parametrize(("jump", "jumps"), [(0.8, False), (1.5, True)])
def test_a_small_jump_counts_where_impacts_change(jump, jumps):
    period, impacts = np.ones((5, 6), dtype=int), np.zeros((5, 6))
    impacts[:, 4:] = 1.0
    assert not (of_map(period, jump=jump).flank == JUMP).any()
    found = of_map(period, impacts, jump)
    sides = {((3, row), (4, row)) for row in range(5)}
    both = sides | {pair[::-1] for pair in sides}
    assert cells(found.of(found.flank == JUMP)) == (both if jumps else set())
    assert cells(found.of(found.flank == 0)) == both


def test_a_curve_explains_the_changes_within_one_cell():
    found = of_map(np.repeat([[1, 1, 1, 2, 2, 2]], 5, axis=0))
    for first, beside in ((0.5, True), (0.21, True), (0.79, True), (0.09, False), (0.95, False)):
        assert (found.beside(np.array([[first, 0.0], [first, 1.0]])) == beside).all(), first
    lower = found.beside(np.array([[0.5, 0.0], [0.5, 0.25]]))
    assert lower.tolist() == [True, True, True, False, False]


def test_starts_are_spread_and_all_changes_are_of_some_part():
    found = of_map(np.repeat([[1, 1, 1, 2, 2, 2]], 5, axis=0))
    chosen = found.spread(0)
    assert 1 < chosen.size <= found.flank.size
    assert np.unique(found.shares[chosen], axis=0).shape[0] == chosen.size
