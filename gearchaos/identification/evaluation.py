"""What the lanes of many candidates come to: all of a generation are one batch."""

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
"""Return distance that counts as periodic: what is compared are short runs on coarse grids."""

KEPT_PERIODS = 8
"""Mesh periods after the recorded ones over which the largest acceleration is looked for."""

FINER = 4
"""How many times finer that motion is, so that its largest acceleration is not stepped over."""

MOTIONS_AT_ONCE = 2**8  # Lanes whose finer motion is in memory at a time: all of its samples are.


class Records(NamedTuple):
    """What the lanes of some candidates came to, candidates first and swept values second.

    ``section`` (candidates, values, points): delta_5 once a mesh period; ``period``: in mesh
    periods, 0 where the motion is not periodic; ``exponent``: per unit of tau; both are
    (candidates, values); ``acceleration`` (candidates, values, coordinates): the largest one, not a
    number at values where nobody looks at it; ``sound`` (candidates, values): not diverged.
    """

    section: Floats
    period: Counts
    exponent: Floats
    acceleration: Floats
    sound: Mask

    def at(self, values: Integers) -> "Records":
        """Return what there is at some of the swept values, by their numbers."""
        arrays: Any = (array[:, values] for array in self)
        return Records(*arrays)


def evaluate(
    config: Configuration, values: Floats, parameters: dict[str, Floats], accelerated: Mask
) -> Records:
    """Integrate every candidate at every swept value.

    The configuration gives the scene, the start, and how long and how finely is integrated;
    ``values`` (values,) of the swept parameter ascend; ``parameters``: the free ones by their keys,
    (candidates,); ``accelerated`` (values,): where the largest acceleration is looked for.
    """
    lines = np.arange(values.size)[np.newaxis]
    if config.start.carry != "none":
        # One value after the other, each from where the one before it ended.
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
    return Records(*joined).at(order)


def require_stable(config: Configuration, values: Floats, parameters: dict[str, Floats]) -> None:
    """Refuse candidates with which RK4 is unstable at the ends of the swept values.

    ``values`` and ``parameters`` as in `evaluate`. Raises ConfigurationError.
    """
    steps, ends = plan_of(config).steps_per_period, values[[0, -1]]
    if METHODS[config.integration.method].exact:
        return
    candidates = len(next(iter(parameters.values())))
    swept = {config.sweep.parameter: np.tile(ends, candidates)}
    fixed = {key: np.repeat(value, ends.size) for key, value in parameters.items()}
    fewest = fewest_stable_steps(system_of(config, swept | fixed, config.needed_effects))
    worst = np.argmax(fewest)
    if fewest[worst] > steps:
        where = ", ".join(f"{key} = {value[worst]:.6g}" for key, value in (swept | fixed).items())
        raise ConfigurationError(
            f"{config.source}: integration.steps_per_period = {steps}: RK4 is unstable below "
            f"{fewest[worst]} steps per period with {where}; raise it in `set` of the targets "
            "file, or narrow the bounds there"
        )


def _records(system: LaneSystem, outcome: Outcome, looked_at: Integers, plan: Plan) -> Records:
    """Return what lanes came to, each array with the lanes first."""
    sound = outcome.status == Status.OK
    # The torsion and its rate: the other coordinates follow them.
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
    return Records(outcome.section[..., 0], period, exponent, acceleration, sound)
