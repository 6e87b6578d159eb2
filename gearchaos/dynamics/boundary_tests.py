"""The test functions of boundaries, and the linear algebra of many points in one call."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Complex, Floats, Mask
from gearchaos.records.branch import FOLD, NEIMARK_SACKER, PERIOD_DOUBLING

NEAR_CIRCLE = 0.5
"""Largest distance of the product of a pair of multipliers from 1."""

CRITICAL = {FOLD: 1.0, PERIOD_DOUBLING: -1.0}
"""The multiplier at a boundary where one is real and known."""


class Reference(NamedTuple):
    """Values at a neighbouring point, from which a test function is continued.

    Attributes
    ----------
    left, right : array, shape (states,)
        Null vectors of the monodromy matrix less the multiplier 1 (fold) or -1 (period doubling).
    cosine : float
        Mean of the pair of multipliers on the unit circle (Neimark-Sacker).
    phase : float
        Where the gap has its extreme, in steps since mesh phase 0 (grazing).
    """

    left: Floats = np.zeros(0)
    right: Floats = np.zeros(0)
    cosine: float = 0.0
    phase: float = 0.0


def tests_of(kind: str, monodromy: Floats, references: Sequence[Reference]) -> Floats:
    """Return the test function of places with monodromy matrices, (places,); NaN without one.

    At a Neimark-Sacker point it is the product of (multiplier times another one, minus 1) over all
    pairs of multipliers. At a fold or a period doubling it is that of a bordered matrix.

    ``monodromy``: shape (places, states, states). Not for grazings.
    """
    values = np.full(len(monodromy), np.nan)
    finite = np.isfinite(monodromy).all(axis=(1, 2))
    matrices = monodromy[finite]
    if kind == NEIMARK_SACKER:
        # The product over all pairs of multipliers is a smooth function of the matrix, also where
        # a third one is close to a pair (Kuznetsov 2004, section 10.2).
        found = np.linalg.eigvals(matrices)
        first, second = np.triu_indices(found.shape[1], 1)
        values[finite] = np.prod(found[:, first] * found[:, second] - 1.0, axis=1).real
        return values
    states = monodromy.shape[-1]
    border = np.zeros((len(matrices), states + 1, states + 1))
    border[:, :states, :states] = matrices - CRITICAL[kind] * np.eye(states)
    border[:, :states, -1] = np.array([one.left for one in references])[finite]
    border[:, -1, :states] = np.array([one.right for one in references])[finite]
    side = np.zeros((len(matrices), states + 1, 1))
    side[:, -1] = 1.0
    values[finite] = solved(border, side)[:, -1, 0]
    return values


def null_vectors(kind: str, monodromy: Floats) -> tuple[Floats, Floats]:
    """Return left and right null vectors at a fold or a period doubling, both (places, states)."""
    states = monodromy.shape[-1]
    (left, _, right), finite = _finite_only(
        np.linalg.svd, monodromy - CRITICAL[kind] * np.eye(states)
    )
    found = np.full((2, len(monodromy), states), np.nan)
    found[0, finite], found[1, finite] = left[:, :, -1], right[:, -1]
    return found[0], found[1]


def multipliers_of(monodromy: Floats) -> Complex:
    """Return the Floquet multipliers (places, states), largest modulus first; NaN without one."""
    values, finite = _finite_only(np.linalg.eigvals, monodromy)
    order = np.argsort(-np.abs(values), axis=1, kind="stable")
    found = np.full(monodromy.shape[:2], np.nan, dtype=np.complex128)
    found[finite] = np.take_along_axis(values, order, axis=1)
    return found


def _finite_only(function: Callable[[Floats], Any], matrices: Floats) -> tuple[Any, Mask]:
    """Return a function of the matrices without infinite entries, and which they are."""
    finite = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    return function(matrices[finite]), finite


def solved(matrices: Floats, sides: Floats) -> Floats:
    """Return the solutions of linear equations; NaN where they are singular.

    ``matrices`` (places, n, n), ``sides`` and result (places, n, k).
    """
    try:
        return np.asarray(np.linalg.solve(matrices, sides))
    except np.linalg.LinAlgError:
        found = np.full(sides.shape, np.nan)
        for at, (matrix, side) in enumerate(zip(matrices, sides, strict=True)):
            with suppress(np.linalg.LinAlgError):
                found[at] = np.linalg.solve(matrix, side)
        return found


def pairs(multipliers: NDArray[Any], cosines: Floats) -> Complex:
    """Return the pairs of multipliers, complex or real, with products nearest to 1, (places, 2).

    ``multipliers``: shape (places, states); ``cosines`` (places,): their mean at a neighbouring
    point; NaN for the first point, where the pair is complex. NaN if no pair has a product near 1.
    """
    values = np.asarray(multipliers, dtype=np.complex128)
    values = np.take_along_axis(values, np.argsort(values.imag, axis=1, kind="stable"), axis=1)
    second, first = np.tril_indices(values.shape[1], -1)
    one, other = values[:, second], values[:, first]
    known = ~np.isnan(cosines)[:, np.newaxis]
    allowed = (one.imag != 0.0) & (np.abs(one - other.conj()) <= 1e-9 * np.abs(one))
    allowed |= known & (one.imag == 0.0) & (other.imag == 0.0)
    distance = np.abs((one * other).real - 1.0)
    allowed &= distance <= NEAR_CIRCLE
    aside = np.abs((one + other).real / 2.0 - cosines[:, np.newaxis])
    distance = np.where(allowed, distance + np.where(known, aside, 0.0), np.inf)
    rows, best = np.arange(len(values)), np.argmin(distance, axis=1)
    found = np.stack([one[rows, best], other[rows, best]], axis=1)
    found[~allowed.any(axis=1)] = np.nan
    return found
