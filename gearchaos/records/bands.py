"""Whether a section winds around closed curves, or hops between bands in a fixed order.

A period of more than 16, and the infinite one at the end of a cascade of period doublings, have
averages that converge like those on a torus, and exponents near zero. But every 2nd point of a
doubled orbit, or every 3rd of a tripled one, stays on one side; on a curve with an irrational
rotation every n-th point goes everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearchaos.records.period import LONGEST_PERIOD

Floats = NDArray[np.float64]

STRIDES = (2, 3, 5, 7)
"""Every so many points of a curve are averaged; what the windows of chaos are made of."""

FEWEST = 16
"""Points that every subsequence must have."""


def subsequence_spread(section: Floats) -> Floats:
    """Return how far the averages of every 2nd, 3rd, 5th and 7th point of a curve lie apart.

    A torus may cut the section in up to 16 curves, which are visited in turn. For each number of
    curves and each stride the points of a curve fall into subsequences; their averages are weighted
    by exp(-1/(t(1-t))) and differ by so many standard deviations of the curve. The number of curves
    with the smallest difference counts; infinite, shape (lanes,), with too few points to tell.
    """
    lanes, points, states = section.shape
    smallest = np.full(lanes, np.inf)
    for curves in range(1, LONGEST_PERIOD + 1):
        if points < FEWEST * curves * max(STRIDES):
            break
        largest = np.zeros(lanes)
        for stride in STRIDES:
            turns = points // (curves * stride)
            dealt = section[:, -turns * curves * stride :]
            dealt = dealt.reshape(lanes, turns, stride, curves, states)
            deviation = np.std(dealt, axis=(1, 2))
            averages = np.einsum("t,ltpcs->lpcs", smooth_weights(turns), dealt)
            apart = np.ptp(averages, axis=1)
            # A coordinate at rest has nothing that could differ.
            apart /= np.where(deviation > 0.0, deviation, 1.0)
            largest = np.maximum(largest, np.max(apart, axis=(1, 2)))
        smallest = np.minimum(smallest, largest)
    return smallest


def smooth_weights(points: int) -> Floats:
    """Return the weights exp(-1/(t(1-t))) of an average over so many points, of sum 1."""
    time = (np.arange(points) + 0.5) / points
    weights = np.exp(-1.0 / (time * (1.0 - time)))
    normalised: Floats = weights / np.sum(weights)
    return normalised
