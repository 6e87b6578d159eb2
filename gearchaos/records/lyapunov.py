"""Largest Lyapunov exponent and its standard error from the growth of a tangent vector."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from gearchaos.arrays import Floats

BLOCKS = 8
"""Number of adjacent blocks for the standard error; half-overlapping blocks lie between them."""

FEWEST_WAVES = 2
"""Smallest number of slow cosines from which a standard error is estimated."""


def largest_exponent(
    growth: Floats, period: Floats, memory: Floats | None = None
) -> tuple[Floats, Floats]:
    """Estimate the largest Lyapunov exponent of every lane and its standard error.

    Parameters
    ----------
    growth : array, shape (lanes, periods)
        Logarithm of the tangent vector's growth over each recorded mesh period.
    period : array, shape (lanes,)
        Duration of a mesh period in units of tau.
    memory : array, shape (lanes,), optional
        Mesh periods in which the slowest mode of a lane decays by a factor e. Without it, the
        blocks count as independent.

    Returns
    -------
    exponents, errors : array, shape (lanes,)
        Per unit of tau, NaN where the lane diverged. Errors are NaN with fewer than two periods.

    Notes
    -----
    The exponent is the average of the growth rates with weights sin^2 (weighted Birkhoff average;
    Das, Saiki, Sander, Yorke 2017). For periodic and quasi-periodic motion its error falls with the
    third power of the number of periods instead of the first. For chaos its standard error is
    larger by a factor sqrt(3/2). The error follows from the same average over eighths of the record
    that overlap by half (Welch 1967), widened by Student's t. Blocks shorter than the memory depend
    on each other. The larger of this error and that of the slow fluctuations (`_slow_errors`) is
    then returned.
    """
    periods = growth.shape[1]
    exponent = _weighted_mean(growth) / period
    if periods < 2:
        return exponent, np.full_like(exponent, np.nan)
    means = _block_means(growth)
    spread = np.std(means, axis=1, ddof=1) / period
    # The quantile of Student's t at two standard errors, to first order in 1/freedom.
    widening = 1.0 + 1.25 / (means.shape[1] - 1)
    error = widening * spread * np.sqrt(max(1, periods // BLOCKS) / periods)
    if memory is not None:
        slow = memory * BLOCKS > periods
        errors = _slow_errors(means[slow], periods, memory[slow]) / period[slow]
        error[slow] = np.fmax(error[slow], errors)
    return exponent, error


def _block_means(growth: Floats) -> Floats:
    """Return the weighted means of blocks that overlap by half, shape (lanes, blocks)."""
    length = max(1, growth.shape[1] // BLOCKS)
    blocks = sliding_window_view(growth, length, axis=1)[:, :: max(1, length // 2)]
    return _weighted_mean(blocks)


def _slow_errors(means: Floats, periods: int, memory: Floats) -> Floats:
    """Return the standard error of the weighted mean of a record whose memory is long.

    The variance is that of the slowest fluctuations of the record, measured by the first cosines of
    the block means ``means`` (lanes, blocks): the variance of white growth with the same cosines,
    averaged over as many cosines as the record of ``periods`` mesh periods holds multiples of the
    memory (lanes,) (Mueller 2007; Lazarus, Lewis, Stock, Watson 2018). The error is widened by the
    quantile of Student's t with as many degrees of freedom.
    """
    blocks = means.shape[1]
    largest = min(BLOCKS, blocks - 1)
    waves = np.clip(periods / memory, min(FEWEST_WAVES, largest), largest).astype(np.int32)
    most = int(waves.max(initial=1))
    numbers = np.arange(1, most + 1)
    cosines = np.cos(np.pi * numbers[:, np.newaxis] * (np.arange(blocks) + 0.5) / blocks)
    length = max(1, periods // BLOCKS)
    hop, kernel = max(1, length // 2), _weights(length)
    # Each cosine of the block means, written as weights of the single periods.
    over_record = np.zeros((most, periods))
    for block, column in enumerate(cosines.T):
        over_record[:, block * hop : block * hop + length] += np.outer(column, kernel)
    # Elementwise sums: a matrix product would depend on the number of lanes.
    found = np.stack([np.sum(means * cosine, axis=1) for cosine in cosines], axis=1)
    variance = np.cumsum(found**2 / np.sum(over_record**2, axis=1), axis=1) / numbers
    own = variance[np.arange(waves.size), waves - 1] * np.sum(_weights(periods) ** 2)
    # The quantile of Student's t at two standard errors, to second order in 1/freedom.
    widening = 1.0 + 1.25 / waves + 1.53 / waves**2
    errors: Floats = widening * np.sqrt(own)
    return errors


def _weighted_mean(growth: Floats) -> Floats:
    """Return the weighted mean over the last axis (..., periods)."""
    # A matrix product would sum in an order that depends on the number of lanes.
    means: Floats = np.sum(growth * _weights(growth.shape[-1]), axis=-1)
    return means


def _weights(periods: int) -> Floats:
    """Return the weights sin^2 of an average over n mesh periods, of sum 1, (periods,)."""
    weights = np.sin(np.pi * (np.arange(periods) + 0.5) / periods) ** 2
    normalised: Floats = weights / np.sum(weights)
    return normalised
