"""The errors of teeth that each have their own."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.plan import Floats

SPLINE_DEGREE = 5
"""Of the splines between the shares: e'' then has the derivatives that order 4 asks for."""


class Teeth(NamedTuple):
    """Pitch errors tooth by tooth, in place of the sine of eq. 14; see `teeth`.

    ``driving`` (profiles, teeth of the driving gear), ``driven`` (profiles, teeth of the driven
    one): the errors in the order in which teeth come into mesh, positive where the flank lies
    ahead in the direction of rotation, in units of `Groups.error_amplitude`; ``profile`` (lanes,):
    which of these a lane has. ``share`` (cells,): mean share of one tooth pair in the mesh force
    over each cell, of which a mesh period has ``cells_per_period``, from its coming into mesh on:
    pair j, of the teeth j of both gears, comes into mesh at mesh phase j + ``entry``, in periods.
    """

    driving: Floats
    driven: Floats
    profile: NDArray[np.intp]
    share: Floats
    cells_per_period: int
    entry: float

    @property
    def begins(self) -> float:
        """Mesh phase, in periods, at which pair 0 begins to take load.

        The spline of a cell is centred on it and reaches beyond, so that this may lie before 0.
        """
        return self.entry - SPLINE_DEGREE / (2.0 * self.cells_per_period)

    @property
    def ahead(self) -> int:
        """How many pairs beyond the one of its number begin to take load in a mesh period."""
        return -math.floor(self.begins)

    @property
    def most_at_once(self) -> int:
        """Most tooth pairs that share the load at the same time."""
        return math.ceil(self._reach)

    @property
    def _reach(self) -> float:
        """Mesh periods in which a pair has a share."""
        return (self.share.size + SPLINE_DEGREE) / self.cells_per_period

    @property
    def pairs_in_mesh(self) -> int:
        """Most tooth pairs that have a share in the same mesh period."""
        return math.ceil(self._reach + self.begins + self.ahead)
