"""Gear trains as the engine sees them: machines whose numbers are in kg, um, ms and N."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.models.linear.model import MachineModel
from gearchaos.models.protocol import Scales
from gearchaos.models.train.configuration import TrainConfiguration
from gearchaos.outputs.scales import Quantity


class TrainModel(MachineModel):
    """A gear train or a planetary set; times are in ms."""

    units = MappingProxyType(
        {
            Quantity.LENGTH: "um",
            Quantity.SPEED: "um/ms",
            Quantity.ACCELERATION: "um/ms^2",
            Quantity.ANGLE: "mrad",
            Quantity.ANGULAR_SPEED: "mrad/ms",
            Quantity.ANGULAR_ACCELERATION: "mrad/ms^2",
            Quantity.FORCE: "N",
            Quantity.TORQUE: "N m",
            Quantity.GROWTH_RATE: "ms^-1",
            Quantity.TIME: "ms",
        }
    )
    angle = "_angle"
    terms = MappingProxyType({})
    exciter = "mesh"
    contact_words = "mean mesh stiffness, all teeth in contact"

    def scales(self, config: TrainConfiguration, values: Mapping[str, Floats]) -> Scales:
        """Return the scales of frequency and speed; the latter is that of the first mesh."""
        lanes = np.broadcast_shapes(*(np.shape(value) for value in values.values()))
        return Scales(np.full(lanes, 1e3), 60.0 / config.mesh_rate())
