"""Boundaries of periodic orbits over two parameters, as they are computed, stored and drawn."""

from typing import NamedTuple

from gearchaos.arrays import Complex, Floats
from gearchaos.records.branch import (
    CLOSED_CURVE,
    EDGE,
    FOLD,
    GRAZING,
    HALVING,
    LOST,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    TOO_MANY,
)

BOUNDARY_KINDS = (FOLD, PERIOD_DOUBLING, NEIMARK_SACKER, GRAZING)
"""Kinds of boundaries."""

CUSP = "cusp"
RESONANCES = {"1:1 resonance": 1.0, "1:2 resonance": -1.0}
"""Resonances at which a Neimark-Sacker curve ends, with the cosine of the angle of its pair."""
STRONG_RESONANCE_11, STRONG_RESONANCE_12 = RESONANCES
WEAKER_RESONANCES = {"1:3 resonance": -0.5, "1:4 resonance": 0.0}
"""Resonances that do not end such a curve, with the cosine of the angle of its pair."""
FOLD_FLIP = "fold-flip"
FOLD_NEIMARK_SACKER = "fold meets Neimark-Sacker"
FLIP_NEIMARK_SACKER = "period doubling meets Neimark-Sacker"
GRAZING_FOLD = "grazing meets fold"
GRAZING_FLIP = "grazing meets period doubling"
GRAZING_NEIMARK_SACKER = "grazing meets Neimark-Sacker"
POINT_KINDS = (
    CUSP,
    *RESONANCES,
    *WEAKER_RESONANCES,
    FOLD_FLIP,
    FOLD_NEIMARK_SACKER,
    FLIP_NEIMARK_SACKER,
    GRAZING_FOLD,
    GRAZING_FLIP,
    GRAZING_NEIMARK_SACKER,
)
"""Kinds of points of codimension 2."""

POINT_MEANINGS = {
    CUSP: "two folds meet and end",
    STRONG_RESONANCE_11: "a Neimark-Sacker curve ends at a fold, with two multipliers at 1",
    STRONG_RESONANCE_12: "a Neimark-Sacker curve ends at a period doubling, with two multipliers "
    "at -1",
    **{
        kind: f"the multipliers on the unit circle turn by a {part} of a revolution per period"
        for kind, part in zip(WEAKER_RESONANCES, ("third", "quarter"), strict=True)
    },
    FOLD_FLIP: "a fold and a period doubling happen at once",
    FOLD_NEIMARK_SACKER: "a fold and a Neimark-Sacker point happen at once",
    FLIP_NEIMARK_SACKER: "a period doubling and a Neimark-Sacker point happen at once",
    GRAZING_FOLD: "the orbit of a fold touches a flank",
    GRAZING_FLIP: "the orbit of a period doubling touches a flank",
    GRAZING_NEIMARK_SACKER: "the orbit of a Neimark-Sacker point touches a flank",
}
"""Event at each kind of point of codimension 2."""

CORNER = "meets a grazing, where it has a corner"
NO_EXTREME = "beyond this point no extreme of the gap comes near the flank"
SHORT_STEPS = "its steps became too short, as next to a grazing"
NOT_STARTED = "no boundary could be followed from this special point of a branch"
BOUNDARY_ENDS = (
    EDGE,
    CLOSED_CURVE,
    *RESONANCES,
    HALVING,
    TOO_MANY,
    LOST,
    CORNER,
    NO_EXTREME,
    SHORT_STEPS,
    NOT_STARTED,
)
"""Reasons why a boundary ends."""


class BoundaryPoint(NamedTuple):
    """A point of codimension 2 on a boundary.

    Attributes
    ----------
    kind : str
        One of `POINT_KINDS`.
    values : array, shape (2,)
        Values of both parameters.
    arclength : float
        Where it lies on the boundary.
    multipliers : array of complex, shape (states,)
        Floquet multipliers, largest modulus first.
    """

    kind: str
    values: Floats
    arclength: float
    multipliers: Complex


class Boundary(NamedTuple):
    """A curve over two parameters on which orbits of one period change.

    Attributes
    ----------
    kind : str
        One of `BOUNDARY_KINDS`.
    period : int
        Period of the orbits in excitation periods.
    flank : str
        For a grazing, the element and its flank; else empty.
    values : array, shape (points, 2)
        Values of both parameters, in the order of the curve.
    arclength : array, shape (points,)
        Length of the curve up to each point: states in their scales, parameters in shares of their
        ranges.
    section : array, shape (points, period, states)
        Section points of each orbit, dimensionless; the last one is the state at mesh phase 0.
    multipliers : array of complex, shape (points, states)
        Floquet multipliers, largest modulus first.
    points : tuple of BoundaryPoint
        Its points of codimension 2, in the order of the curve.
    ends : tuple of str
        Why it ends at its first and at its last point, each one of `BOUNDARY_ENDS`.
    """

    kind: str
    period: int
    flank: str
    values: Floats
    arclength: Floats
    section: Floats
    multipliers: Complex
    points: tuple[BoundaryPoint, ...]
    ends: tuple[str, str]
