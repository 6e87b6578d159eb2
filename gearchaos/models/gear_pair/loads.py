"""Mesh forces, load factors and transmission error of a record."""

from collections.abc import Sequence

import numpy as np

from gearchaos.arrays import Floats


def load_outputs(loads: Floats, static: Floats, directions: Sequence[str]) -> dict[str, Floats]:
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
