"""How far orbits at places of curves are from being closed, from one integration for all places."""

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, integrate

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.dynamics.side_by_side import Found, Search

if TYPE_CHECKING:
    from gearchaos.dynamics.arclength import Curve

DIFFERENCE, ONE_SIDED = 1e-8, 1e-9
"""Shares of the way used for the difference quotient of the map by the parameter.

The second one is for one side. Next to grazings second derivatives are large.
"""


class Request(NamedTuple):
    """A place of a curve whose defect is needed.

    Attributes
    ----------
    curve : Curve
        The curve.
    place : array, shape (states + 1,)
        The state in its scales, then the share of the way.
    normal : array, shape (states + 1,)
        Normal of the plane in which a closed orbit is searched.
    by_share : array, shape (states,), or None
        The derivative of the map by the share of the way, if it is known.
    """

    curve: "Curve"
    place: Floats
    normal: Floats
    by_share: Floats | None = None

    def shares(self) -> list[float]:
        """Return the share of the place, and those beside it if the derivative is unknown.

        One on either side: next to a grazing, second derivatives are large. Where every share has
        flow maps of its own, which cost more than lanes, there is one.
        """
        # Beyond the ends of the way the value of the parameter may be invalid.
        share = min(max(float(self.place[-1]), 0.0), 1.0)
        if self.by_share is not None:
            return [share]
        if self.curve.own_maps:
            return [share, share + (ONE_SIDED if share < 0.5 else -ONE_SIDED)]
        beside = self.curve.difference
        return [share, min(share + beside, 1.0), max(share - beside, 0.0)]


class Defect(NamedTuple):
    """How far an orbit is from being closed.

    Attributes
    ----------
    distance : array, shape (states,)
        P(x) - x in the scales; P is the map over the period.
    size : float
        Its largest component; NaN where the motion diverged.
    slopes : array, shape (states, states + 1)
        Its derivatives by the place.
    step : array, shape (states + 1,)
        The step of Newton's method, which is subtracted from the place; NaN if there is none.
    along : array, shape (states + 1,)
        Tangent of the curve, of any length, on the side of the normal; NaN if there is none.
    section : array, shape (periods, states)
        States at the ends of the excitation periods, dimensionless.
    contact : array, shape (elements, rows)
        Contact of the clearance elements in the period, as an `Outcome` has it.
    """

    distance: Floats
    size: float
    slopes: Floats
    step: Floats
    along: Floats
    section: Floats
    contact: Floats


Finding: TypeAlias = Search[Request, Defect, Found]
"""Yields places of curves, is sent their defects, and returns the result."""


class _Lanes(NamedTuple):
    """The lanes of some places: one for each column of the Jacobian, and those beside.

    Attributes
    ----------
    first : array of int, shape (places,)
        The first lane of each place.
    unknown : array of bool, shape (places,)
        Whether lanes beside give the derivative by the share.
    other : array of int, shape (places,)
        The lane with which the one beside is compared, from the first on.
    across : array, shape (places with lanes beside,)
        Difference of the shares of both.
    """

    first: Integers
    unknown: Mask
    other: Integers
    across: Floats


def defects_of(requests: Sequence[Request]) -> list[Defect]:
    """Return the defects at places of curves, one each, from one integration.

    The curves differ in their numbers, periods and scales only.
    """
    periods = np.array([request.curve.plan.recorded_periods for request in requests])
    system, lanes, passed = _integrated(requests, periods)
    scale = np.array([request.curve.scale for request in requests])
    places = np.array([request.place for request in requests])
    ends = passed.section[:, -1]
    distance = ends[lanes.first] / scale - places[:, :-1]
    slopes = _slopes(requests, lanes, passed, scale)
    steps, along = _solved(slopes, np.array([one.normal for one in requests]), distance)
    # NaN where a motion diverged.
    sizes = np.max(np.abs(distance), axis=1).tolist()
    repeats = system.repeats_after
    return [
        Defect(
            distance[at],
            sizes[at],
            slopes[at],
            steps[at],
            along[at],
            passed.section[lane, -whole:][repeats - 1 :: repeats],
            passed.contact[lane],
        )
        for at, (lane, whole) in enumerate(zip(lanes.first, periods.tolist(), strict=True))
    ]


def _integrated(
    requests: Sequence[Request], periods: Integers
) -> tuple[LaneSystem, _Lanes, Outcome]:
    """Integrate the lanes of all places over their periods (places,)."""
    first = requests[0].curve
    states = first.scale.size
    shares = [request.shares() for request in requests]
    known = np.array([len(one) for one in shares])
    numbers = np.repeat([request.curve.number for request in requests], known)
    system = first.systems_at(numbers, np.concatenate(shares))
    # One lane for each column of the Jacobian, others for the difference by the parameter.
    copies = np.concatenate([[states, 1, 1][:count] for count in known])
    counts = states + known - 1
    points = np.array([request.place[:-1] * request.curve.scale for request in requests])
    columns = np.eye(states)[[*range(states), 0, 0]]
    longest = int(periods.max())
    passed = integrate(
        system.of(np.repeat(np.arange(copies.size), copies)),
        np.repeat(points, counts, axis=0),
        first.plan._replace(recorded_periods=longest, section_points=longest),
        tangent_start=np.concatenate([columns[:count] for count in counts]),
        periods=np.repeat(periods, counts),
    )
    # The one beside is compared with the one on the other side, or with the place itself.
    other = np.where(known > 2, states + 1, 0)
    across = np.array([one[1] - one[2 if len(one) > 2 else 0] for one in shares if len(one) > 1])
    return system, _Lanes(np.cumsum(counts) - counts, known > 1, other, across), passed


def _slopes(requests: Sequence[Request], lanes: _Lanes, passed: Outcome, scale: Floats) -> Floats:
    """Return the derivatives of the defects by their places, (places, states, states + 1)."""
    count, states = scale.shape
    slopes = np.empty((count, states, states + 1))
    columns = passed.end_tangent * np.exp(np.sum(passed.growth, axis=1))[:, np.newaxis]
    jacobian = columns[lanes.first[:, np.newaxis] + np.arange(states)].transpose(0, 2, 1)
    slopes[:, :, :-1] = jacobian * scale[:, np.newaxis] / scale[:, :, np.newaxis]
    slopes[:, :, :-1] -= np.eye(states)
    new, ends = lanes.unknown, passed.section[:, -1]
    first = lanes.first[new]
    beside = (ends[first + states] - ends[first + lanes.other[new]]) / scale[new]
    slopes[new, :, -1] = beside / lanes.across[:, np.newaxis]
    for at in np.nonzero(~new)[0].tolist():
        slopes[at, :, -1] = requests[at].by_share
    return slopes


def _solved(slopes: Floats, normals: Floats, distance: Floats) -> tuple[Floats, Floats]:
    """Return steps within planes to closed orbits, and tangents of the curves there.

    Both have the shape (places, states + 1), and are NaN where the equations are singular.
    """
    bordered = np.concatenate([slopes, normals[:, np.newaxis]], axis=1)
    sides = np.zeros((*normals.shape, 2))
    sides[:, :-1, 0], sides[:, -1, 1] = distance, 1.0
    try:
        solved = np.linalg.solve(bordered, sides)
    except np.linalg.LinAlgError:
        solved = np.full(sides.shape, np.nan)
        for at, (matrix, side) in enumerate(zip(bordered, sides, strict=True)):
            with suppress(np.linalg.LinAlgError):
                solved[at] = np.linalg.solve(matrix, side)
    return solved[..., 0], solved[..., 1]
