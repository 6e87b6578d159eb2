"""What the crossings of a clearance tell of the contact: shares of time, impacts, its state."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

HELD, SINGLE_SIDED, DOUBLE_SIDED, FREE = range(4)
MEANINGS = ("held", "single_sided_impact", "double_sided_impact", "free")
"""Meanings of the values of ``contact_state``: teeth that never part, meet on one flank, meet on
both flanks, never meet."""

WORDING = {
    "time_driving": "share of the recorded time on the driving flank",
    "time_back": "share of the recorded time on the back flank",
    "time_apart": "share of the recorded time between the flanks",
    "impacts_driving": "impacts on the driving flank per mesh period",
    "impacts_back": "impacts on the back flank per mesh period",
    "approach_mean": "mean speed of approach at an impact",
    "approach_largest": "largest speed of approach at an impact",
}
"""What is told of each direction, by name."""


def contact_told(contact: NDArray[np.float64], periods: int) -> dict[str, NDArray[Any]]:
    """Return what is told of one direction, each of shape (lanes,), by the names of `WORDING`.

    With the ``contact_state``. ``contact`` (lanes, 6), one half of that of an `Outcome`, is that of
    so many mesh periods. Speeds are not a number without any impact.
    """
    driving, on_driving, back, on_back, speeds, largest = contact.T
    impacts = on_driving + on_back
    never = np.where(impacts > 0.0, 1.0, np.nan)
    apart = np.clip(1.0 - (driving + back) / periods, 0.0, 1.0)
    both = (driving > 0.0) & (back > 0.0)
    state = np.select(
        [both, (impacts == 0.0) & (apart == 0.0), apart == 1.0],
        [DOUBLE_SIDED, HELD, FREE],
        SINGLE_SIDED,
    )
    return {
        "time_driving": driving / periods,
        "time_back": back / periods,
        "time_apart": apart,
        "impacts_driving": on_driving / periods,
        "impacts_back": on_back / periods,
        "approach_mean": speeds / np.maximum(impacts, 1.0) * never,
        "approach_largest": largest * never,
        "contact_state": state.astype(np.uint8),
    }
