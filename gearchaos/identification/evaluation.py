"""Integration of the lanes of many candidates; one generation is one batch."""

from typing import Any, NamedTuple

import gearchaos_kernels as kernels
import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan, Status, integrate

from gearchaos.arrays import Counts, Floats, Integers, Mask
from gearchaos.configuration.methods import METHODS
from gearchaos.dynamics.plans import plan_of
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.lanes import start_states
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration
from gearchaos.models.registry import system_of
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.records.period import period_of, return_distances

RETURN = 1e-3
"""Return distance that counts as periodic; generous, since runs are short and grids coarse."""

KEPT_PERIODS = 8
"""Mesh periods after the recorded ones from which the largest acceleration is taken."""

FINER = 4
"""Refinement of the steps over these periods, so that no step misses the largest acceleration."""

MOTIONS_AT_ONCE = 2**8  # Lanes with a finer motion at a time: all its samples are in memory.


class CandidateRecords(NamedTuple):
    """Results of the lanes of some candidates.

    Attributes
    ----------
    section : (candidates, values, points)
        delta_5 once a mesh period.
    period : (candidates, values)
        Period in mesh periods, 0 where the motion is not periodic.
    exponent : (candidates, values)
        Largest Lyapunov exponent per unit of tau.
    acceleration : (candidates, values, coordinates)
        Largest acceleration, NaN at values where no observation uses it.
    sound : (candidates, values)
        Whether the lane did not diverge.
    """

    section: Floats
    period: Counts
    exponent: Floats
    acceleration: Floats
    sound: Mask

    def at(self, values: Integers) -> "CandidateRecords":
        """Return the results at some of the swept values, by their numbers."""
        arrays: Any = (array[:, values] for array in self)
        return CandidateRecords(*arrays)


def evaluate_candidates(
    config: Configuration, values: Floats, parameters: dict[str, Floats], accelerated: Mask
) -> CandidateRecords:
    """Integrate every candidate at every swept value.

    Parameters
    ----------
    config : Configuration
        Scene, start and integration.
    values : (values,)
        Swept values, ascending.
    parameters : dict of str to (candidates,)
        Free parameters by key.
    accelerated : (values,)
        Whether the largest acceleration is computed at a value.
    """
    lines = np.arange(values.size)[np.newaxis]
    if config.start.carry != "none":
        # One value after the other: each starts at the end state of the previous one.
        lines = lines.T[::-1] if config.start.carry == "downwards" else lines.T
    candidates = len(next(iter(parameters.values())))
    recorded = config.integration.recorded_periods
    plan, before, parts = plan_of(config, section_points=recorded, tangent=True), None, []
    for line in lines:
        swept = {config.sweep.parameter: np.tile(values[line], candidates)}
        fixed = {key: np.repeat(value, line.size) for key, value in parameters.items()}
        system = system_of(config, swept | fixed, config.needed_effects)
        start = start_states(config, system, np.tile(line, candidates))
        if before is not None:
            start = np.where(np.isfinite(before).all(axis=1, keepdims=True), before, start)
        outcome = integrate(system, start, plan)
        before = outcome.end_state
        looked_at = np.flatnonzero(np.tile(accelerated[line], candidates))
        found = _records(system, outcome, looked_at, plan)
        parts.append([one.reshape(candidates, line.size, *one.shape[1:]) for one in found])
    order = np.argsort(np.ravel(lines))
    joined: Any = (np.concatenate(arrays, axis=1) for arrays in zip(*parts, strict=True))
    return CandidateRecords(*joined).at(order)


def require_stable(config: Configuration, values: Floats, parameters: dict[str, Floats]) -> None:
    """Reject steps that are unstable at the ends of the swept values.

    Parameters
    ----------
    config, values, parameters
        As for `evaluate_candidates`.

    Raises
    ------
    ConfigurationError
        If a candidate needs more steps per period than configured, with a method that can be
        unstable.
    """
    steps, ends = plan_of(config).steps_per_period, values[[0, -1]]
    method = METHODS[config.integration.method]
    if method.exact:
        return
    candidates = len(next(iter(parameters.values())))
    swept = {config.sweep.parameter: np.tile(ends, candidates)}
    fixed = {key: np.repeat(value, ends.size) for key, value in parameters.items()}
    system = system_of(config, swept | fixed, config.needed_effects)
    fewest = fewest_stable_steps(system, method.name)
    worst = np.argmax(fewest)
    if fewest[worst] > steps:
        where = ", ".join(f"{key} = {value[worst]:.6g}" for key, value in (swept | fixed).items())
        raise ConfigurationError(
            f"{config.source}: integration.steps_per_period = {steps}: {method.title} is unstable "
            f"below {fewest[worst]} steps per period with {where}; raise it in `set` of the "
            "targets file, or narrow the bounds there"
        )


def _records(
    system: LaneSystem, outcome: Outcome, looked_at: Integers, plan: Plan
) -> CandidateRecords:
    """Return the results of lanes, each array with the lanes first."""
    sound = outcome.status == Status.OK
    # Torsion and its rate are enough: the other coordinates are periodic when these are.
    distances = return_distances(outcome.section[..., :2])
    period = np.where(sound, period_of(distances, RETURN), np.int32(0))
    exponent, _ = largest_exponent(outcome.growth, system.mesh_period)
    acceleration = np.full((sound.size, len(system.states) // 2), np.nan)
    finer = plan._replace(
        steps_per_period=FINER * plan.steps_per_period,
        transient_periods=0,
        recorded_periods=KEPT_PERIODS,
        section_points=0,
        history_periods=KEPT_PERIODS,
    )
    for first in range(0, looked_at.size, MOTIONS_AT_ONCE):
        lanes = looked_at[first : first + MOTIONS_AT_ONCE]
        some = system.of(lanes)
        motion = integrate(some, outcome.end_state[lanes], finer)
        found = kernels.evaluate(some, motion.history, finer.steps_per_period).accelerations
        acceleration[lanes] = np.max(found, axis=1)
    return CandidateRecords(outcome.section[..., 0], period, exponent, acceleration, sound)
