"""Corners of branches and boundaries: an orbit begins or ends a contact at mesh phase 0.

Where a force jumps with the contact, as a damper that acts in contact only does, the state at
mesh phase 0 has a derivative by the parameter that jumps with it. The orbit itself changes
smoothly, and so do its multipliers.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from gearchaos_kernels import LaneSystem, gaps_along
from numpy.typing import NDArray

from gearchaos.arrays import Floats
from gearchaos.dynamics.arclength import OnCurve
from gearchaos.dynamics.side_by_side import Search

BEYOND = 1e-7, 1e-6, 1e-5, 1e-4
"""Distances at which a point beyond a corner is searched, one after the other."""

REACH = 10.0
"""Largest distance of this point from its prediction, relative to the distance."""


Point = TypeVar("Point", bound=OnCurve)
Asked = TypeVar("Asked")
Answer = TypeVar("Answer")


def beyond_corner(
    here: Point,
    correcting: Callable[[Floats, Floats, float], Search[Asked, Answer, Point | None]],
    systems_at: Callable[[Floats], LaneSystem],
    steps_per_period: int,
) -> Search[Asked, Answer, Point | None]:
    """Search a point of a curve beyond a corner.

    Parameters
    ----------
    here : Point
        The last point before the corner, next to it.
    correcting : callable
        Returns the search of the point next to a guess, in the plane with a normal, and within a
        reach.
    systems_at : callable
        Returns the system of the lanes at shares of the ranges, (lanes, parameters).
    steps_per_period : int
        Steps per mesh period of the method.

    Returns
    -------
    Point or None
        The point; None where the contact at mesh phase 0 does not change next to ``here``.
    """
    states = here.section.shape[1]

    def flanks(point: Point) -> NDArray[np.uint8]:
        shares = np.broadcast_to(
            point.place[states:], (len(point.section), point.place.size - states)
        )
        section = point.section[:, np.newaxis]
        return gaps_along(systems_at(shares), section, steps_per_period).flank[:, 0]

    number = states + int(np.argmax(np.abs(here.tangent[states:])))
    normal = np.zeros_like(here.place)
    normal[number] = np.sign(here.tangent[number]) or 1.0
    before, beyond = flanks(here), None
    for distance in BEYOND:
        guess = here.place + distance * here.tangent
        if np.any((guess[states:] < 0.0) | (guess[states:] > 1.0)):
            break
        found = yield from correcting(guess, normal, REACH * distance)
        if found is not None and np.any(flanks(found) != before):
            if beyond is not None:
                # Differences for the tangent of the first one may reach across the corner.
                return found
            beyond = found
    return beyond
