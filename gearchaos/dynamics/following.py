"""How a periodic orbit loses its stability as a parameter changes.

An orbit is stable while its Floquet multipliers lie within the unit circle. With clearances the
multipliers may change fast next to a motion that grazes a flank, but they do not jump: the forces
of the elements are continuous, so that the map over a period has a continuous derivative.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Plan

from gearchaos.arrays import Codes, Complex, Counts, Floats, Integers, Mask
from gearchaos.dynamics.arclength import Curve, End, end_of_curve
from gearchaos.dynamics.curve_defects import defects_of
from gearchaos.dynamics.orbits import Orbits, polish
from gearchaos.dynamics.side_by_side import run, together
from gearchaos.dynamics.stability_loss import CONFIRMED, StabilityLoss, loss_of_stability

LONGEST_SHARE = 1.0 / 16.0
"""Largest step along the way, as a share of it."""

MOST_ORBITS = 200
"""Largest number of steps along the way; beyond the last step nothing is known."""

MOST_CURVES = 8
"""Largest number of places per lane at which an orbit is followed along its curve."""


class Orbit(NamedTuple):
    """A periodic orbit.

    Attributes
    ----------
    period : int
        Period in excitation periods.
    point : array, shape (states,)
        Dimensionless state at the beginning, at mesh phase 0.
    multipliers : array of complex, shape (states,)
        Floquet multipliers, largest modulus first.
    exponent : float
        Largest Lyapunov exponent per unit of tau.
    residual : float
        Distance after one period, relative to the scale of each state.
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
    """A periodic orbit followed along a parameter.

    Attributes
    ----------
    value : float
        Last value of the parameter at which the orbit is stable.
    orbit : Orbit
        The orbit at this value.
    beyond : float
        First value at which the orbit is unstable or not found; the last value of the way if the
        orbit stays stable.
    loss : StabilityLoss
        How the orbit loses stability.
    text : str
        The same in words.
    multiplier : complex
        The Floquet multiplier that shows the loss, see `loss_of_stability`.
    """

    value: float
    orbit: Orbit
    beyond: float
    loss: StabilityLoss
    text: str
    multiplier: complex


class Followed(NamedTuple):
    """The orbits of some lanes, followed until they lose stability or to the end of the way.

    Attributes
    ----------
    stable_value, beyond_value : array, shape (lanes,)
        Last value of the parameter with a stable orbit, and first value at which the orbit is
        unstable or not found. Both are the end of the way where the orbit is stable everywhere, and
        NaN where there is no orbit at the beginning.
    stable, beyond : Orbits
        The orbits at these values.
    loss : array of int, shape (lanes,)
        See `StabilityLoss`.
    multiplier : array of complex, shape (lanes,)
        The multiplier that shows the loss, see `loss_of_stability`.
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

    Parameters
    ----------
    system_at : callable
        Returns the systems of the lanes at values (lanes,) of the parameter.
    guess : array, shape (lanes, states)
        States next to the orbits at the first values.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where there is no orbit.
    first, last : array, shape (lanes,)
        Values at both ends of the way, in either order.
    width : float
        Wanted distance between the last stable value and the value beyond.
    plan : Plan
        Method and steps per period, as for `polish`.

    Notes
    -----
    Newton's method starts from the line through the last two orbits. Steps are halved where no
    orbit is found; the loss of stability is bisected. Where an orbit ends, or the unstable orbit
    belongs to another branch, it is followed along its curve (`arclength`), and onwards where the
    curve continues.
    """
    lanes = _Lanes(system_at, guess, period, (first, last), width, plan)
    going = lanes.stable.stable
    for _ in range(1 + MOST_CURVES):
        lanes.march(going)
        going = np.zeros_like(going)
        lost = np.flatnonzero(lanes.unexplained)
        going[lost] = lanes.follow_curves(lost.tolist())
        if not going.any():
            break
    return lanes.followed


