"""One piecewise-linear machine as matrices."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats


class Machine(NamedTuple):
    """The matrices of one machine with n coordinates and m clearance elements.

    Its equations are those of `docs/machines.md`::

        M x'' + C x' + K x = f(phi) - sum_j r_j [k_j(phi) D(y_j; b_j) + c_j y_j']

        y_j = n_j x - e_j(phi)

    Waves are the constant 1, then cosine and sine of each order of the excitation, w in all.

    Attributes
    ----------
    frequency : float
        Angular frequency of the excitation, whose period is the mesh period.
    mass, damping, stiffness : array, shape (n, n)
        M, C and K.
    reaction : array, shape (n, m)
        The reactions r_j as columns.
    gap : array, shape (m, n)
        The rows n_j.
    force : array, shape (n, w)
        f, as parts of the waves.
    motion, contact_stiffness : array, shape (m, w)
        e_j and k_j, as parts of the waves.
    contact_damping, half_clearance : array, shape (m,)
        c_j and b_j.
    """

    frequency: float
    mass: Floats
    damping: Floats
    stiffness: Floats
    reaction: Floats
    gap: Floats
    force: Floats
    motion: Floats
    contact_stiffness: Floats
    contact_damping: Floats
    half_clearance: Floats

    @property
    def held(self) -> Floats:
        """K with all elements in contact at their mean stiffness, shape (n, n)."""
        held: Floats = self.stiffness + self.reaction @ (self.contact_stiffness[:, :1] * self.gap)
        return held


class Parts(NamedTuple):
    """A machine at any frequency.

    Attributes
    ----------
    at_one : Machine
        The machine at some frequency.
    force : callable or None
        Returns its force at a frequency, shape (n, w); None if that is always the same.
    """

    at_one: Machine
    force: Callable[[float], Floats] | None = None

    def machine(self, frequency: float) -> Machine:
        """Return the machine at a frequency."""
        force = self.at_one.force if self.force is None else self.force(frequency)
        return self.at_one._replace(frequency=frequency, force=force)


class Actuator(NamedTuple):
    """An input of a machine that a controller can change.

    Attributes
    ----------
    row : mapping of str to float
        Its force on each coordinate, for an input of 1.
    steady : float
        Its steady value.
    """

    row: Mapping[str, float]
    steady: float


class Kinds(NamedTuple):
    """The common properties of all lanes of a machine.

    Attributes
    ----------
    coordinates, elements : tuple of str
        Names of the coordinates and of the clearance elements.
    orders : tuple of int
        Orders of the excitation, ascending.
    one_sided, damped_in_contact : tuple of bool
        Of each element.
    """

    coordinates: tuple[str, ...]
    elements: tuple[str, ...]
    orders: tuple[int, ...]
    one_sided: tuple[bool, ...]
    damped_in_contact: tuple[bool, ...]


def without_drift(machine: Machine, names: Sequence[str]) -> list[str]:
    """Return the names of the coordinates that nothing holds, even with all elements in contact.

    A coordinate is listed if it takes part in a motion that meets no spring. Such a machine can
    drift away.
    """
    scaled = machine.held / np.maximum(np.abs(machine.held).max(initial=0.0), 1e-300)
    _, sizes, motions = np.linalg.svd(scaled)
    free = motions[sizes < 1e-12 * sizes.max(initial=1.0)]
    return [
        name
        for name, part in zip(names, np.abs(free).max(axis=0, initial=0.0), strict=True)
        if part > 1e-6
    ]
