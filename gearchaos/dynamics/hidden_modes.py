"""The error of an exponent that half the step does not show.

Close to its stability limit the Runge-Kutta method damps a fast mode that hardly decays: the
largest exponent of the steps is then that of another mode, and so is that of half the steps. The
difference of the two says nothing of the error.
"""

import numpy as np
from gearchaos_kernels import LaneSystem, Plan

from gearchaos.arrays import Counts, Floats
from gearchaos.configuration.methods import EXACT, FLOW_MAP_STEPS, METHODS
from gearchaos.dynamics.modes import hidden_decay
from gearchaos.dynamics.orbits import polish


def hidden_error(
    system: LaneSystem, plan: Plan, period: Counts, state: Floats, exponent: Floats
) -> Floats:
    """Return the error of the largest exponent of periodic lanes whose modes half a step damps.

    Where half the step changes the decay of a mode, see `modes.hidden_decay`, the exponent is
    compared with that of the orbit of flow maps, which is exact. Where there are no flow maps, or
    they find no orbit, with the decay of the slowest such mode: the orbit decays no faster.

    Parameters
    ----------
    system : LaneSystem
        Lanes of the kernels.
    plan : Plan
        Of it only method and steps per period count.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where a lane is not periodic.
    state : array, shape (lanes, states)
        State next to the orbit.
    exponent : array, shape (lanes,)
        Largest exponent that the steps give, per unit of tau.

    Returns
    -------
    array, shape (lanes,)
        Error per unit of tau; 0 where half the step shows it, and in lanes that are not periodic.
    """
    error = np.zeros(period.size)
    if METHODS[plan.method].exact:
        return error
    decay = hidden_decay(system, plan.steps_per_period, plan.method)
    lanes = np.flatnonzero((period > 0) & np.isfinite(decay) & np.isfinite(exponent))
    if not lanes.size:
        return error
    error[lanes] = np.maximum(decay[lanes] - exponent[lanes], 0.0)
    if system.refuses_maps():
        return error
    exact = plan._replace(method=EXACT.name, steps_per_period=FLOW_MAP_STEPS)
    orbits = polish(system.of(lanes), state[lanes], period[lanes], exact)
    known = orbits.stable & (np.abs(orbits.multipliers[:, 0]) > 0.0)
    lanes, size = lanes[known], np.abs(orbits.multipliers[known, 0])
    true = np.log(size) / (period[lanes] * system.excitation_period[lanes])
    error[lanes] = np.abs(exponent[lanes] - true)
    return error
