"""Which numbers of a piecewise-linear system are not zero.

The equations of motion of n coordinates x with m clearance elements are::

    x'' + C x' + K x = f(phi) - sum_j u_j [k_j(phi) D(y_j; b_j) + c_j y_j']

    y_j = n_j x - e_j(phi)

after a multiplication by the inverse of the mass matrix. f, k_j and e_j are sums of waves: the
constant 1, then cosine and sine of each harmonic of the mesh phase phi. The compiled formulas
contain only the terms that a `Structure` lists.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Entries = tuple[tuple[int, int], ...]


def entries_of(matrices: NDArray[np.float64]) -> Entries:
    """Return the places (row, column) where a matrix is not 0; shape (lanes, rows, columns)."""
    there = np.any(matrices != 0.0, axis=0)
    return _places(there.tobytes(), there.shape)


@lru_cache(maxsize=256)
def _places(there: bytes, shape: tuple[int, ...]) -> Entries:
    """Return the places that are not 0 in a matrix of bools; kept, as systems are often alike."""
    matrix = np.frombuffer(there, dtype=np.bool_).reshape(shape)
    return tuple((int(row), int(column)) for row, column in np.argwhere(matrix))


@dataclass(frozen=True)
class Structure:
    """The terms of the equations of a system; every entry is a place (row, column) of a matrix.

    Attributes
    ----------
    coordinates, elements : int
        Numbers of coordinates and of clearance elements.
    orders : tuple of int
        The orders of the harmonics of the mesh phase whose cosine and sine are waves.
    position, rate : tuple of entries
        K and C, (coordinate, coordinate).
    reaction : tuple of entries
        The reactions u_j, (coordinate, element).
    force : tuple of entries
        f, (coordinate, wave).
    gap : tuple of entries
        The rows n_j, (element, coordinate).
    motion : tuple of entries
        e_j, (element, wave).
    motion_rate : tuple of entries
        e_j', (element, wave).
    stiffness : tuple of entries
        k_j, (element, wave).
    one_sided, damped_in_contact : tuple of bool
        See `ElementKind`.
    actuator : tuple of entries
        The direction of a controller's input, (coordinate, 0); none without a controller.
    """

    coordinates: int
    elements: int
    orders: tuple[int, ...]
    position: Entries
    rate: Entries
    reaction: Entries
    force: Entries
    gap: Entries
    motion: Entries
    motion_rate: Entries
    stiffness: Entries
    one_sided: tuple[bool, ...]
    damped_in_contact: tuple[bool, ...]
    actuator: Entries = ()

    @cached_property
    def indices(self) -> dict[str, tuple[list[int], list[int]]]:
        """Rows and columns of the entries of every matrix, by its name."""
        places = {name: np.array(getattr(self, name)).reshape(-1, 2) for name in MATRICES}
        return {name: (at[:, 0].tolist(), at[:, 1].tolist()) for name, at in places.items()}

    @property
    def terms(self) -> dict[str, Any]:
        """The fields by their names."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def waves(self) -> int:
        """Number of waves without the constant."""
        return 2 * len(self.orders)

    def __repr__(self) -> str:
        """Return a short name of the structure, which compiled code has in its names."""
        text = ",".join(str(getattr(self, field.name)) for field in fields(self))
        return f"{self.coordinates}x{self.elements}:{sha256(text.encode()).hexdigest()[:16]}"


MATRICES = (
    "position",
    "rate",
    "reaction",
    "force",
    "gap",
    "motion",
    "motion_rate",
    "stiffness",
    "actuator",
)
"""The sparse matrices of a lane, in the order of its coefficients."""


class Places(NamedTuple):
    """Numbers of the first coefficients of a lane, after those of the matrices.

    Attributes
    ----------
    damping, half_clearance : int
        Damping and half clearance of each element.
    speed : int
        Steps per unit of tau.
    input : int
        What a controller adds along the actuator; only systems with one have this coefficient.
    total : int
        Number of coefficients.
    """

    damping: int
    half_clearance: int
    speed: int
    input: int
    total: int


def places_of(structure: Structure) -> Places:
    """Return where the coefficients of a lane are that belong to no matrix."""
    first = sum(len(getattr(structure, name)) for name in MATRICES)
    after = first + 2 * structure.elements
    total = after + (2 if structure.actuator else 1)
    return Places(first, first + structure.elements, after, after + 1, total)


def numbered(structure: Structure, name: str) -> Iterator[tuple[int, int, int]]:
    """Yield the number of the coefficient, row and column of every entry of a matrix."""
    first = sum(len(getattr(structure, one)) for one in MATRICES[: MATRICES.index(name)])
    for number, (row, column) in enumerate(getattr(structure, name)):
        yield first + number, row, column


structure_of = lru_cache(maxsize=64)(Structure)
"""Return the structure with these fields, always the same one."""
