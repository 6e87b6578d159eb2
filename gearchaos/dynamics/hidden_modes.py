"""The error of an exponent that halving the step does not show.

Close to its stability limit, a method damps fast modes that hardly decay. The largest
exponent with N and with 2 N steps is then that of another mode. The difference between the two
results does not contain the error.
"""

import numpy as np
from gearchaos_kernels import LaneSystem, Plan

from gearchaos.arrays import Counts, Floats
from gearchaos.configuration.methods import EXACT, EXACT_STEPS, METHODS
from gearchaos.dynamics.modes import hidden_decay
from gearchaos.dynamics.orbits import polish


def hidden_error(
    system: LaneSystem, plan: Plan, period: Counts, state: Floats, exponent: Floats
) -> Floats:
    """Return the error of the largest exponent of periodic lanes with numerically damped modes.

    Parameters
    ----------
    system : LaneSystem
        The system of the lanes.
    plan : Plan
        Method and steps per period.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where a lane is not periodic.
    state : array, shape (lanes, states)
        State next to the orbit.
    exponent : array, shape (lanes,)
        Largest exponent with these steps, per unit of tau.

    Returns
    -------
    array, shape (lanes,)
        Error per unit of tau; 0 where half the step shows it, and in lanes that are not periodic.

    Notes
    -----
    Where half the step changes the decay of a mode (`modes.hidden_decay`), the exponent is compared
    with that of the orbit of the exact method. If that method refuses the system, or without an
    orbit, it is compared with the decay of the slowest such mode, because the orbit does not decay
    faster.
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
    exact = plan._replace(method=EXACT.name, steps_per_period=EXACT_STEPS)
    orbits = polish(system.of(lanes), state[lanes], period[lanes], exact)
    known = orbits.stable & (np.abs(orbits.multipliers[:, 0]) > 0.0)
    lanes, size = lanes[known], np.abs(orbits.multipliers[known, 0])
    true = np.log(size) / (period[lanes] * system.excitation_period[lanes])
    error[lanes] = np.abs(exponent[lanes] - true)
    return error
