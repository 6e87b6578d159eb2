"""Kaplan-Yorke dimension of an attractor from its Lyapunov exponents."""

import numpy as np

from gearchaos.arrays import Floats

WITHIN = 2.0
"""Standard errors by which a sum of exponents may lie below zero and still count as zero."""


def kaplan_yorke(exponents: Floats, errors: Floats) -> tuple[Floats, Floats]:
    """Return the Kaplan-Yorke dimension of every lane and its standard error.

    Parameters
    ----------
    exponents : array, shape (lanes, states)
        All Lyapunov exponents of each lane, largest first.
    errors : array, shape (lanes, states)
        Their standard errors.

    Returns
    -------
    dimensions, standard_errors : array, shape (lanes,)
        Dimension of the attractor in the stroboscopic section; that of the flow is larger by 1.
        NaN where the exponents that decide are unknown, or where no sum is negative.

    Notes
    -----
    With S_k the sum of the k largest exponents and k the last one with S_k >= 0 (Kaplan, Yorke
    1979)::

        D = k + S_k / |lambda_(k+1)|

    A sum within two standard errors of zero counts as zero, so that a torus has its dimension. The
    exponents of one record depend on each other. Their errors are added, which is an upper bound::

        s_D = (s_1 + ... + s_k) / |lambda_(k+1)| + |S_k| s_(k+1) / lambda_(k+1)^2

    Where the decision on k changes if all exponents move by one standard error, s_D is at least the
    change of D.
    """
    dimension, error = _dimension(exponents, errors, 0.0)
    for moved in (-1.0, 1.0):
        there, _ = _dimension(exponents, errors, moved)
        error = np.maximum(error, np.nan_to_num(np.abs(there - dimension)))
    return dimension, error


def _dimension(exponents: Floats, errors: Floats, moved: float) -> tuple[Floats, Floats]:
    """Return the dimension with exponents that move by standard errors, and its first-order error.

    What counts as zero stays within the same distance of zero.
    """
    lanes, states = exponents.shape
    exponents = exponents + moved * errors
    sums = np.pad(np.cumsum(exponents, axis=1), ((0, 0), (1, 0)))
    reach = np.pad(np.cumsum(errors, axis=1), ((0, 0), (1, 0)))
    # The first sum that is negative or unknown ends the attractor.
    within = np.logical_and.accumulate(sums >= -WITHIN * reach, axis=1)
    last, every = within.sum(axis=1) - 1, np.arange(lanes)
    known = last < states
    after = np.minimum(last, states - 1)
    size, error = np.abs(exponents[every, after]), errors[every, after]
    size = np.where(size > 0.0, size, np.nan)
    total, spread = sums[every, last], reach[every, last]
    dimension = np.where(known, last + total / size, np.nan)
    return dimension, np.where(known, spread / size + np.abs(total) * error / size**2, np.nan)
