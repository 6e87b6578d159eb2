"""Pitch errors of single teeth: the input of `teeth`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.plan import Floats

SPLINE_DEGREE = 5
"""Degree of the splines through the shares: a method of order 4 needs two derivatives of e''."""


class Teeth(NamedTuple):
    """Pitch errors tooth by tooth, in place of the sine of eq. 14.

    Errors are in units of `Groups.error_amplitude`, in the order in which the teeth come into mesh,
    and positive where the flank lies ahead in the direction of rotation. Tooth pair j consists of
    the teeth j of both gears, each counted modulo its number of teeth.

    Attributes
    ----------
    driving : array, shape (profiles, teeth of the driving gear)
        Errors of the driving gear.
    driven : array, shape (profiles, teeth of the driven gear)
        Errors of the driven gear.
    profile : array of int, shape (lanes,)
        Number of the profile of each lane.
    share : array, shape (cells,)
        Mean share of one tooth pair in the mesh force over each cell, from its coming into mesh on.
    cells_per_period : int
        Cells per mesh period.
    entry : float
        Pair j comes into mesh at mesh phase j + ``entry``, in mesh periods.
    """

    driving: Floats
    driven: Floats
    profile: NDArray[np.intp]
    share: Floats
    cells_per_period: int
    entry: float

    @property
    def begins(self) -> float:
        """Mesh phase in periods at which pair 0 begins to take load.

        The spline of a cell extends beyond the cell on both sides, so this may be negative.
        """
        return self.entry - SPLINE_DEGREE / (2.0 * self.cells_per_period)

    @property
    def ahead(self) -> int:
        """Number of the last pair that begins to take load in mesh period n, less n."""
        return -math.floor(self.begins)

    @property
    def most_at_once(self) -> int:
        """Largest number of tooth pairs that share the load at the same time."""
        return math.ceil(self._reach)

    @property
    def _reach(self) -> float:
        """Number of mesh periods during which a pair has a share."""
        return (self.share.size + SPLINE_DEGREE) / self.cells_per_period

    @property
    def pairs_in_mesh(self) -> int:
        """Largest number of tooth pairs that have a share within one mesh period."""
        return math.ceil(self._reach + self.begins + self.ahead)
