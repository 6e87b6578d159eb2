"""The number of bands of a section, and whether it lies on curves or visits bands in a fixed order.

A period above 16, and the limit of a cascade of period doublings, have averages that converge as on
a torus and exponents near zero. But every 2nd point of a doubled orbit, or every 3rd of a tripled
orbit, stays in one part of the section. On a curve with an irrational rotation, every n-th point
visits the whole curve.
"""

import numpy as np

from gearchaos.arrays import Counts, Floats, Integers, Mask
from gearchaos.records.period import LONGEST_PERIOD, coordinate_scale

STRIDES = (2, 3, 5, 7)
"""Every 2nd, 3rd, 5th and 7th point of a curve is averaged: the factors of periodic windows."""

FEWEST = 16
"""Smallest number of points of a subsequence."""

MOST_BAND_POINTS = 512
"""Points at the end of a section used to count bands; the cost grows with their square."""

NEIGHBOURS = 4
"""Number of nearest points that must lie in the same band."""

PORTION = 64
"""Points compared at a time: most chaotic sections are found to have one band early."""

ROUNDING = 1e-12
"""Bound on rounding in the square of a distance, relative to the largest square of a point."""

EXPLAINED = 0.1
"""Share of variance above which subsequences may be bands; for 13 random ones it is 0.02."""


def subsequence_spread(section: Floats) -> Floats:
    """Return the spread of the averages of every 2nd, 3rd, 5th and 7th point of curves.

    A torus may intersect the section (lanes, points, states) in up to 16 curves, visited in turn.
    For each number of curves and each stride, the points of a curve form subsequences. Their
    averages, with weights exp(-1/(t(1-t))), differ by a number of standard deviations of the curve.
    Returned is the smallest difference over the number of curves, shape (lanes,); infinite with too
    few points.
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
            # A constant state has no difference.
            apart /= np.where(deviation > 0.0, deviation, 1.0)
            largest = np.maximum(largest, np.max(apart, axis=(1, 2)))
        smallest = np.minimum(smallest, largest)
    return smallest


def band_count(section: Floats) -> Counts:
    """Return the number of bands of every section, which are visited in turn, shape (lanes,).

    The largest n <= 16 such that the four nearest neighbours of each of the last 512 points lie n,
    2n, 3n, ... points before or after it. This rule needs no threshold for a distance, and holds
    for curves and scattered points in any number of dimensions. A section (lanes, points, states)
    of fewer than 32 points has 1, as well as a section whose bands would have fewer than 16 points.
    """
    points = section[:, -MOST_BAND_POINTS:]
    count = np.ones(points.shape[0], dtype=np.int32)
    for lane in np.flatnonzero(_may_have_bands(points)):
        common = _common_step(points[lane] / coordinate_scale(points[lane : lane + 1])[0])
        if 0 < common * FEWEST <= points.shape[1]:
            count[lane] = max(n for n in range(1, LONGEST_PERIOD + 1) if common % n == 0)
    return count


def _may_have_bands(section: Floats) -> Mask:
    """Whether subsequences explain much of a state's variance, (lanes,): a cheap first test."""
    lanes, points, _ = section.shape
    found = np.zeros(lanes, dtype=np.bool_)
    series = np.ascontiguousarray(section.transpose(0, 2, 1))
    for stride in (2, 3, 5, 7, 11, 13):
        turns, rest = points // stride, np.flatnonzero(~found)
        if turns < FEWEST:
            break
        dealt = series[rest, :, -turns * stride :]
        means = [np.mean(dealt[:, :, first::stride], axis=2) for first in range(stride)]
        between = np.var(means, axis=0)
        variance = np.var(dealt, axis=2)
        found[rest] = np.any(between > EXPLAINED * variance, axis=1)
    return found


def _common_step(points: Floats) -> int:
    """Return the greatest common divisor of the steps in time between nearest neighbours."""
    every, common = np.arange(points.shape[0]), 0
    centred = points - np.mean(points, axis=0)
    squares = np.sum(centred**2, axis=1)
    others = np.vstack([centred.T, squares])
    own = np.hstack([-2.0 * centred, np.ones((every.size, 1))])
    error = ROUNDING * np.max(squares)
    for some in np.split(every, every[::PORTION][1:]):
        # The squares of the distances, less the same number for all neighbours of a point.
        steps, distances = _nearest(own[some] @ others, some, NEIGHBOURS + 1)
        unsure = ~(distances[-1] - distances[-2] > error)
        if unsure.any():
            exact = np.zeros((np.count_nonzero(unsure), every.size))
            for coordinate in points.T:
                exact += np.subtract.outer(coordinate[some[unsure]], coordinate) ** 2
            steps[:-1, unsure] = _nearest(exact, some[unsure], NEIGHBOURS)[0]
        common = int(np.gcd.reduce(steps[:-1], axis=None, initial=common))
        if common == 1:
            break
    return common


def _nearest(apart: Floats, some: Integers, count: int) -> tuple[Integers, Floats]:
    """Return steps in time to the nearest neighbours of some points, and their distances.

    ``apart`` (points, all points) is overwritten. Both results have the shape (count, points).
    """
    rows, nearest = np.arange(some.size), some
    steps, distances = np.empty((count, some.size), np.intp), np.empty((count, some.size))
    for number in range(count):
        # Not the point itself, nor the neighbour before.
        apart[rows, nearest] = np.inf
        # The smallest element is found much faster than a partition.
        nearest = np.argmin(apart, axis=1)
        steps[number], distances[number] = np.abs(nearest - some), apart[rows, nearest]
    return steps, distances


def smooth_weights(points: int) -> Floats:
    """Return the weights exp(-1/(t(1-t))) of an average over n points, of sum 1, (points,)."""
    time = (np.arange(points) + 0.5) / points
    weights = np.exp(-1.0 / (time * (1.0 - time)))
    normalised: Floats = weights / np.sum(weights)
    return normalised
