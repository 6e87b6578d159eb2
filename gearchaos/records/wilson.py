"""The confidence interval of a share that was counted."""

import numpy as np
from numpy.typing import ArrayLike

from gearchaos.arrays import Floats

CONFIDENCE_95 = 1.959963984540054
"""Standard deviations of a normal distribution within which 95 % of it lie."""


def wilson_interval(counted: ArrayLike, of: ArrayLike) -> Floats:
    """Return the interval that holds a share with a confidence of 95 %, shape (..., 2).

    Where ``counted`` of so many independent trials had a property, the ends are the shares from
    which this result lies 1.96 of their own standard deviations away (Wilson 1927). Unlike the
    estimate plus or minus two standard errors it keeps its confidence for few trials and for shares
    near 0 and 1; not a number without a trial.
    """
    trials = np.where(np.asarray(of) > 0, of, np.nan)
    share, weight = np.asarray(counted) / trials, CONFIDENCE_95**2 / trials
    middle = (share + weight / 2.0) / (1.0 + weight)
    reach = np.sqrt(weight * (share * (1.0 - share) + weight / 4.0)) / (1.0 + weight)
    # Rounding may leave what is zero or one beside it.
    low = np.where(share == 0.0, 0.0, middle - reach)
    high = np.where(share == 1.0, 1.0, middle + reach)
    return np.stack([low, high], axis=-1)
