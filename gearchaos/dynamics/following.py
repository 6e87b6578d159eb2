"""Which way a periodic orbit loses its stability as a parameter changes.

An orbit is stable while its Floquet multipliers lie within the unit circle. With backlash the
multipliers may change fast next to a motion that grazes a flank, but they do not jump: the mesh
force is continuous, so that the map over a period has a continuous derivative.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Plan

from gearchaos.arrays import Codes, Complex, Counts, Floats, Mask
from gearchaos.dynamics.arclength import Curve, End, end_of_curve
from gearchaos.dynamics.orbits import Orbits, polish
from gearchaos.dynamics.stability_loss import CONFIRMED, StabilityLoss, loss_of_stability

LONGEST_SHARE = 1.0 / 16.0  # Share of the way along which an orbit is followed.

MOST_ORBITS = 200
"""Orbits tried along the way; where they do not suffice nothing is known of what lies beyond."""

MOST_CURVES = 8  # Places at which an orbit that Newton's method misses is followed along its curve.


class Orbit(NamedTuple):
    """A periodic orbit.

    ``period`` in excitation periods; ``point`` (states,) at its beginning; ``multipliers``
    (states,): the Floquet multipliers, largest modulus first; ``exponent``: the largest Lyapunov
    exponent per unit of tau; ``residual``: distance after one period, relative to the scale of each
    coordinate.
    """

    period: int
    point: Floats
    multipliers: Complex
    exponent: float
    residual: float

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)


class Branch(NamedTuple):
    """How far an orbit goes along a parameter.

    ``value``, ``orbit``: the last value at which it is stable, and the orbit there; ``beyond``: the
    first value at which it is unstable or not found, the end of the way if it stays stable;
    ``loss``, ``text``: how it loses stability; ``multiplier``: the one that tells.
    """

    value: float
    orbit: Orbit
    beyond: float
    loss: StabilityLoss
    text: str
    multiplier: complex


class Followed(NamedTuple):
    """The orbits of some lanes, followed until they lose stability or to the end of the way.

    ``stable_value``, ``beyond_value`` (lanes,): the last value of the parameter with a stable
    orbit, and the first one at which it is unstable or not found; both are the end of the way
    where the orbit is stable all along, and not a number where there is none at the beginning.
    ``stable``, ``beyond``: the `Orbits` there; ``loss``, ``multiplier``: see `loss_of_stability`.
    """

    stable_value: Floats
    stable: Orbits
    beyond_value: Floats
    beyond: Orbits
    loss: Codes
    multiplier: Complex


def follow(
    system_at: Callable[[Floats], LaneSystem],
    guess: Floats,
    period: Counts,
    first: Floats,
    last: Floats,
    width: float,
    plan: Plan,
) -> Followed:
    """Follow the orbit of every lane along a parameter to where it loses stability.

    Every orbit is polished from the straight line through the two before it. Steps begin with a
    sixteenth of the way, are halved where no orbit is found, and end in a bisection where one is
    unstable. All lanes are followed side by side. Where an orbit ends, or the unstable one does not
    explain the loss of stability (`loss_of_stability`) and so belongs to another branch, it is
    followed along its curve, see `arclength`, and where this goes on it is followed on from there.

    ``system_at`` gives the systems at values of the parameter, (lanes,), of any number;
    ``first``, ``last`` (lanes,): the values at both ends of the way, in either order; ``guess``,
    ``period`` and ``plan`` as for `polish` at the first values; ``width``: wanted distance of the
    stable value and the one beyond.
    """
    lanes = _Lanes(system_at, guess, period, (first, last), width, plan)
    going = lanes.stable.stable
    for _ in range(1 + MOST_CURVES):
        lanes.march(going)
        going = np.zeros_like(going)
        for lane in np.flatnonzero(lanes.unexplained).tolist():
            going[lane] = lanes.follow_curve(lane)
        if not going.any():
            break
    return lanes.followed


class _Lanes:
    """Where orbits that are followed side by side stand: arguments as of `follow`."""

    def __init__(
        self,
        system_at: Callable[[Floats], LaneSystem],
        guess: Floats,
        period: Counts,
        ends: tuple[Floats, Floats],
        width: float,
        plan: Plan,
    ) -> None:
        self._system_at, self._period, self._plan = system_at, period, plan
        self._first, self._way = ends[0], ends[1] - ends[0]
        # Whatever the width: an orbit is never lost sight of within the first step.
        share = width / np.maximum(np.abs(self._way), width)
        self._smallest = np.minimum(share, LONGEST_SHARE)
        self._share = np.zeros_like(self._first)
        self.stable = self._orbits(self._share, guess, period > 0)
        self._slope = np.zeros_like(self.stable.points)
        self._beyond, self._end = self.stable, np.zeros_like(self._first)
        # Those whose curve was followed to an end, and those that end in an orbit of half.
        self._located = np.zeros(self._first.shape, np.bool_)
        self._halved = np.zeros(self._first.shape, np.bool_)

    def _orbits(self, share: Floats, guess: Floats, followed: Mask) -> Orbits:
        system = self._system_at(self._first + share * self._way)
        sought = np.where(followed, self._period, np.int32(0))
        return polish(system, guess, sought, self._plan)

    @property
    def _loss(self) -> tuple[Codes, Complex]:
        kind, multiplier = loss_of_stability(self.stable.multipliers, self._beyond.multipliers)
        kind[self._halved] = StabilityLoss.PERIOD_HALVING
        return kind, multiplier

    @property
    def unexplained(self) -> Mask:
        """Which stable orbits have ended, or lie beside an unstable one of another branch."""
        other = self._loss[0] == StabilityLoss.UNCONFIRMED
        ended: Mask = np.isnan(self._beyond.multipliers[:, 0]) | other
        return ended & self.stable.stable & ~self._located

    @property
    def followed(self) -> Followed:
        """What was found."""
        exists = self.stable.converged
        return Followed(
            np.where(exists, self._first + self._share * self._way, np.nan),
            self.stable,
            np.where(exists, self._first + self._end * self._way, np.nan),
            self._beyond,
            *self._loss,
        )

    def march(self, going: Mask) -> None:
        """Follow the orbits of some lanes, value by value, until they end or are unstable."""
        step = np.full_like(self._share, LONGEST_SHARE)
        unstable_from = np.full_like(self._share, np.inf)
        for _ in range(MOST_ORBITS):
            if not going.any():
                break
            trial = np.minimum(self._share + step, 1.0)
            ahead = np.where(going, trial - self._share, 1.0)[:, np.newaxis]
            found = self._orbits(trial, self.stable.points + ahead * self._slope, going)
            kept = going & found.stable
            unstable, missing = going & found.converged & ~kept, going & ~found.converged
            unstable_from[unstable] = trial[unstable]
            # Newton's method may fail for a step too long; a smaller one goes on past the place.
            reached = unstable | (missing & np.isinf(unstable_from)) | (kept & (trial == 1.0))
            self._beyond = _chosen(reached, found, self._beyond)
            self._end = np.where(reached, trial, self._end)
            self._slope[kept] = ((found.points - self.stable.points) / ahead)[kept]
            self.stable = _chosen(kept, found, self.stable)
            self._share = np.where(kept, trial, self._share)
            step = np.where(kept, np.minimum(2.0 * step, LONGEST_SHARE), step / 2.0)
            step = np.minimum(step, (unstable_from - self._share) / 2.0)
            going = going & (step > self._smallest / 2.0) & (self._share < 1.0)
        self._beyond.multipliers[going] = np.nan

    def follow_curve(self, lane: int) -> bool:
        """Follow the curve of one lane to its end, and return whether it goes on from there.

        At most a long step further than where the orbit was missed.
        """
        first, way, share = self._first[lane], self._way[lane], float(self._share[lane])
        point, periods = self.stable.points[lane], int(self._period[lane])
        limit = min(max(share, float(self._end[lane])) + LONGEST_SHARE, 1.0)
        width = float(self._smallest[lane])

        def system_at(shares: Floats) -> LaneSystem:
            return self._system_at(first + shares * way)

        curve = Curve.through(system_at, self._plan, periods, point, share)
        end = end_of_curve(curve, point, share, limit, width)
        if end.inner is None or (end.beyond is None and end.inner.share < limit):
            return False
        self._put(lane, end, curve.scale, width)
        continues = end.beyond is None and limit < 1.0
        if continues:
            self._beyond.multipliers[lane] = np.nan
        return continues

    def _put(self, lane: int, end: End, scale: Floats, width: float) -> None:
        """Put a lane where its curve was followed to."""
        inner, beyond = end.inner, end.beyond or end.inner
        assert inner is not None
        assert beyond is not None
        for orbits, place in ((self.stable, inner), (self._beyond, beyond)):
            orbits.points[lane], orbits.multipliers[lane] = (
                place.place[:-1] * scale,
                place.multipliers,
            )
            orbits.residual[lane], orbits.converged[lane] = place.residual, True
        self._slope[lane] = inner.tangent[:-1] * scale / inner.tangent[-1]
        self._share[lane] = inner.share
        # Where the curve turns back there is no orbit behind the turn.
        behind = 0.0 if beyond.onward else width / 2.0
        self._end[lane] = max(inner.share, beyond.share) + behind
        self._located[lane] = end.beyond is not None
        near_one = abs(beyond.multipliers[0] - 1.0) <= CONFIRMED
        self._halved[lane] = beyond.halved and near_one


def _chosen(lanes: Mask, one: Orbits, other: Orbits) -> Orbits:
    """Take some lanes from one, the rest from the other."""
    return Orbits(
        *(
            np.where(lanes.reshape(-1, *[1] * (mine.ndim - 1)), mine, yours)
            for mine, yours in zip(one, other, strict=True)
        )
    )
