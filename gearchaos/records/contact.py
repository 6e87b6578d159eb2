"""Contact of a clearance element over a record: shares of time and impacts."""

import numpy as np

from gearchaos.arrays import Array, Floats

HELD, SINGLE_SIDED, DOUBLE_SIDED, FREE, DIVERGED = range(5)
CONTACT_STATES = ("held", "single_sided_impact", "double_sided_impact", "free", "diverged")
"""Meanings of the values of ``contact_state``.

The element never separates, hits one flank, hits both flanks, or has no contact; or the lane has no
whole record.
"""


def contact_summary(contact: Floats, periods: int) -> dict[str, Array]:
    """Return contact and impacts of one element, each of shape (lanes,), by name.

    ``contact`` (lanes, quantities): values of one element of an `Outcome` over some mesh periods.
    Speeds are NaN in lanes without an impact.
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
