"""On how many bands a section lies, and whether it winds around curves or hops in a fixed order.

A period of more than 16, and the infinite one at the end of a cascade of period doublings, have
averages that converge like those on a torus, and exponents near zero. But every 2nd point of a
doubled orbit, or every 3rd of a tripled one, stays on one side; on a curve with an irrational
rotation every n-th point goes everywhere.
"""

import numpy as np

from gearchaos.arrays import Counts, Floats, Mask
from gearchaos.records.period import LONGEST_PERIOD, coordinate_scale

STRIDES = (2, 3, 5, 7)
"""Every so many points of a curve are averaged; what the windows of chaos are made of."""

FEWEST = 16  # Points that every subsequence must have.

MOST_BAND_POINTS = 512
"""Points, the last ones, of which the bands are counted: comparing all pairs costs their square."""

NEIGHBOURS = 4  # Nearest points that must lie in the same band.

PORTION = 64  # Points looked at together: most chaotic sections show soon that they have one band.

EXPLAINED = 0.1
"""Share of the variance beyond which subsequences may be bands; of 13 random ones it is 0.02."""


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


def band_count(section: Floats) -> Counts:
    """Return on how many bands every section lies, which are visited in turn, shape (lanes,).

    The largest n <= 16 such that every n-th point stays away from the other ones: the four nearest
    neighbours of each of the last 512 points come n, 2n, 3n, ... points before or after it. That
    needs no distance below which points are near, and holds for curves and scattered points in any
    number of dimensions. Of section (lanes, points, states) with fewer than 32 points it is 1, and
    also where a band would have fewer than 16 points.
    """
    points = section[:, -MOST_BAND_POINTS:]
    count = np.ones(points.shape[0], dtype=np.int32)
    for lane in np.flatnonzero(_may_have_bands(points)):
        common = _common_step(points[lane] / coordinate_scale(points[lane : lane + 1])[0])
        if 0 < common * FEWEST <= points.shape[1]:
            count[lane] = max(n for n in range(1, LONGEST_PERIOD + 1) if common % n == 0)
    return count


def _may_have_bands(section: Floats) -> Mask:
    """Whether subsequences explain much of a coordinate's variance: looking at pairs is dear."""
    lanes, points, states = section.shape
    found = np.zeros(lanes, dtype=np.bool_)
    for stride in (2, 3, 5, 7, 11, 13):
        turns = points // stride
        if turns < FEWEST:
            break
        dealt = section[:, -turns * stride :].reshape(lanes, turns, stride, states)
        variance = np.var(dealt, axis=(1, 2))
        between = np.var(np.mean(dealt, axis=1), axis=1)
        found |= np.any(between > EXPLAINED * variance, axis=1)
    return found


def _common_step(points: Floats) -> int:
    """Return the greatest common divisor of the steps in time between nearest neighbours."""
    every, common = np.arange(points.shape[0]), 0
    for some in np.split(every, every[::PORTION][1:]):
        apart = np.zeros((some.size, every.size))
        for coordinate in points.T:
            apart += np.subtract.outer(coordinate[some], coordinate) ** 2
        apart[np.arange(some.size), some] = np.inf
        nearest = np.argpartition(apart, NEIGHBOURS, axis=1)[:, :NEIGHBOURS]
        steps = np.abs(nearest - some[:, np.newaxis])
        common = int(np.gcd.reduce(steps, axis=None, initial=common))
        if common == 1:
            break
    return common


def smooth_weights(points: int) -> Floats:
    """Return the weights exp(-1/(t(1-t))) of an average over so many points, of sum 1."""
    time = (np.arange(points) + 0.5) / points
    weights = np.exp(-1.0 / (time * (1.0 - time)))
    normalised: Floats = weights / np.sum(weights)
    return normalised
