"""Gears drawn at random that just pass their limits of pitch deviation."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]

_TINY = 1e-300
"""Keeps the deviations of a single tooth, which are zero, from being divided by zero."""


def drawn_gears(
    numbers: npt.ArrayLike,
    seed: int,
    gear: int,
    teeth: int,
    single_um: npt.ArrayLike,
    cumulative_um: npt.ArrayLike,
    eccentricity: npt.ArrayLike = 0.5,
) -> FloatArray:
    """Draw cumulative pitch deviations, shape (realisations, teeth), in um, 0 on tooth 0.

    The single deviations are independent and normal, made to sum to zero, and an eccentricity of
    random phase is added. All is scaled until the largest single deviation or the range of the
    cumulative ones is at its limit: the worst gear of its form that still passes.

    Parameters
    ----------
    numbers, seed, gear : array_like of int, shape (realisations,), and int
        A gear depends on its number, the seed and whether it drives (0) or is driven (1) alone, and
        not on the machine.
    teeth : int
    single_um, cumulative_um, eccentricity : array_like, shape (realisations,) or ()
        Limits of the single deviations' amount and of the cumulative ones' range, in um; share of
        the eccentricity in the range, from 0 to 1.
    """
    numbers, single, range_, share = (
        np.asarray(value)[..., np.newaxis]
        for value in np.broadcast_arrays(numbers, single_um, cumulative_um, eccentricity)
    )
    # Every gear has a counter of its own; the last word keeps it apart from random start states.
    counters = [[0, 0, int(number), 1 + gear] for number in numbers[:, 0]]
    bits = (np.random.Philox(seed, counter=counter) for counter in counters)
    uniform = np.array([np.random.Generator(one).random(2 * teeth + 1) for one in bits])
    turns, phase = uniform[:, teeth:-1], uniform[:, -1:]
    normal = np.sqrt(-2.0 * np.log1p(-uniform[:, :teeth])) * np.cos(2.0 * np.pi * turns)
    around = np.cos(2.0 * np.pi * (phase + np.arange(teeth) / teeth))
    random = np.cumsum(_exact(normal), axis=1)
    random -= random[:, -1:] * (np.arange(1, teeth + 1) / teeth)
    form = (1.0 - share) * random / (np.ptp(random, axis=1, keepdims=True) + _TINY)
    form += share * _exact(around) / 2.0
    steps = np.abs(form - np.roll(form, 1, axis=1)).max(axis=1, keepdims=True)
    spread = np.ptp(form, axis=1, keepdims=True)
    scale = np.minimum(single / (steps + _TINY), range_ / (spread + _TINY))
    drawn: FloatArray = np.round(scale * (form - form[:, :1]), 6)
    return drawn


def _exact(values: FloatArray) -> FloatArray:
    """Round where machines may differ, to a grid on which sums are exact in any order."""
    return np.rint(values * 2.0**20) / 2.0**20
