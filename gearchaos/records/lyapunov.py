"""Largest Lyapunov exponent and its standard error from the growth of a tangent vector."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from gearchaos.arrays import Floats

BLOCKS = 8
"""Blocks side by side whose estimates give the standard error; half-way blocks lie between them."""


def largest_exponent(growth: Floats, period: Floats) -> tuple[Floats, Floats]:
    """Estimate the largest Lyapunov exponent of every lane, per unit of tau, with its error.

    The growth rates of the single periods are averaged with weights sin^2 that fall off smoothly at
    both ends (weighted Birkhoff average; Das, Saiki, Sander, Yorke 2017). On periodic and
    quasi-periodic motions the error then falls like the third power of the number of periods
    instead of the first; on chaotic motions the standard error is a factor sqrt(3/2) larger. It is
    that of the same average over blocks of an eighth of the record that overlap by half (Welch
    1967: nearly independent under these weights), widened such that two of it cover as much as two
    of a normal distribution; it is not a number where fewer than two periods were recorded.

    ``growth`` (lanes, periods): logarithm of the tangent vector's growth over each recorded mesh
    period; ``period`` (lanes,): its duration. Returned are two arrays (lanes,), both not a number
    where the lane diverged.
    """
    periods = growth.shape[1]
    exponent = _weighted_mean(growth) / period
    if periods < 2:
        return exponent, np.full_like(exponent, np.nan)
    length = max(1, periods // BLOCKS)
    blocks = sliding_window_view(growth, length, axis=1)[:, :: max(1, length // 2)]
    means = _weighted_mean(blocks)
    spread = np.std(means, axis=1, ddof=1) / period
    # The quantile of Student's t at two standard errors, to first order in 1/freedom.
    few = 1.0 + 1.25 / (means.shape[1] - 1)
    return exponent, few * spread * np.sqrt(length / periods)


def _weighted_mean(growth: Floats) -> Floats:
    periods = growth.shape[-1]
    weights = np.sin(np.pi * (np.arange(periods) + 0.5) / periods) ** 2
    # A matrix product would sum in an order that depends on the number of lanes.
    means: Floats = np.sum(growth * (weights / np.sum(weights)), axis=-1)
    return means
