"""Which way a periodic orbit loses its stability as a parameter changes.

An orbit is stable while its Floquet multipliers lie within the unit circle. With backlash the
multipliers may change fast next to a motion that grazes a flank, but they do not jump: the mesh
force is continuous, so that the map over a period has a continuous derivative.
"""

from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Plan, System

from gearchaos.arrays import Codes, Complex, Counts, Floats, Mask
from gearchaos.dynamics.orbits import Orbits, polish

LONGEST_STEP = 1.0 / 16.0  # Share of the way along which an orbit is followed.

MOST_ORBITS = 200
"""Orbits tried along the way; where they do not suffice nothing is known of what lies beyond."""

NEAR_FOLD = 0.1  # An orbit that ends with a real multiplier this close to +1 ends in a fold.


class StabilityLoss(IntEnum):
    """How an orbit loses stability; of two sides of a boundary, the earlier one here tells more."""

    PERIOD_DOUBLING = 0
    NEIMARK_SACKER = 1
    FOLD = 2
    STAYS_STABLE = 3
    NOT_FOLLOWED = 4


STABILITY_LOSS_TEXTS = (
    "period doubling: a real multiplier passes -1",
    "Neimark-Sacker: a complex pair leaves the unit circle",
    "fold, or where the orbit goes on symmetry breaking: a real multiplier reaches +1",
    "the orbit stays stable: the motion went to one that coexists",
    "the orbit could not be followed, with no multiplier near +1",
)


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


def loss_of_stability(stable: Complex, beyond: Complex) -> tuple[Codes, Complex]:
    """Tell from the multipliers on either side of a boundary how the orbit loses stability.

    Returned are the `StabilityLoss` and the multiplier that tells, of a pair that with the positive
    imaginary part, both (lanes,).

    ``stable``, ``beyond`` (lanes, states): those of the same orbit, largest modulus first, where it
    is stable and as near as possible beyond; not a number where there is no such orbit. An orbit
    that ends by itself meets an unstable one, so that only a real multiplier near +1 explains its
    end. The multiplier that tells is the largest one beyond, or where there is no orbit the largest
    positive one before; not a number where the orbit was not followed.
    """
    positive = np.where((stable.imag == 0.0) & (stable.real > 0.0), stable.real, 0.0).max(axis=1)
    leading = beyond[:, 0]
    ended = np.isnan(leading)
    folded = ended & (positive > 1.0 - NEAR_FOLD)
    multiplier = np.where(folded, positive, leading.real + 1j * np.abs(leading.imag))
    real = multiplier.imag == 0.0
    kind = np.select(
        [
            folded,
            ended | np.isnan(stable[:, 0]),
            np.abs(multiplier) < 1.0,
            real & (multiplier.real < 0.0),
            real,
        ],
        [
            StabilityLoss.FOLD,
            StabilityLoss.NOT_FOLLOWED,
            StabilityLoss.STAYS_STABLE,
            StabilityLoss.PERIOD_DOUBLING,
            StabilityLoss.FOLD,
        ],
        StabilityLoss.NEIMARK_SACKER,
    ).astype(np.uint8)
    multiplier[kind == StabilityLoss.NOT_FOLLOWED] = np.nan
    return kind, multiplier


def follow(
    system_at: Callable[[Floats], System],
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
    unstable. All lanes are followed side by side.

    ``system_at`` gives the system of all lanes for a value of the parameter in each, (lanes,);
    ``first``, ``last`` (lanes,): the values at both ends of the way, in either order; ``guess``,
    ``period`` and ``plan`` as for `polish` at the first values; ``width``: wanted distance of the
    stable value and the one beyond. Towards a fold a multiplier nears +1 like the root of the
    distance: with too large a width it is not yet `NEAR_FOLD`.
    """

    def orbits(share: Floats, guess: Floats, followed: Mask) -> Orbits:
        system = system_at(first + share * (last - first))
        sought = np.where(followed, period, np.int32(0))
        return polish(system, guess, sought, plan)

    share = np.zeros_like(first)
    step = np.full_like(first, LONGEST_STEP)
    smallest = width / np.maximum(np.abs(last - first), width)
    stable = orbits(share, guess, period > 0)
    slope = np.zeros_like(stable.points)
    going = stable.stable
    beyond, end = stable, np.zeros_like(first)
    unstable_from = np.full_like(first, np.inf)
    for _ in range(MOST_ORBITS):
        if not going.any():
            break
        trial = np.minimum(share + step, 1.0)
        ahead = np.where(going, trial - share, 1.0)[:, np.newaxis]
        found = orbits(trial, stable.points + ahead * slope, going)
        kept = going & found.stable
        unstable, missing = going & found.converged & ~kept, going & ~found.converged
        unstable_from[unstable] = trial[unstable]
        # Newton's method may fail for a step too long; a smaller one then goes on past the place.
        reached = unstable | (missing & np.isinf(unstable_from)) | (kept & (trial == 1.0))
        beyond, end = _chosen(reached, found, beyond), np.where(reached, trial, end)
        slope[kept] = ((found.points - stable.points) / ahead)[kept]
        stable, share = _chosen(kept, found, stable), np.where(kept, trial, share)
        step = np.where(kept, np.minimum(2.0 * step, LONGEST_STEP), step / 2.0)
        step = np.minimum(step, (unstable_from - share) / 2.0)
        going &= (step > smallest / 2.0) & (share < 1.0)
    beyond.multipliers[going] = np.nan
    exists = stable.converged
    return Followed(
        np.where(exists, first + share * (last - first), np.nan),
        stable,
        np.where(exists, first + end * (last - first), np.nan),
        beyond,
        *loss_of_stability(stable.multipliers, beyond.multipliers),
    )


def _chosen(lanes: Mask, one: Orbits, other: Orbits) -> Orbits:
    """Take some lanes from one, the rest from the other."""
    return Orbits(
        *(
            np.where(lanes.reshape(-1, *[1] * (mine.ndim - 1)), mine, yours)
            for mine, yours in zip(one, other, strict=True)
        )
    )
