"""What the teeth do over a record: contact and impacts, mesh forces, transmission error."""

from collections.abc import Sequence

import numpy as np

from gearchaos.arrays import Array, Floats

HELD, SINGLE_SIDED, DOUBLE_SIDED, FREE = range(4)
CONTACT_STATES = ("held", "single_sided_impact", "double_sided_impact", "free")
"""Meanings of the values of ``contact_state``: teeth that never part, meet on one flank, meet on
both flanks, never meet."""


def contact_told(contact: Floats, periods: int) -> dict[str, Array]:
    """Return what is told of one direction, each of shape (lanes,), by name.

    ``contact`` (lanes, 6), that of one element of an `Outcome`, covers this number of mesh periods.
    Speeds are not a number without any impact.
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


def loads_told(loads: Floats, static: Floats, directions: Sequence[str]) -> dict[str, Floats]:
    """Return the loads of lanes, each of shape (lanes,), by name.

    ``loads`` (lanes, directions + 1, 4) as in an `Outcome`; ``static`` (lanes,): the tangential
    mesh force at rest, without which a factor is not a number.
    """
    force, *_, error = signals = np.moveaxis(loads, 0, 2)
    told: dict[str, Floats] = {}
    for way, (*values, square) in zip(directions, signals, strict=False):
        forces = zip(("largest", "smallest", "mean"), values, strict=True)
        told |= {f"mesh_force_{name}_{way}": row for name, row in forces}
        told[f"mesh_force_rms_{way}"] = np.sqrt(square)
    static = np.where(static == 0.0, np.nan, static)
    largest, smallest, mean, square = error
    told["load_factor_largest"] = np.where(static > 0.0, force[0], force[1]) / static
    told["load_factor_rms"] = np.sqrt(force[3]) / np.abs(static)
    told["transmission_error_mean"] = mean
    told["transmission_error_peak_to_peak"] = largest - smallest
    told["transmission_error_rms"] = np.sqrt(np.maximum(square - mean**2, 0.0))
    return told
