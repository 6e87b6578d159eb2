"""The period of a motion, from its stroboscopic section."""

import numpy as np

from gearchaos.arrays import Counts, Floats

LONGEST_PERIOD = 16
"""Longest period that is found, in section points."""
RETURNS = 3
"""Number of times the section must contain a period."""

POINTS_NEEDED = RETURNS * LONGEST_PERIOD
"""Section points with which every period can be found; further points are not used."""

TOLERANCE = 1e-5
"""Distance, relative to the scale of a state, within which a section returns."""

PORTION = 64
"""Lanes compared at a time: their points fit into the cache."""

_SMALLEST_SCALE = 1e-3
"""Smallest scale of a state, relative to the largest state."""


def motion_period(section: Floats) -> Counts:
    """Return the number of section points after which the motion of each lane repeats, (lanes,).

    The smallest n <= 16 for which each of the last 48 points of the section (lanes, points,
    states), or all points of a shorter section, lies within the tolerance of the point n points
    before. The section must contain the period three times. The scale of a state is its largest
    magnitude, or a thousandth of the largest state if that is more. The period is 0 for chaos,
    quasi-periodic motion, a transient, longer periods, a section with NaN, and too few points.
    """
    return period_of(return_distances(section))


def period_of(distances: Floats, tolerance: float = TOLERANCE) -> Counts:
    """Return the smallest period with a return distance (lanes, 16) within tolerance, or 0."""
    returns = distances <= tolerance
    first = np.argmax(returns, axis=1) + 1
    return np.where(returns.any(axis=1), first, 0).astype(np.int32)


def return_distances(section: Floats) -> Floats:
    """Return the distance of every section from itself 1, 2, ... 16 points earlier, (lanes, 16).

    This is the largest scaled difference (`motion_period`) over all states and the last 48 points
    of a section (lanes, points, states). It is NaN for periods that the section does not contain
    three times, and in lanes with NaN.
    """
    points = section[:, -POINTS_NEEDED:]
    distances = np.full((points.shape[0], LONGEST_PERIOD), np.nan)
    if points.size == 0:
        return distances
    longest = min(LONGEST_PERIOD, points.shape[1] // RETURNS)
    for first in range(0, points.shape[0], PORTION):
        some = slice(first, first + PORTION)
        scaled = points[some] / coordinate_scale(points[some])[:, np.newaxis]
        for n in range(1, longest + 1):
            apart = scaled[:, n:] - scaled[:, :-n]
            distances[some, n - 1] = np.max(np.abs(apart, out=apart), axis=(1, 2))
    return distances


def coordinate_scale(section: Floats) -> Floats:
    """Return the positive scale of every state, shape (lanes, states).

    The largest magnitude of the state on the section (lanes, points, states), or a thousandth of
    the largest state if that is more.
    """
    scale: Floats = np.max(np.abs(section), axis=1)
    scale = np.maximum(scale, _SMALLEST_SCALE * np.max(scale, axis=1, keepdims=True))
    return np.maximum(scale, np.finfo(np.float64).tiny)


def section_distance(one: Floats, other: Floats, period: Counts) -> Floats:
    """Return the largest distance between the sections of two periodic motions, (lanes,).

    The sections (lanes, points, states) are compared over one common period (lanes,) and all
    states; NaN where the period is 0. Two motions of period n may be at different points of the
    same orbit. Of the n possible shifts, the one with the smallest distance counts.
    """
    distance = np.full(period.shape, np.nan)
    for n in np.unique(period[period > 0]):
        lanes = np.flatnonzero(period == n)
        orbit = one[lanes, -n:]
        shifts = [np.roll(other[lanes, -n:], shift, axis=1) for shift in range(n)]
        distance[lanes] = np.min([np.max(np.abs(orbit - s), axis=(1, 2)) for s in shifts], axis=0)
    return distance
