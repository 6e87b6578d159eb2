"""The models by the kind of their configuration."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

from gearchaos_kernels import LaneSystem

from gearchaos.arrays import Floats
from gearchaos.configuration.base import Configuration
from gearchaos.models.gear_pair.model import GearPairModel
from gearchaos.models.linear.model import MachineModel
from gearchaos.models.protocol import Model
from gearchaos.models.train.model import TrainModel

GEAR_PAIR = GearPairModel()

MODELS: dict[str, Callable[[Any], Model]] = {
    "gear_pair": lambda _config: GEAR_PAIR,
    "linear": MachineModel,
    "train": TrainModel,
}
"""For each kind of configurations a function that returns the model of one of them."""


def model_of(config: Configuration) -> Model:
    """Return the model of a configuration."""
    return MODELS[config.kind](config)


def system_of(
    config: Configuration, values: Mapping[str, Floats], effects: Collection[str] | None = None
) -> LaneSystem:
    """Return the equations of motion of some lanes, with the actuator of their controllers.

    Parameters
    ----------
    config : Configuration
        The configuration.
    values : mapping of str to array, shape (lanes,)
        Value of each swept parameter in every lane, and the number of its realisation.
    effects : collection of str, optional
        Effects that act, by default those of the scene.
    """
    acting = config.scene.effects if effects is None else effects
    model = model_of(config)
    system = model.system(config, values, acting)
    if config.control is None:
        return system
    return model.actuated(config, values, system, config.actuator_of(config.control.actuator))
