"""The states in which lanes start."""

import numpy as np
from gearchaos_kernels import System
from numpy.typing import NDArray

from gearchaos.configuration import Configuration

Floats = NDArray[np.float64]

_DRAWS_PER_LANE = 12
"""Random numbers set aside per lane: a multiple of the four that one Philox counter yields."""

_PHILOX_WIDTH = 4


def start_states(config: Configuration, system: System, numbers: NDArray[np.intp]) -> Floats:
    """Return the start states of some lanes, shape (lanes, states).

    Parameters
    ----------
    config : Configuration
        Its table ``start`` decides.
    system : System
        Of these lanes.
    numbers : ndarray of int, shape (lanes,)
        Their numbers in the whole sweep, ascending: the random state of a lane depends on its
        number and the seed alone.
    """
    start = np.zeros((system.lanes, len(system.states)))
    kind = config.start.kind
    if kind == "given":
        for name, value in config.start.state.items():
            # What starts in a state that nothing kept depends on is not computed.
            if name in system.states:
                start[:, system.states.index(name)] = value
    elif kind == "contact":
        start[:, system.states.index("delta_5")] = _contact(system)
    elif kind == "random":
        first = int(numbers[0])
        generator = np.random.Philox(config.start.seed)
        generator.advance(first * (_DRAWS_PER_LANE // _PHILOX_WIDTH))
        shape = (int(numbers[-1]) - first + 1, _DRAWS_PER_LANE)
        draws = np.random.Generator(generator).uniform(-1.0, 1.0, shape)[numbers - first]
        columns = [config.scene.states.index(name) for name in system.states]
        start[:] = config.start.spread * draws[:, columns]
    return start


def _contact(system: System) -> Floats:
    """Clearance taken up towards the load, and the deflection f_n of a mesh of stiffness 1."""
    groups = system.groups
    clearance = np.zeros(system.lanes)
    if system.effects.backlash:
        clearance = groups.half_backlash * np.cos(groups.base_helix_angle)
    return np.copysign(clearance, groups.load) + groups.load
