"""The period of a motion, read off its stroboscopic section."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LONGEST_PERIOD = 16
"""Longest period looked for, in mesh periods."""

RETURNS = 3
"""A period counts if the section holds it so many times."""

POINTS_NEEDED = RETURNS * LONGEST_PERIOD
"""Section points with which every period can be told; more are not looked at."""

TOLERANCE = 1e-5
"""Distance, relative to the size of the coordinate, within which a section returns."""

_SMALLEST_SCALE = 1e-3


def motion_period(section: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return after how many mesh periods the motion of each lane repeats.

    The smallest n <= 16 for which the last 48 section points, or all there are, each lie within
    the tolerance of the one n points before; the section must hold the period three times. A
    coordinate is measured by its largest magnitude, or by a thousandth of that of the largest
    coordinate where this is more.

    Parameters
    ----------
    section : ndarray, shape (lanes, points, states)
        Once a mesh period, in the order of time.

    Returns
    -------
    ndarray of int, shape (lanes,)
        0 where no such period is found: chaos, quasi-periodic motion, a transient that has not
        died away, longer periods, a section with NaN, or too few points.
    """
    points = section[:, -POINTS_NEEDED:]
    period = np.zeros(points.shape[0], dtype=np.int32)
    if points.size == 0:
        return period
    scale = np.max(np.abs(points), axis=1, keepdims=True)
    scale = np.maximum(scale, _SMALLEST_SCALE * np.max(scale, axis=2, keepdims=True))
    for n in range(min(LONGEST_PERIOD, points.shape[1] // RETURNS), 0, -1):
        distance = np.abs(points[:, n:] - points[:, :-n])
        period[np.all(distance <= TOLERANCE * scale, axis=(1, 2))] = n
    return period


def section_distance(
    one: NDArray[np.float64], other: NDArray[np.float64], period: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Return the largest distance between the sections of two periodic motions.

    Two motions of period n may pass the points of their orbit n mesh periods apart; of the n
    ways to align them the one with the smallest distance counts.

    Parameters
    ----------
    one, other : ndarray, shape (lanes, points, states)
    period : ndarray of int, shape (lanes,)
        The common period in mesh periods; 0 where there is none.

    Returns
    -------
    ndarray, shape (lanes,)
        Largest absolute difference over one period and all states; NaN where the period is 0.
    """
    distance = np.full(period.shape, np.nan)
    for n in np.unique(period[period > 0]):
        lanes = np.flatnonzero(period == n)
        orbit = one[lanes, -n:]
        shifts = [np.roll(other[lanes, -n:], shift, axis=1) for shift in range(n)]
        distance[lanes] = np.min([np.max(np.abs(orbit - s), axis=(1, 2)) for s in shifts], axis=0)
    return distance
