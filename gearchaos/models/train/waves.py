"""Waves of the excitation: stiffness and error of a mesh over a common period."""

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.models.train.geometry import ContactRatios
from gearchaos.models.train.tables import MeshStiffness

MOST_ORDER = 400
"""Highest order of a wave in the common period of all meshes."""


def common_orders(frequencies: Sequence[Fraction]) -> tuple[int, ...]:
    """Return the order of each frequency in their common period, as small as possible.

    ``frequencies``: in any common unit, such as that of the first mesh.
    """
    denominator = math.lcm(*(one.denominator for one in frequencies))
    whole = [int(one * denominator) for one in frequencies]
    divisor = math.gcd(*whole)
    return tuple(one // divisor for one in whole)


def orders_of(meshes: Iterable[tuple[MeshStiffness, int]]) -> tuple[int, ...]:
    """Return the orders of all waves of meshes with these orders, ascending."""
    found = {1}
    for mesh, order in meshes:
        found |= {order * number for number in range(1, mesh.kept_harmonics + 1)}
    return tuple(sorted(found))


def stiffness_waves(
    mesh: MeshStiffness,
    order: int,
    orders: Sequence[int],
    ratios: ContactRatios | None,
    phase: float = 0.0,
) -> Floats:
    """Return the stiffness of a mesh as parts of the waves, in N/um.

    ``ratios``: its contact ratios, None if the stiffness does not vary; ``phase``: share of a mesh
    period, beside its own.
    """
    waves = np.zeros(1 + 2 * len(orders))
    waves[0] = mesh.mean_stiffness
    for number, (cosine, sine) in enumerate(_harmonics(mesh, ratios) if ratios else (), 1):
        at = 1 + 2 * orders.index(order * number)
        angle = 2.0 * math.pi * number * (phase + mesh.phase_turns)
        turned, across = math.cos(angle), math.sin(angle)
        waves[at : at + 2] = cosine * turned + sine * across, sine * turned - cosine * across
    return waves


def _harmonics(mesh: MeshStiffness, ratios: ContactRatios) -> Iterator[tuple[float, float]]:
    """Yield cosine and sine part of the harmonics of the stiffness at its own phase.

    The contact line of a tooth pair is a rectangle as long as the transverse contact ratio, and of
    helical gears its convolution with one as long as the overlap ratio. The stiffness is in
    proportion to the sum over all pairs, whose Fourier series is cut.
    """
    if mesh.stiffness is not None:
        series, factor = mesh.stiffness.series, mesh.table_factor
        for cosine, sine in zip(series.cosine, series.sine, strict=True):
            yield factor * cosine, factor * sine
        return
    for number in range(1, mesh.harmonics + 1):
        turns = math.pi * number * ratios.transverse
        size = 2.0 * mesh.mean_stiffness * math.sin(turns) / turns
        if ratios.overlap > 0.0:
            size *= float(np.sinc(number * ratios.overlap))
        yield size, 0.0


def error_waves(
    mesh: MeshStiffness, order: int, orders: Sequence[int], phase: float = 0.0
) -> Floats:
    """Return the transmission error of a mesh as parts of the waves, in um."""
    waves = np.zeros(1 + 2 * len(orders))
    at = 1 + 2 * orders.index(order)
    angle = 2.0 * math.pi * (phase + mesh.phase_turns)
    size = mesh.transmission_error_um
    waves[at : at + 2] = size * math.sin(angle), size * math.cos(angle)
    return waves
