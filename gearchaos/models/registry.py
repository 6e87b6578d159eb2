"""The models by the kind of their configuration."""

from collections.abc import Collection, Mapping

from gearchaos_kernels import LaneSystem

from gearchaos.arrays import Floats
from gearchaos.configuration.base import Configuration
from gearchaos.models.gear_pair.model import GearPairModel
from gearchaos.models.protocol import Model

MODELS: dict[str, Model] = {"gear_pair": GearPairModel()}


def model_of(config: Configuration) -> Model:
    """Return the model of a configuration."""
    return MODELS[config.kind]


def system_of(
    config: Configuration, values: Mapping[str, Floats], effects: Collection[str] | None = None
) -> LaneSystem:
    """Return the equations of motion of some lanes.

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
    return model_of(config).system(config, values, acting)
