"""How an orbit loses stability, named from its Floquet multipliers on both sides."""

from enum import IntEnum

import numpy as np

from gearchaos.arrays import Codes, Complex, Mask

CONFIRMED = 0.1
"""On both sides of a loss of stability its multiplier is this close to the unit circle."""


class StabilityLoss(IntEnum):
    """How an orbit loses stability; of two sides of a boundary, the earlier one here tells more."""

    PERIOD_DOUBLING = 0
    NEIMARK_SACKER = 1
    FOLD = 2
    PERIOD_HALVING = 3
    STAYS_STABLE = 4
    UNCONFIRMED = 5
    NOT_FOLLOWED = 6


STABILITY_LOSS_TEXTS = (
    "period doubling: a real multiplier passes -1",
    "Neimark-Sacker: a complex pair leaves the unit circle",
    "fold, or where the orbit goes on symmetry breaking: a real multiplier reaches +1",
    "the orbit ends in one of half its period: a real multiplier reaches +1",
    "the orbit stays stable: the motion went to one that coexists",
    "not confirmed: the next orbit is unstable, but no multiplier is near the unit circle",
    "the orbit could not be followed, with no multiplier near +1",
)


def loss_of_stability(stable: Complex, beyond: Complex) -> tuple[Codes, Complex]:
    """Tell from the multipliers on either side of a boundary how the orbit loses stability.

    Returned are the `StabilityLoss` and the multiplier that tells, of a pair that with the positive
    imaginary part, both (lanes,).

    ``stable``, ``beyond`` (lanes, states): those of the same orbit, largest modulus first, where it
    is stable and as near as possible beyond; not a number where there is no such orbit. A loss
    counts only if its multiplier lies within `CONFIRMED` of the unit circle on both sides, and
    moves by no more than twice that. An orbit that ends by itself meets an unstable one, so that
    only a real multiplier near +1 explains its end. The multiplier that tells is the largest one
    beyond, or where there is no orbit the largest positive one before; not a number where the orbit
    was not followed.
    """
    positive = np.where((stable.imag == 0.0) & (stable.real > 0.0), stable.real, 0.0).max(axis=1)
    leading = beyond[:, 0]
    ended = np.isnan(leading)
    folded = ended & (positive > 1.0 - CONFIRMED)
    multiplier = np.where(folded, positive, leading.real + 1j * np.abs(leading.imag))
    real = multiplier.imag == 0.0
    kind = np.select(
        [
            folded,
            ended | np.isnan(stable[:, 0]),
            np.abs(multiplier) < 1.0,
            ~_confirmed(stable, leading),
            real & (multiplier.real < 0.0),
            real,
        ],
        [
            StabilityLoss.FOLD,
            StabilityLoss.NOT_FOLLOWED,
            StabilityLoss.STAYS_STABLE,
            StabilityLoss.UNCONFIRMED,
            StabilityLoss.PERIOD_DOUBLING,
            StabilityLoss.FOLD,
        ],
        StabilityLoss.NEIMARK_SACKER,
    ).astype(np.uint8)
    multiplier[kind == StabilityLoss.NOT_FOLLOWED] = np.nan
    return kind, multiplier


def _confirmed(stable: Complex, leading: Complex) -> Mask:
    """Whether the multiplier that leads beyond, (lanes,), leaves the unit circle in between."""
    moved = np.abs(stable - leading[:, np.newaxis])
    near = np.where(np.isnan(moved), np.inf, moved)
    before = np.take_along_axis(stable, np.argmin(near, axis=1)[:, np.newaxis], axis=1)[:, 0]
    confirmed: Mask = near.min(axis=1) <= 2.0 * CONFIRMED
    for side in (before, leading):
        confirmed &= np.abs(np.abs(side) - 1.0) <= CONFIRMED
    return confirmed
