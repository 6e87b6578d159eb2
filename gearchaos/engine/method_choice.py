"""The choice of a method where the configuration leaves it to the program."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import METHODS

from gearchaos.configuration import methods
from gearchaos.configuration.methods import AUTO, DEFAULT, INTEGRATORS
from gearchaos.dynamics.plans import plan_of
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.lanes import Lanes
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration
from gearchaos.progress import say

LANES_ESTIMATED = 2**14
"""Largest number of lanes from which the time of the methods is estimated."""


class Alternatives(NamedTuple):
    """The methods of a configuration.

    Attributes
    ----------
    possible : dict of str to Configuration
        The configuration with every method that can integrate it, by the name of the method.
    refused : dict of str to str
        Why each of the other methods cannot, by the name of the method.
    """

    possible: dict[str, Configuration]
    refused: dict[str, str]


def alternatives(config: Configuration) -> Alternatives:
    """Return the methods that can integrate a configuration, and why the others cannot.

    Raises ConfigurationError if the default method cannot.
    """
    found = Alternatives({DEFAULT.name: config.integrated_by(DEFAULT.name)}, {})
    for method in INTEGRATORS:
        try:
            one = config.integrated_by(method.name)
        except ConfigurationError as error:
            if method.for_machines:
                # Nothing to know for those who have no machine.
                continue
            found.refused[method.name] = str(error).removeprefix(f"{config.source}: ")
            continue
        if refusal := METHODS[method.name].refuses(Lanes(one).system_of(np.arange(1))):
            found.refused[method.name] = refusal
        else:
            found.possible[method.name] = one
    return found


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
    possible = alternatives(config).possible
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
    possible, refused = alternatives(config)
    # Estimates take time, and a single method needs none.
    work = {name: _work(one) for name, one in possible.items()} if len(possible) > 1 else {}
    chosen, *others = sorted(work, key=lambda name: work[name]) or [*possible]
    reasons = [
        f"{other} is estimated to take {work[other] / work[chosen]:.2g} times as long"
        for other in others
    ]
    reasons += [f"with {name}: {reason}" for name, reason in refused.items()]
    note = "; ".join([f'integration.method = "{AUTO}": {chosen} is taken', *reasons])
    return possible[chosen], note


def for_continuation(config: Configuration, own_maps: Callable[[str], bool]) -> Configuration:
    """Return a configuration with the method that follows orbits over a parameter.

    Where each orbit would need flow maps of its own, another exact method takes less time. Next to
    grazings it is also more accurate: neighbouring maps differ in their rounding, and a difference
    over a small step of the parameter magnifies this.

    Parameters
    ----------
    config : Configuration
        The configuration.
    own_maps : callable
        Whether every value of a parameter has maps of its own, by the name of the method.

    Returns
    -------
    Configuration
        The same, unless maps would differ and another exact method can integrate it. A message
        names the other method.
    """
    chosen, _ = with_method(config)
    given = methods.METHODS[chosen.integration.method]
    if not given.shares_maps or not own_maps(given.name):
        return config
    possible = alternatives(config).possible
    mapless = [one for one in INTEGRATORS if one.exact and not one.shares_maps]
    for method in mapless:
        if method.name in possible:
            say(
                f"orbits are followed with {method.title}, since each would need "
                f"{given.title} of its own"
            )
            return possible[method.name]
    return config


def _work(config: Configuration) -> float:
    """Estimate the time that a method takes per lane, see `METHODS`."""
    lanes = Lanes(config)
    system = lanes.system_of(lanes.computed_at(np.arange(min(len(lanes), LANES_ESTIMATED))))
    outputs, method = config.outputs, METHODS[config.integration.method]
    plan = plan_of(config, loads=outputs.loads, states=outputs.states, orders=outputs.mesh_orders)
    return method.work(system, plan, fewest_stable_steps(system)) / system.lanes
