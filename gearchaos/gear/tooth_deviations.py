"""Cumulative pitch deviations of both gears, in the order in which the teeth come into mesh."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from gearchaos.gear.drawn_gears import drawn_gears
from gearchaos.iso1328 import cumulative_pitch_um, single_pitch_um

FloatArray: TypeAlias = npt.NDArray[np.float64]

REALISATION = "realisation"
"""Name under which the values of lanes hold the number of the drawn gear pair."""


class Deviations(NamedTuple):
    """Deviations of the loaded flanks in um, along the reference circle in the transverse plane.

    ``driving`` (profiles, teeth p), ``driven`` (profiles, teeth g): relative to tooth 0, one column
    for every tooth in the order in which they come into mesh, positive where the flank lies ahead
    in the direction of rotation; one column of zeros for a gear without deviations. ``profile``, of
    the shape of the lanes: which of the profiles a lane has.
    """

    driving: FloatArray
    driven: FloatArray
    profile: npt.NDArray[np.intp]


def tooth_deviations(
    error: Any, pair: Any, values: Mapping[str, npt.ArrayLike]
) -> Deviations | None:
    """Return the deviations of some lanes, None where the pitch error is a sine.

    ``error``, ``pair``: the tables ``[pitch_error]`` and ``[pair]`` of a configuration; ``values``:
    those of swept parameters in every lane, which broadcast against each other, and the numbers of
    drawn gear pairs as `REALISATION`. Only profiles that occur are made. Raises ValueError if a
    grade, module or diameter is outside the ranges of ISO 1328-1.
    """
    if error is None or error.kind == "sine":
        return None
    lanes = np.broadcast_shapes(*map(np.shape, values.values()))
    if error.kind == "teeth":
        driving, driven = listed_deviations(error.driving), listed_deviations(error.driven)
        return Deviations(driving, driven, np.zeros(lanes, dtype=np.intp))
    own = {
        REALISATION: error.first_realisation,
        "pitch_error.grade": error.grade,
        "pitch_error.eccentricity": error.eccentricity,
        "pair.normal_module_mm": pair.normal_module_mm,
        "pair.helix_angle_deg": pair.helix_angle_deg,
    }
    rows = [np.broadcast_to(values.get(name, value), lanes).ravel() for name, value in own.items()]
    found, profile = np.unique(np.stack(rows, axis=1), axis=0, return_inverse=True)
    driving, driven = (_drawn(error, gear, z, found) for gear, z in enumerate(pair.teeth))
    return Deviations(driving, driven, profile.reshape(lanes))


def _drawn(error: Any, gear: int, teeth: int, rows: FloatArray) -> FloatArray:
    numbers, grades, shares, modules, helix_angles = rows.T
    diameters = teeth * modules / np.cos(np.radians(helix_angles))
    sizes = list(zip(grades, modules, diameters, strict=True))
    single = [single_pitch_um(*one, error.edition) for one in sizes]
    cumulative = [cumulative_pitch_um(*one, error.edition) for one in sizes]
    return drawn_gears(numbers, error.seed, gear, teeth, single, cumulative, shares)


def listed_deviations(gear: Any) -> FloatArray:
    """Return the deviations of a gear from its table in ``[pitch_error]``, shape (1, teeth), in um.

    By ISO 1328-1 a deviation is positive where the flank lies farther on in the direction of
    counting; when the gear turns that way, a tooth with a lower number follows into mesh.
    """
    if gear is None:
        return np.zeros((1, 1))
    deviations = counted_deviations(gear.cumulative_um, gear.single_um)
    if gear.counted == "with_rotation":
        return np.roll(deviations[::-1], 1)[np.newaxis]
    return 0.0 - deviations[np.newaxis]


def counted_deviations(
    cumulative: Sequence[float] | None, single: Sequence[float] | None
) -> FloatArray:
    """Return cumulative deviations (teeth,) relative to tooth 0, as they were counted.

    The single one of tooth k is that of the pitch from tooth k - 1 to it; what is left of their
    sum is spread evenly over all teeth.
    """
    given = single if cumulative is None else cumulative
    deviations: FloatArray = np.array(given, dtype=np.float64)
    if cumulative is None:
        deviations = np.cumsum(deviations - np.mean(deviations))
    deviations -= deviations[0]
    return deviations
