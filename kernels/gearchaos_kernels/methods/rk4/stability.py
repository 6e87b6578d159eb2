"""The stability region of RK4: where a step amplifies no mode (Hairer, Wanner 1996, sec. IV.2).

A step of length h multiplies the mode of an eigenvalue lambda by R(h lambda), with
R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.plan import Floats

Complex = NDArray[np.complex128]

_RAYS = 2**14
_BUNDLE = 2**6
"""Rays whose lengths are computed at once: a program needs few of all rays."""

_HALVINGS = 52


def amplification(z: Complex) -> Floats:
    """Return abs(R(z)), the factor by which one step multiplies a mode, for z = h lambda."""
    return np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))))


def stable_reach(angles: Floats) -> Floats:
    """Return where rays from 0 at these angles, between pi/2 and pi, leave the stability region.

    Along a ray abs(R) is not always monotonic: on the negative real axis it first decreases. But it
    passes 1 only once, so all steps shorter than the longest stable one are stable.
    """
    known, lengths = _rays()
    before = np.searchsorted(known, angles)
    around = np.clip([before - 1, before, before + 1], 0, _RAYS - 1)
    for bundle in np.unique(around // _BUNDLE):
        rays = slice(bundle * _BUNDLE, (bundle + 1) * _BUNDLE)
        if np.isnan(lengths[rays.start]):
            lengths[rays] = _reach(known[rays])
    return np.interp(angles, known, lengths)


@cache
def _rays() -> tuple[Floats, Floats]:
    """Return angles, and the lengths of the rays there: NaN until they are needed."""
    return np.linspace(0.5 * np.pi, np.pi, _RAYS), np.full(_RAYS, np.nan)


def _reach(angles: Floats) -> Floats:
    """Return the lengths of the rays at some angles, which are all between 2.5 and 3."""
    inside, outside = np.full_like(angles, 2.5), np.full_like(angles, 3.0)
    direction = np.exp(1j * angles)
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        stable = amplification(middle * direction) <= 1.0
        inside, outside = np.where(stable, middle, inside), np.where(stable, outside, middle)
    return inside
