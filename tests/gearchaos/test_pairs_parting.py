"""Two zeros of a function between two points of a curve are parted by a point between them."""

from typing import NamedTuple

import numpy as np
import pytest

from gearchaos.dynamics.pairs_parting import partings, with_parted
from gearchaos.dynamics.side_by_side import run


class Place(NamedTuple):
    """A point of a straight line."""

    place: np.ndarray


def at(*shares: float) -> list[Place]:
    return [Place(np.array([share, 0.0])) for share in shares]


def parted(function, shares):
    """Return the places of all points after the search, and how many were tried."""
    points, tried = at(*shares), []

    def test(some):
        return np.array([function(one.place[0]) for one in some])

    def between(one, other, share):
        tried.append(one.place[0] + share * (other.place[0] - one.place[0]))
        return at(tried[-1])[0]
        yield

    searches = partings(points, test(points), test, between)
    joined = run(with_parted(points, searches), lambda requests: requests)
    return [one.place[0] for one in joined], len(tried)


def beside_a_grazing(share, level=0.05):
    """Return a multiplier that changes with the root of the distance from a grazing at 1."""
    distance = max(1.0 - share, 0.0)
    return level + 0.6 * distance - 0.5 * np.sqrt(distance) - 0.02 * max(share - 1.0, 0.0)


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("level", [0.05, 0.09, 0.1])
def test_values_that_turn_beside_a_grazing_are_followed_to_their_zeros(level, backwards):
    shares = np.array([-0.6, -0.2, 0.3, 1.05, 1.5])

    def function(share):
        return beside_a_grazing(-share if backwards else share, level)

    given = -shares[::-1] if backwards else shares
    values = [function(one) for one in given]
    # No point has the least value among three, since the values fall or rise all the way.
    assert np.all(np.diff(values) > 0.0) if backwards else np.all(np.diff(values) < 0.0)
    found, tried = parted(function, given)
    (new,) = set(found) - set(given.tolist())
    assert function(new) < 0.0 < min(values)
    assert found == sorted(found)
    assert tried <= 4


def test_a_parabola_is_parted_at_its_extreme_and_one_that_stays_away_is_not():
    shares = [0.0, 1.0, 2.1, 3.0]
    found, tried = parted(lambda share: (share - 1.3) ** 2 - 1e-4, shares)
    assert found == [0.0, 1.0, pytest.approx(1.3), 2.1, 3.0]
    assert tried == 1
    found, tried = parted(lambda share: (share - 1.3) ** 2 + 0.1, shares)
    assert found == shares and tried <= 3


def test_values_that_fall_steadily_are_not_searched():
    shares = np.linspace(0.0, 4.0, 11)
    assert parted(lambda share: np.exp(-share), shares)[1] == 0
    assert parted(lambda share: 1.0 / (1.0 + share), shares)[1] == 0
