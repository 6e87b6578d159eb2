"""Cumulative pitch deviations of both gears, listed or drawn, as teeth come into mesh."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gearchaos.arrays import Floats, Integers
from gearchaos.iso1328 import cumulative_pitch_um, require_gear, single_pitch_um
from gearchaos.outputs.names import REALISATION

_TINY = 1e-300
"""Keeps the deviations of a single tooth, which are zero, from being divided by zero."""


class Deviations(NamedTuple):
    """Deviations of the loaded flanks in um, along the reference circle in the transverse plane.

    ``driving`` (profiles, teeth p), ``driven`` (profiles, teeth g): relative to tooth 0, one column
    for every tooth in the order in which they come into mesh, positive where the flank lies ahead
    in the direction of rotation; one column of zeros for a gear without deviations. ``profile``, of
    the shape of the lanes: which of the profiles a lane has.
    """

    driving: Floats
    driven: Floats
    profile: Integers


def tooth_deviations(error: Any, pair: Any, values: Mapping[str, npt.ArrayLike]) -> Deviations:
    """Return the deviations of some lanes.

    ``error``, ``pair``: the tables ``[pitch_error]`` and ``[pair]`` of a configuration; ``values``:
    those of swept parameters in every lane, which broadcast against each other, and the numbers of
    drawn gear pairs as `REALISATION`. Only profiles that occur are made. Raises ValueError if a
    grade or gear is outside the ranges of ISO 1328-1.
    """
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
        "pair.face_width_mm": pair.face_width_mm,
    }
    rows = [np.broadcast_to(values.get(name, value), lanes).ravel() for name, value in own.items()]
    found, profile = np.unique(np.stack(rows, axis=1), axis=0, return_inverse=True)
    driving, driven = (_drawn(error, gear, z, found) for gear, z in enumerate(pair.teeth))
    return Deviations(driving, driven, profile.reshape(lanes))


def _drawn(error: Any, gear: int, teeth: int, rows: Floats) -> Floats:
    numbers, grades, shares, modules, helix_angles, face_widths = rows.T
    for helix_angle, face_width in zip(helix_angles, face_widths, strict=True):
        require_gear(teeth, helix_angle, face_width, error.edition)
    diameters = teeth * modules / np.cos(np.radians(helix_angles))
    sizes = list(zip(grades, modules, diameters, strict=True))
    single = [single_pitch_um(*one, error.edition) for one in sizes]
    cumulative = [cumulative_pitch_um(*one, error.edition) for one in sizes]
    return drawn_gears(numbers, error.seed, gear, teeth, single, cumulative, shares)


def listed_deviations(gear: Any) -> Floats:
    """Return the deviations of a gear from its table in ``[pitch_error]``, shape (1, teeth), in um.

    By ISO 1328-1 a deviation is positive where the flank lies farther on in the direction of
    counting; when the gear turns that way, a tooth with a lower number follows into mesh.
    """
    if gear is None:
        return np.zeros((1, 1))
    deviations = counted_deviations(gear)
    if gear.counted == "with_rotation":
        return np.roll(deviations[::-1], 1)[np.newaxis]
    return 0.0 - deviations[np.newaxis]


def counted_deviations(gear: Any) -> Floats:
    """Return cumulative deviations (teeth,) of a table relative to tooth 0, as they were counted.

    The single one of tooth k is that of the pitch from tooth k - 1 to it; what is left of their
    sum is spread evenly over all teeth.
    """
    deviations: Floats = np.array(gear.cumulative_um or gear.single_um, dtype=np.float64)
    if gear.cumulative_um is None:
        deviations = np.cumsum(deviations - np.mean(deviations))
    deviations -= deviations[0]
    return deviations


def drawn_gears(
    numbers: npt.ArrayLike,
    seed: int,
    gear: int,
    teeth: int,
    single_um: npt.ArrayLike,
    cumulative_um: npt.ArrayLike,
    eccentricity: npt.ArrayLike = 0.5,
) -> Floats:
    """Draw cumulative pitch deviations, shape (realisations, teeth), in um, 0 on tooth 0.

    The single deviations are independent and normal, made to sum to zero, and an eccentricity of
    random phase is added. All is scaled until the largest single deviation or the range of the
    cumulative ones is at its limit: the worst gear of its form that still passes. A gear depends on
    its number (realisations,), the seed and whether it drives (0) or is driven (1) alone, and not
    on the machine; the limits, in um, and the share of the eccentricity in the range, from 0 to 1,
    may differ between realisations.
    """
    numbers, single, range_, share = (
        np.asarray(value)[..., np.newaxis]
        for value in np.broadcast_arrays(numbers, single_um, cumulative_um, eccentricity)
    )
    # Every gear has a counter of its own; the last word keeps it apart from random start states.
    counters = [[0, 0, int(number), 1 + gear] for number in numbers[:, 0]]
    bits = (np.random.Philox(seed, counter=counter) for counter in counters)
    uniform = np.array([np.random.Generator(one).random(2 * teeth + 1) for one in bits])
    turns, phase = uniform[:, teeth:-1], uniform[:, -1:]
    normal = np.sqrt(-2.0 * np.log1p(-uniform[:, :teeth])) * np.cos(2.0 * np.pi * turns)
    around = np.cos(2.0 * np.pi * (phase + np.arange(teeth) / teeth))
    random = np.cumsum(_exact(normal), axis=1)
    random -= random[:, -1:] * (np.arange(1, teeth + 1) / teeth)
    form = (1.0 - share) * random / (np.ptp(random, axis=1, keepdims=True) + _TINY)
    form += share * _exact(around) / 2.0
    steps = np.abs(form - np.roll(form, 1, axis=1)).max(axis=1, keepdims=True)
    spread = np.ptp(form, axis=1, keepdims=True)
    scale = np.minimum(single / (steps + _TINY), range_ / (spread + _TINY))
    drawn: Floats = np.round(scale * (form - form[:, :1]), 6)
    return drawn


def _exact(values: Floats) -> Floats:
    """Round where machines may differ, to a grid on which sums are exact in any order."""
    return np.rint(values * 2.0**20) / 2.0**20
