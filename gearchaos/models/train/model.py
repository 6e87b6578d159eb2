"""Gear trains as the engine sees them: machines whose numbers are in kg, um, ms and N."""

from types import MappingProxyType

from gearchaos.models.linear.model import MachineModel
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
            Quantity.GROWTH_RATE: "ms^-1",
        }
    )
    angle = "_angle"
    contact_words = "mean mesh stiffness, all teeth in contact"
