"""The period of a motion, read off its stroboscopic section."""

import numpy as np

from gearchaos.arrays import Counts, Floats

LONGEST_PERIOD = 16  # Longest period looked for, in mesh periods.
RETURNS = 3  # A period counts if the section holds it so many times.

POINTS_NEEDED = RETURNS * LONGEST_PERIOD
"""Section points with which every period can be told; more are not looked at."""

TOLERANCE = 1e-5
"""Distance, relative to the size of the coordinate, within which a section returns."""

_SMALLEST_SCALE = 1e-3


def motion_period(section: Floats) -> Counts:
    """Return after how many mesh periods the motion of each lane repeats, shape (lanes,).

    The smallest n <= 16 for which the last 48 points of the section (lanes, points, states), or all
    there are, each lie within the tolerance of the one n points before; the section must hold the
    period three times. A coordinate is measured by its largest magnitude, or by a thousandth of
    that of the largest coordinate where this is more. 0 where no such period is found: chaos,
    quasi-periodic motion, a transient that has not died away, longer periods, a section with NaN,
    or too few points.
    """
    return period_of(return_distances(section))


def period_of(distances: Floats, tolerance: float = TOLERANCE) -> Counts:
    """Return the smallest period whose return distance (lanes, 16) is within tolerance, or 0."""
    returns = distances <= tolerance
    first = np.argmax(returns, axis=1) + 1
    return np.where(returns.any(axis=1), first, 0).astype(np.int32)


def return_distances(section: Floats) -> Floats:
    """Return how far from itself every section comes back after 1, 2, ... 16 mesh periods.

    Of the last 48 points of a section (lanes, points, states) the largest distance, (lanes, 16),
    over all points and coordinates, each measured as in `motion_period`; NaN for periods that the
    section does not hold three times, and in lanes with NaN.
    """
    points = section[:, -POINTS_NEEDED:]
    distances = np.full((points.shape[0], LONGEST_PERIOD), np.nan)
    if points.size == 0:
        return distances
    points = points / coordinate_scale(points)[:, np.newaxis]
    for n in range(1, min(LONGEST_PERIOD, points.shape[1] // RETURNS) + 1):
        distances[:, n - 1] = np.max(np.abs(points[:, n:] - points[:, :-n]), axis=(1, 2))
    return distances


def coordinate_scale(section: Floats) -> Floats:
    """Return what distances in every coordinate are measured by, shape (lanes, states).

    The largest magnitude of the coordinate on the section (lanes, points, states), or a thousandth
    of that of the largest coordinate where this is more; positive.
    """
    scale: Floats = np.max(np.abs(section), axis=1)
    scale = np.maximum(scale, _SMALLEST_SCALE * np.max(scale, axis=1, keepdims=True))
    return np.maximum(scale, np.finfo(np.float64).tiny)


def section_distance(one: Floats, other: Floats, period: Counts) -> Floats:
    """Return the largest distance between the sections of two periodic motions.

    Over one common period (lanes,) and all states of both sections (lanes, points, states); NaN
    where the period is 0. Two motions of period n may pass the points of their orbit n mesh periods
    apart; of the n ways to align them the one with the smallest distance counts.
    """
    distance = np.full(period.shape, np.nan)
    for n in np.unique(period[period > 0]):
        lanes = np.flatnonzero(period == n)
        orbit = one[lanes, -n:]
        shifts = [np.roll(other[lanes, -n:], shift, axis=1) for shift in range(n)]
        distance[lanes] = np.min([np.max(np.abs(orbit - s), axis=(1, 2)) for s in shifts], axis=0)
    return distance
