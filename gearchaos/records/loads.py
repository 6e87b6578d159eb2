"""What the teeth carry over a record: mesh forces, load factors, transmission error."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FORCES = {
    "mesh_force_largest": "largest mesh force",
    "mesh_force_smallest": "smallest mesh force",
    "mesh_force_mean": "mean mesh force",
    "mesh_force_rms": "root mean square of the mesh force",
}
"""What is told of the mesh force in each direction, by name."""

WORDING = {
    "load_factor_largest": "largest tangential mesh force over the static one",
    "load_factor_rms": "root mean square of the tangential mesh force over the static one",
    "transmission_error_mean": "mean transmission error",
    "transmission_error_peak_to_peak": "largest less smallest transmission error",
    "transmission_error_rms": "root mean square of the transmission error about its mean",
}
"""What else is told, by name."""


def loads_told(loads: Floats, static: Floats, directions: Sequence[str]) -> dict[str, Floats]:
    """Return the loads of lanes, each of shape (lanes,), by name.

    ``loads`` (lanes, 3, 4) as in an `Outcome`; ``static`` (lanes,): the tangential mesh force at
    rest, without which a factor is not a number.
    """
    force, _, error = signals = np.moveaxis(loads, 0, 2)
    told: dict[str, Floats] = {}
    for way, (*values, square) in zip(directions, signals, strict=False):
        values.append(np.sqrt(square))
        told |= {f"{name}_{way}": row for name, row in zip(FORCES, values, strict=True)}
    static = np.where(static == 0.0, np.nan, static)
    largest, smallest, mean, square = error
    told["load_factor_largest"] = np.where(static > 0.0, force[0], force[1]) / static
    told["load_factor_rms"] = np.sqrt(force[3]) / np.abs(static)
    told["transmission_error_mean"] = mean
    told["transmission_error_peak_to_peak"] = largest - smallest
    told["transmission_error_rms"] = np.sqrt(np.maximum(square - mean**2, 0.0))
    return told
