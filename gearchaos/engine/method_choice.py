"""The choice of a method where the configuration leaves it to the program."""

import numpy as np
from gearchaos_kernels import METHODS

from gearchaos.configuration.methods import AUTO, EXACT
from gearchaos.dynamics.plans import plan_of
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.lanes import Lanes
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration

LANES_ESTIMATED = 2**14
"""Largest number of lanes from which the time of the methods is estimated."""

FIXED_STEPS = "rk4"
"""The method that can integrate every scene."""


def alternatives(config: Configuration) -> tuple[dict[str, Configuration], str]:
    """Return the configuration with every method that can integrate it, and a reason.

    Parameters
    ----------
    config : Configuration
        A configuration, whatever its method.

    Returns
    -------
    configurations : dict of str to Configuration
        By the name of the method.
    reason : str
        Why flow maps are not among them; empty if they are.
    """
    fixed = config.integrated_by(FIXED_STEPS)
    try:
        exact = config.integrated_by(EXACT.name)
    except ConfigurationError as error:
        return {FIXED_STEPS: fixed}, str(error).removeprefix(f"{config.source}: ")
    if refusal := Lanes(exact).system_of(np.arange(1)).refuses_maps():
        return {FIXED_STEPS: fixed}, refusal
    return {FIXED_STEPS: fixed, EXACT.name: exact}, ""


def other_methods(config: Configuration, chosen: str) -> list[Configuration]:
    """Return a configuration with the methods that were not chosen; none if it names its method.

    Parameters
    ----------
    config : Configuration
        The configuration.
    chosen : str
        Name of the chosen method.

    Returns
    -------
    list of Configuration
        One configuration for each of the other methods that can integrate it.
    """
    if config.integration.method != AUTO:
        return []
    possible, _ = alternatives(config)
    return [one for name, one in possible.items() if name != chosen]


def with_method(config: Configuration) -> tuple[Configuration, str]:
    """Return a configuration with a chosen method, and a note about the choice.

    The choice follows from the configuration alone: it is the same on every machine, and for a
    sweep that is resumed or computed in shards.

    Parameters
    ----------
    config : Configuration
        The configuration.

    Returns
    -------
    config : Configuration
        The configuration; the same if it names a method.
    note : str
        The chosen method and the reason; empty if the configuration names a method.

    Raises
    ------
    ConfigurationError
        If the configuration breaks a rule with every method.
    """
    if config.integration.method != AUTO:
        return config, ""
    possible, reason = alternatives(config)
    if reason:
        note = f'integration.method = "{AUTO}": {FIXED_STEPS} is taken; with {EXACT.name}: {reason}'
        return possible[FIXED_STEPS], note
    work = {name: _work(one) for name, one in possible.items()}
    chosen, other = sorted(work, key=lambda name: work[name])
    return possible[chosen], (
        f'integration.method = "{AUTO}": {chosen} is taken; {other} is estimated to take '
        f"{work[other] / work[chosen]:.2g} times as long"
    )


def _work(config: Configuration) -> float:
    """Estimate the time that a method takes per lane, see `METHODS`."""
    lanes = Lanes(config)
    system = lanes.system_of(lanes.computed_at(np.arange(min(len(lanes), LANES_ESTIMATED))))
    outputs, method = config.outputs, METHODS[config.integration.method]
    plan = plan_of(config, loads=outputs.loads, states=outputs.states, orders=outputs.mesh_orders)
    return method.work(system, plan, fewest_stable_steps(system)) / system.lanes
