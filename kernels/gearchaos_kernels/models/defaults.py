"""Formulas of a model that leaves them out; see `protocol`.

They serve a model whose lanes share the mesh phase, which one number forces (its drive, an
acceleration per step squared), and whose excitation contains sine and cosine of the mesh phase.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.models.interfaces import (
    elements_at,
    forcing_at,
    half_clearances,
    point_of_waves,
    unforced,
)


@scalar
def prepare_nothing(memory, slot, index, period, tables, scene):
    """Prepare nothing for a mesh period."""


@scalar
def shared_point(memory, slot, grid, scene):
    """Return the mesh phase that all lanes share."""
    return grid


@scalar
def keep_nothing(memory, slot, point, scene):
    """Keep nothing, because the lanes share the mesh phase."""


@scalar
def same_state(state, forcing, scene):
    """Return a state as it is: it is stored in the coordinates of the equations."""
    return state


@scalar
def same_accelerations(changes, lane, point, scene):
    """Return accelerations as they are: states are stored in the coordinates of the equations."""
    return changes


@scalar
def no_drive(lane, scene):
    """Return a drive of zero."""
    return 0.0


@scalar
def drive_alone(lane, drive, scene):
    """Return a drive as what acts on a lane."""
    return drive


@scalar
def clearances_of_elements(lane, scene):
    """Return the half clearance of each element."""
    return each(clearance_of, elements_at(lane, unforced(lane, scene), scene))


@scalar
def clearance_of(element):
    """Return the half clearance of an element."""
    return element.half_clearance


@scalar
def speeds_of_lane(lane, scene):
    """Return the lane's coefficient ``speed`` for each element."""
    return each(speed_of, half_clearances(lane, scene), lane.speed)


@scalar
def speed_of(_half_clearance, speed):
    """Return the factor from rates per step to rates per unit of tau."""
    return speed


@scalar
def never(lane, scene):
    """Return a moment that never comes."""
    return math.inf


@scalar
def switch_nothing(memory, slot, lane, scene):
    """Change nothing, because the coefficients of a lane are constant."""


@scalar
def drive_with_waves(lane, drive, waves, scene):
    """Return a drive plus what these values of the waves add to that of a lane."""
    return drive + forcing_at(lane, point_of_waves(waves, scene), scene)


@scalar
def equal_shares(lane, scene):
    """Return 1 for each element."""
    return each(one_of, half_clearances(lane, scene))


@scalar
def one_of(_half_clearance):
    """Return 1."""
    return 1.0


@scalar
def no_mean_gaps(lane, scene):
    """Return 0 for each element."""
    return each(zero_of, half_clearances(lane, scene))


@scalar
def zero_of(_half_clearance):
    """Return 0."""
    return 0.0


def load_and_harmonic(_flags: Any) -> NDArray[Any]:
    """Return the inputs of a model with a load and a harmonic: see `MapFormulas.inputs`."""
    inputs = np.zeros((2, 3, 3))
    inputs[0, 0, 0] = 1.0
    inputs[1, 1, 1] = inputs[1, 2, 2] = 1.0
    return inputs
