"""How far the Runge-Kutta method of order 4 is stable along every direction of the left half plane.

A step of length h multiplies the mode of an eigenvalue lambda by R(h lambda),
R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 (Hairer, Wanner 1996, sec. IV.2). The size of R need not rise
steadily along a ray from 0: on the negative real axis it first falls. But on every ray of the left
half plane it passes 1 only once, so that all steps shorter than the longest stable one are stable.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ROUNDING = 1e-9
"""Relative error granted to eigenvalues: an undamped mode lies on the imaginary axis up to that."""

_RAYS = 2**14


def amplification(z: NDArray[np.complex128]) -> Floats:
    """Return abs(R(z)), by which one step multiplies a mode, for z = h lambda."""
    return np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))))


def _reach(angles: Floats) -> Floats:
    """Return where rays at these angles leave the stable region; all of them between 2.5 and 3."""
    inside, outside = np.full_like(angles, 2.5), np.full_like(angles, 3.0)
    for _ in range(52):
        middle = 0.5 * (inside + outside)
        stable = amplification(middle * np.exp(1j * angles)) <= 1.0
        inside, outside = np.where(stable, middle, inside), np.where(stable, outside, middle)
    return inside


_ANGLES = np.linspace(0.5 * np.pi, np.pi, _RAYS)
_LENGTHS = _reach(_ANGLES)

SHORTEST_RAY = float(np.min(_LENGTHS))
"""Radius of the largest half disc about 0 within the stable region, 2.6156."""


def steps_per_time(eigenvalues: NDArray[np.complex128]) -> Floats:
    """Return the fewest stable steps per unit of time for every eigenvalue.

    It is abs(lambda) over the length of the ray through lambda, and 0 where the real part is
    positive: what grows by itself may grow in the steps.
    """
    size = np.abs(eigenvalues)
    ray = np.interp(np.abs(np.angle(eigenvalues)), _ANGLES, _LENGTHS)
    return np.where(eigenvalues.real <= ROUNDING * size, size / ray, 0.0)
