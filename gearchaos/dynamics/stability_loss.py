"""The kind of stability loss of an orbit, from its Floquet multipliers on both sides."""

from enum import IntEnum

import numpy as np

from gearchaos.arrays import Codes, Complex, Mask

CONFIRMED = 0.1
"""Largest distance of the multiplier from the unit circle on both sides of a loss."""


class StabilityLoss(IntEnum):
    """The kinds of stability loss, the most informative first."""

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
    "fold, or symmetry breaking where the orbit continues: a real multiplier reaches +1",
    "the orbit ends in one of half its period: a real multiplier reaches +1",
    "the orbit stays stable: the motion jumped to a coexisting one",
    "not confirmed: the next orbit is unstable, but no multiplier is near the unit circle",
    "the orbit could not be followed, with no multiplier near +1",
)

NOT_LOST = "the orbit stays stable up to the last value"
"""The text of a loss for an orbit that is stable over its whole range."""


def loss_of_stability(stable: Complex, beyond: Complex) -> tuple[Codes, Complex]:
    """Return how orbits lose stability, from the multipliers on both sides of a boundary.

    Parameters
    ----------
    stable, beyond : array of complex, shape (lanes, states)
        Multipliers of the same orbit, largest modulus first: where it is stable, and as close as
        possible beyond the boundary. NaN where there is no such orbit.

    Returns
    -------
    loss : array of int, shape (lanes,)
        See `StabilityLoss`.
    multiplier : array of complex, shape (lanes,)
        The multiplier that crosses the unit circle (of a pair, with positive imaginary part): the
        largest one beyond, or without an orbit there the largest positive one before; else NaN.

    Notes
    -----
    A loss is confirmed if its multiplier lies within `CONFIRMED` of the unit circle on both sides
    and moves by at most twice that distance. An orbit that ends meets an unstable orbit; only a
    real multiplier near +1 explains its end.
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
    """Whether the leading multiplier beyond, (lanes,), crosses the unit circle in between."""
    moved = np.abs(stable - leading[:, np.newaxis])
    near = np.where(np.isnan(moved), np.inf, moved)
    before = np.take_along_axis(stable, np.argmin(near, axis=1)[:, np.newaxis], axis=1)[:, 0]
    confirmed: Mask = near.min(axis=1) <= 2.0 * CONFIRMED
    for side in (before, leading):
        confirmed &= np.abs(np.abs(side) - 1.0) <= CONFIRMED
    return confirmed
