"""The confidence interval of a counted share."""

import numpy as np
from numpy.typing import ArrayLike

from gearchaos.arrays import Floats

CONFIDENCE_95 = 1.959963984540054
"""Standard deviations of a normal distribution within which 95 % of it lie."""


def wilson_interval(counted: ArrayLike, of: ArrayLike) -> Floats:
    """Return the 95 % confidence interval of a share, shape (..., 2).

    Parameters
    ----------
    counted : array of int, shape (...)
        Number of independent trials with a property.
    of : array of int, shape (...)
        Number of trials.

    Returns
    -------
    array, shape (..., 2)
        Lower and upper bound; NaN without a trial.

    Notes
    -----
    The bounds are the shares that differ from the observed share by 1.96 of their own standard
    deviations (Wilson 1927). Unlike the estimate plus or minus two standard errors, the interval
    keeps its confidence for few trials and for shares near 0 and 1.
    """
    trials = np.where(np.asarray(of) > 0, of, np.nan)
    share, weight = np.asarray(counted) / trials, CONFIDENCE_95**2 / trials
    middle = (share + weight / 2.0) / (1.0 + weight)
    reach = np.sqrt(weight * (share * (1.0 - share) + weight / 4.0)) / (1.0 + weight)
    # Rounding may move a bound of exactly 0 or 1.
    low = np.where(share == 0.0, 0.0, middle - reach)
    high = np.where(share == 1.0, 1.0, middle + reach)
    return np.stack([low, high], axis=-1)
