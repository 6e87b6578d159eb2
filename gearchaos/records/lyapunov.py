"""Largest Lyapunov exponent and its standard error from the growth of a tangent vector."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BLOCKS = 10
"""Contiguous blocks of periods whose estimates give the standard error."""


def largest_exponent(
    growth: NDArray[np.float64], period: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Estimate the largest Lyapunov exponent of every lane, per unit of dimensionless time.

    The growth rates of the single periods are averaged with weights sin^2 that fall off smoothly
    at both ends (weighted Birkhoff average; Das, Saiki, Sander, Yorke 2017). On periodic and
    quasi-periodic motions the error then falls like the third power of the number of periods
    instead of the first; on chaotic motions the standard error is a factor sqrt(3/2) larger.

    Parameters
    ----------
    growth : ndarray, shape (lanes, periods)
        Logarithm of the tangent vector's growth over each recorded mesh period.
    period : ndarray, shape (lanes,)
        Mesh period in units of tau.

    Returns
    -------
    exponent, standard_error : ndarray, shape (lanes,)
        The standard error is that of the same average over each of ten blocks; it is not a number
        where fewer than two periods were recorded. Both are not a number where the lane diverged.
    """
    exponent = _weighted_mean(growth) / period
    blocks = np.array_split(growth, min(BLOCKS, growth.shape[1]), axis=1)
    if len(blocks) < 2:
        return exponent, np.full_like(exponent, np.nan)
    means = np.stack([_weighted_mean(block) for block in blocks], axis=1)
    spread = np.std(means, axis=1, ddof=1) / period
    return exponent, spread / np.sqrt(len(blocks))


def _weighted_mean(growth: NDArray[np.float64]) -> NDArray[np.float64]:
    # A matrix product would sum in an order that depends on the number of lanes.
    means: NDArray[np.float64] = np.sum(growth * _weights(growth.shape[1]), axis=1)
    return means


def _weights(periods: int) -> NDArray[np.float64]:
    weights: NDArray[np.float64] = np.sin(np.pi * (np.arange(periods) + 0.5) / periods) ** 2
    weights /= np.sum(weights)
    return weights
