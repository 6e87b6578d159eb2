"""The 0-1 test for chaos (Gottwald, Melbourne 2004): a second opinion without an exponent."""

import numpy as np

from gearchaos.arrays import Floats

ANGLES = np.linspace(np.pi / 5.0, 4.0 * np.pi / 5.0, 61)
"""Angles over which the median is taken; 0 and pi resonate with every motion."""

FEWEST = 100
"""Fewest points of a series for which the test is evaluated."""

SMOOTH = 1e-9
"""Series with a smaller spread, relative to the largest value, count as constant."""


def zero_one(series: Floats) -> float:
    """Return K of a series: near 0 for a regular motion, near 1 for chaos.

    Parameters
    ----------
    series : array, shape (points,)
        Stroboscopic points of one state, one per period.

    Returns
    -------
    float
        NaN with fewer than `FEWEST` points, or if any is not finite.

    Notes
    -----
    The series drives translations p and q by an angle c per point::

        p(n) = sum_j x_j cos(j c),   q(n) = sum_j x_j sin(j c)

    Their mean square displacement M(n) stays bounded for a regular motion and grows linearly in
    chaos. K is the correlation of n with M(n), n up to a tenth of the points, minus the oscillating
    term V(c) = (mean x)^2 (1 - cos n c) / (1 - cos c), as the median over angles (Gottwald,
    Melbourne 2009). The mean is subtracted first, which makes V zero.
    """
    points = series.size
    if points < FEWEST or not np.isfinite(series).all():
        return float("nan")
    moving = series - np.mean(series)
    if np.max(np.abs(moving)) <= SMOOTH * np.max(np.abs(series)):
        return 0.0
    turned = moving * np.exp(1j * np.outer(ANGLES, np.arange(1, points + 1)))
    place, most = np.cumsum(turned, axis=1), points // 10
    counted = points - most
    apart = (place[:, n : n + counted] - place[:, :counted] for n in range(1, most + 1))
    spread = np.array([np.mean(np.abs(one) ** 2, axis=1) for one in apart])
    steps = np.arange(1, most + 1) - (most + 1) / 2.0
    spread -= spread.mean(axis=0)
    size = np.sqrt(np.sum(spread**2, axis=0) * np.sum(steps**2))
    return float(np.median(steps @ spread / np.where(size > 0.0, size, 1.0)))
