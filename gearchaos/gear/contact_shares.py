"""How the tooth pairs in mesh share the mesh force: by the lengths of their contact lines.

The contact line of a pair of helical gears grows over the smaller of both contact ratios, stays,
and shrinks again, until the pair has been in mesh for their sum, in mesh periods; all of them
together give the stiffness of Pan 2021, eqs 15-18.
"""

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import ConfigurationError

Floats = NDArray[np.float64]

MOST_CONTACT = 5.0
"""Largest total contact ratio: the kernels have room for seven pairs in mesh or next to it."""

_SAMPLES = 64
"""Places within a cell over which a share is averaged."""


def contact_shares(
    transverse: float, overlap: float, smoothing: float, fundamental: complex = 0.0
) -> tuple[Floats, int, float]:
    """Return the share of a tooth pair in the mesh force while it is in mesh.

    Its mean shares (cells,) from its entry on, the cells of a mesh period, and the mesh phase, in
    periods, at which it enters. ``transverse``, ``overlap``: the contact ratios eps_alpha > 0 and
    eps_beta >= 0; ``smoothing``: mesh periods over which a pair takes load at least, as shares jump
    otherwise in a spur pair; ``fundamental``: cosine - i sine of the first harmonic of the mesh
    stiffness, whose phase the total length of the contact lines has; without one the first pair
    comes into mesh at phase 0. Raises ConfigurationError if there are moments without any pair in
    mesh, or too many are.
    """
    if not 1.0 <= transverse + overlap <= MOST_CONTACT:
        raise ConfigurationError(
            f"[pair]: its total contact ratio {transverse + overlap:.3g} must be between 1 and "
            f"{MOST_CONTACT:g} for pitch errors tooth by tooth; check the data of the gears"
        )
    # A spline reaches over six cells.
    per_period = max(1, round(6.0 / smoothing))
    cells = int(np.ceil((transverse + overlap) * per_period))
    samples = (np.arange(_SAMPLES * per_period) + 0.5) / (_SAMPLES * per_period)
    turns = np.arange(cells // per_period + 1)[:, np.newaxis]
    lines = _contact_line(samples + turns, transverse, overlap)
    shares = (lines / lines.sum(axis=0)).reshape(-1, _SAMPLES).mean(axis=1)[:cells]
    # The phase of the total length, were it to begin at phase 0.
    own = complex(np.mean(lines.sum(axis=0) * np.exp(-2j * np.pi * samples)))
    turned = fundamental * own.conjugate()
    entry = -np.angle(turned) / (2.0 * np.pi) % 1.0 if abs(turned) > 1e-9 else 0.0
    return shares, per_period, float(entry)


def _contact_line(place: Floats, transverse: float, overlap: float) -> Floats:
    """Length of the contact line of a pair, relative, so many mesh periods after its entry."""
    if overlap == 0.0:
        return np.where(place < transverse, 1.0, 0.0)
    left = transverse + overlap - place
    return np.clip(np.minimum(place, left), 0.0, min(transverse, overlap))