class _Lanes:
    """The state of orbits that are followed side by side; arguments as in `follow`."""

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
        # At most a long step, so that a large width does not end the search at the first step.
        share = width / np.maximum(np.abs(self._way), width)
        self._smallest = np.minimum(share, LONGEST_SHARE)
        self._share = np.zeros_like(self._first)
        self.stable = self._orbits(self._share, guess, period > 0)
        self._slope = np.zeros_like(self.stable.points)
        self._beyond, self._end = self.stable, np.zeros_like(self._first)
        # Curves that were followed to an end, and those that end in an orbit of half the period.
        self._located = np.zeros(self._first.shape, np.bool_)
        self._halved = np.zeros(self._first.shape, np.bool_)

    def _orbits(self, share: Floats, guess: Floats, followed: Mask) -> Orbits:
        """Return the orbits of the lanes ``followed`` at shares of their ways (lanes,)."""
        system = self._system_at(self._first + share * self._way)
        sought = np.where(followed, self._period, np.int32(0))
        return polish(system, guess, sought, self._plan)

    @property
    def _loss(self) -> tuple[Codes, Complex]:
        """The `StabilityLoss` of every lane and its multiplier."""
        kind, multiplier = loss_of_stability(self.stable.multipliers, self._beyond.multipliers)
        kind[self._halved] = StabilityLoss.PERIOD_HALVING
        return kind, multiplier

    @property
    def unexplained(self) -> Mask:
        """Stable orbits that end, or lie beside an unstable one of another branch, (lanes,)."""
        other = self._loss[0] == StabilityLoss.UNCONFIRMED
        ended: Mask = np.isnan(self._beyond.multipliers[:, 0]) | other
        return ended & self.stable.stable & ~self._located

    @property
    def followed(self) -> Followed:
        """The result for all lanes."""
        exists = self.stable.converged
        return Followed(
            np.where(exists, self._first + self._share * self._way, np.nan),
            self.stable,
            np.where(exists, self._first + self._end * self._way, np.nan),
            self._beyond,
            *self._loss,
        )

    def march(self, going: Mask) -> None:
        """Follow the orbits of the lanes ``going`` step by step until they end or are unstable."""
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
            # Newton's method may fail for a long step and succeed for a smaller one.
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

    def follow_curves(self, lanes: list[int]) -> list[bool]:
        """Follow the curves of lanes to their ends; return which continue from there.

        A curve is followed at most one long step beyond the place where the orbit was missed.
        """
        share = np.minimum(np.maximum(self._share, self._end) + LONGEST_SHARE, 1.0)
        limits, curves, searches = share.tolist(), {}, []
        for lane in lanes:
            at, point = float(self._share[lane]), self.stable.points[lane]
            curves[lane] = self._curve(lane).through(point, at)
            width = float(self._smallest[lane])
            searches.append(end_of_curve(curves[lane], point, at, limits[lane], width))
        ends = run(together(searches), defects_of)
        return [
            self._continued(lane, end, curves[lane], limits[lane])
            for lane, end in zip(lanes, ends, strict=True)
        ]

    def _curve(self, lane: int) -> Curve:
        """Return the curve of the orbit of a lane, without scales."""
        period = int(self._period[lane])
        repeats = self._systems(np.array([lane]), np.zeros(1)).repeats_after
        plan = self._plan.over(period * repeats)
        return Curve(self._systems, lane, plan, period, np.ones(self.stable.points.shape[1]))

    def _systems(self, lanes: Integers, shares: Floats) -> LaneSystem:
        """Return the systems of some of the lanes, by their numbers, at shares of their ways."""
        return self._system_at(self._first[lanes] + shares * self._way[lanes])

    def _continued(self, lane: int, end: End, curve: Curve, limit: float) -> bool:
        """Set a lane to the end of its followed curve; return whether the curve continues."""
        if end.inner is None or (end.beyond is None and end.inner.share < limit):
            return False
        self._put(lane, end, curve.scale, float(self._smallest[lane]))
        continues = end.beyond is None and limit < 1.0
        if continues:
            self._beyond.multipliers[lane] = np.nan
        return continues

    def _put(self, lane: int, end: End, scale: Floats, width: float) -> None:
        """Set a lane to the end of its followed curve; ``scale`` (states,) of the curve."""
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
        # Where the curve turns back, there is no orbit beyond the fold.
        behind = 0.0 if beyond.onward else width / 2.0
        self._end[lane] = max(inner.share, beyond.share) + behind
        self._located[lane] = end.beyond is not None
        near_one = abs(beyond.multipliers[0] - 1.0) <= CONFIRMED
        self._halved[lane] = beyond.halved and near_one


def _chosen(lanes: Mask, one: Orbits, other: Orbits) -> Orbits:
    """Take the orbits of some lanes from ``one``, of all others from ``other``."""
    return Orbits(
        *(
            np.where(lanes.reshape(-1, *[1] * (mine.ndim - 1)), mine, yours)
            for mine, yours in zip(one, other, strict=True)
        )
    )
