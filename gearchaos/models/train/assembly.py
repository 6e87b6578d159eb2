"""A machine that is put together part by part: springs, elements, masses and forces."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.models.linear.machine import Kinds, Machine


class _Element(NamedTuple):
    """A clearance element along a row of coordinates, with parts of the waves."""

    row: Mapping[str, float]
    stiffness: Floats
    motion: Floats
    damping: float
    half_clearance: float
    in_contact: bool


class Assembly:
    """Parts of a machine by the names of its coordinates; absent coordinates do not move.

    Parameters
    ----------
    orders : sequence of int
        Orders of the waves.
    """

    def __init__(self, orders: Sequence[int]) -> None:
        self.orders = tuple(orders)
        self.mass: dict[str, float] = {}
        self.force: dict[str, float] = {}
        self._springs: list[tuple[Mapping[str, float], float, float]] = []
        self._elements: dict[str, _Element] = {}

    def coordinate(self, name: str, mass: float, force: float = 0.0) -> None:
        """Add a coordinate with its mass and a constant force on it."""
        self.mass[name], self.force[name] = mass, force

    def spring(self, row: Mapping[str, float], stiffness: float, damping: float) -> None:
        """Add a linear spring and a damper along a row of coordinates."""
        self._springs.append((row, stiffness, damping))

    def element(
        self,
        name: str,
        row: Mapping[str, float],
        waves: tuple[Floats, Floats],
        damping: float,
        half_clearance: float,
        in_contact: bool = False,
    ) -> None:
        """Add a clearance element along a row; ``waves``: its stiffness and its motion."""
        self._elements[name] = _Element(row, *waves, damping, half_clearance, in_contact)

    def inertia_along(self, row: Mapping[str, float]) -> float:
        """Return the mass that two forces against each other along a row set in motion."""
        mobility = sum(
            factor**2 / self.mass[name] for name, factor in row.items() if name in self.mass
        )
        return 1.0 / mobility if mobility > 0.0 else 0.0

    def machine(self, frequency: float) -> Machine:
        """Return the matrices of the machine."""
        names = list(self.mass)
        size, waves = len(names), 1 + 2 * len(self.orders)
        stiffness, damping = np.zeros((2, size, size))
        for row, spring, damper in self._springs:
            vector = self._row(row, names)
            stiffness += spring * np.outer(vector, vector)
            damping += damper * np.outer(vector, vector)
        elements = list(self._elements.values())
        gap = np.array([self._row(one.row, names) for one in elements]).reshape(-1, size)
        force = np.zeros((size, waves))
        force[:, 0] = list(self.force.values())
        return Machine(
            frequency=frequency,
            mass=np.diag(list(self.mass.values())),
            damping=damping,
            stiffness=stiffness,
            reaction=gap.T.copy(),
            gap=gap,
            force=force,
            motion=np.array([one.motion for one in elements]).reshape(-1, waves),
            contact_stiffness=np.array([one.stiffness for one in elements]).reshape(-1, waves),
            contact_damping=np.array([one.damping for one in elements]),
            half_clearance=np.array([one.half_clearance for one in elements]),
        )

    def kinds(self) -> Kinds:
        """Return what all machines that are put together like this have in common."""
        elements = self._elements
        return Kinds(
            tuple(self.mass),
            tuple(elements),
            self.orders,
            (False,) * len(elements),
            tuple(one.in_contact for one in elements.values()),
        )

    @staticmethod
    def _row(row: Mapping[str, float], names: Collection[str]) -> Floats:
        """Return a row of all coordinates."""
        return np.array([row.get(name, 0.0) for name in names], dtype=np.float64)
