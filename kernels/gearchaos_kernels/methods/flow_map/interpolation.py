"""Flow maps between values of one parameter, interpolated with the accuracy of rounding.

The maps of a step are analytic functions of the coefficients. Over a piece of the range of one
parameter, the polynomial through their values at `NODES` Chebyshev points differs from them by
rounding. This is checked at both ends and inside of every piece. Pieces are fractions of octaves:
they depend on the value of the parameter alone, so a lane has the same maps in any batch.
"""

from collections.abc import Hashable
from typing import Any, NamedTuple

import numpy as np

from gearchaos_kernels.methods.flow_map.layout import layout_of
from gearchaos_kernels.methods.flow_map.making import MOST_MAP_STEPS, make_tables
from gearchaos_kernels.plan import MAP_BYTES, Floats
from gearchaos_kernels.scene import Scene

NODES = 12
"""Number of values of the parameter in a piece at which maps are computed."""

PIECES, DIVISIONS = 8, 2
"""Pieces of an octave, and how often a piece is divided in two if its maps are not accurate."""

ACCURACY = 1e-14
"""Largest error of an interpolated map, relative to the largest number of the step."""

MARGIN = 1.01
"""Factor of the bounds of the gaps: they have corners, so the largest one of a piece is taken."""

BLOCK = 8192
"""Numbers of maps that are interpolated in one call of a matrix product.

Libraries of linear algebra share longer products among threads. These then round differently for
every number of threads, and take ten times as long next to other busy processes.
"""

_ANGLES = (2 * np.arange(NODES) + 1) * np.pi / (2 * NODES)
_CHECKED = np.array([-1.0, 0.05, 1.0])
"""Where the maps of a piece are checked, from -1 to 1; no node lies there."""


class Piece(NamedTuple):
    """Maps at the nodes of a piece.

    Attributes
    ----------
    nodes : array, shape (NODES,)
        Values of the parameter.
    tables : array, shape (NODES, numbers)
        The maps of all steps at each of them.
    shape : tuple of int
        Steps per period, and size of a step.
    """

    nodes: Floats
    tables: Floats
    shape: tuple[int, int]

    def at(self, value: float, target: Floats | None = None) -> Floats:
        """Return the maps at a value of the parameter, shape (steps, size of a step).

        They are written to ``target``, shape (numbers,), if it is given.
        """
        weights = (-1.0) ** np.arange(NODES) * np.sin(_ANGLES)
        with np.errstate(divide="ignore"):
            weights = weights / (value - self.nodes)
        (same,) = np.nonzero(np.isinf(weights))
        if same.size:
            weights = np.isinf(weights).astype(np.float64)
        weights /= weights.sum()
        size = self.tables.shape[1]
        found = np.empty(size) if target is None else target
        # The sum over nodes has the same order for any number of lanes and of threads.
        for begin in range(0, size, BLOCK):
            some = slice(begin, begin + BLOCK)
            np.matmul(weights, self.tables[:, some], out=found[some])
        return found.reshape(self.shape)


class Between(NamedTuple):
    """The maps of a lane at a value of the parameter, interpolated where they are stored.

    `size` is their number, `steps` that of steps per period.
    """

    piece: Piece
    value: float

    @property
    def size(self) -> int:
        """Number of numbers."""
        return int(self.piece.tables.shape[1])

    @property
    def steps(self) -> int:
        """Steps per period."""
        return self.piece.shape[0]

    def write(self, target: Floats) -> None:
        """Write the maps to an array, shape (size,)."""
        self.piece.at(self.value, target)


_pieces: dict[Hashable, Piece | None] = {}
"""The pieces, None for those that are divided. They are emptied when they grow too large."""


def interpolated(
    system: Any, steps: int, scene: Scene, along: int, name: Hashable
) -> list[Between | None]:
    """Return the maps of lanes; None where they are not accurate.

    ``along``: number of the parameter, see `LaneSystem.map_parameters`; ``name``: what the maps
    depend on besides the parameters.
    """
    rows = system.map_parameters()
    others = np.delete(rows, along, axis=1)
    found: list[Between | None] = []
    for lane, value in enumerate(rows[:, along].tolist()):
        if not value > 0.0:
            found.append(None)
            continue
        key = name, others[lane].tobytes()
        piece = _piece_at(system, lane, value, (steps, scene, along), key)
        found.append(None if piece is None else Between(piece, value))
    return found


def _piece_at(
    system: Any, lane: int, value: float, how: tuple[int, Scene, int], name: Hashable
) -> Piece | None:
    """Return the piece that contains a value of the parameter of a lane, or None.

    ``name``: what the maps depend on besides this parameter.
    """
    for division in range(DIVISIONS + 1):
        pieces = PIECES * 2**division
        number = int(np.floor(pieces * np.log2(value)))
        key = name, division, number
        if key not in _pieces:
            ends = 2.0 ** (number / pieces), 2.0 ** ((number + 1) / pieces)
            _keep(key, _made(system.of([lane]), ends, *how))
        found = _pieces[key]
        if found is not None:
            return found
    return None


def _keep(key: Hashable, piece: Piece | None) -> None:
    """Store a piece; first remove all others if there are too many."""
    size = 0 if piece is None else piece.tables.nbytes
    if size and size + sum(one.tables.nbytes for one in _pieces.values() if one) > MAP_BYTES:
        _pieces.clear()
    _pieces[key] = piece


def _made(
    lane: Any, ends: tuple[float, float], steps: int, scene: Scene, along: int
) -> Piece | None:
    """Compute the maps at the nodes of a piece; None if those between are not accurate."""
    low, high = ends
    places = np.concatenate([np.cos(_ANGLES), _CHECKED])
    values = (low + high) / 2.0 + (high - low) / 2.0 * places
    system = lane.of(np.zeros(values.size, dtype=np.intp)).with_map_parameter(along, values)
    if system is None:
        return None
    place, count = layout_of(scene), steps
    while count <= max(steps, MOST_MAP_STEPS):
        sets = np.tile(np.arange(place.branches), (values.size, 1))
        tables, converged, finite = make_tables(system, sets, count, scene)
        if converged.all():
            return _checked(values, tables, scene)
        # Where only some of the series converge, the maps of the others need more steps.
        if converged.any() or not finite.all():
            break
        count *= 2
    return None


def _checked(values: Floats, tables: Floats, scene: Scene) -> Piece | None:
    """Return the piece of maps at its nodes and at `_CHECKED`, or None if it is not accurate."""
    place = layout_of(scene)
    bounds = slice(place.bounds, place.header)
    # No part of the header before the bounds depends on the parameter.
    tables[:, :, bounds] = MARGIN * np.max(tables[:, :, bounds], axis=0)
    piece = Piece(values[:NODES], tables[:NODES].reshape(NODES, -1), tables.shape[1:])
    for value, exact in zip(values[NODES:].tolist(), tables[NODES:], strict=True):
        error = np.max(np.abs(piece.at(value) - exact), axis=1)
        if not (error <= ACCURACY * np.max(np.abs(exact), axis=1)).all():
            return None
    return piece
