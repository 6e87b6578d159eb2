"""Gear trains as the engine sees them: machines whose numbers are in kg, um, ms and N."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np
from gearchaos_kernels import LaneSystem

from gearchaos.arrays import Floats
from gearchaos.models.linear.configuration import MachineConfiguration
from gearchaos.models.linear.model import MachineModel
from gearchaos.models.protocol import Scales
from gearchaos.models.train.configuration import TrainConfiguration
from gearchaos.outputs.scales import Quantity

COMMON_PERIOD = MappingProxyType(
    {
        "mesh period": "common mesh period",
        "mesh frequency": "common mesh frequency",
    }
)
"""Terms of a train whose meshes have different frequencies and repeat after that period."""


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
    terms: Mapping[str, str] = MappingProxyType({})
    exciter = "mesh"
    contact_words = "mean mesh stiffness, all teeth in contact"

    def __init__(self, config: TrainConfiguration) -> None:
        super().__init__(config)
        if not config.has_one_mesh_frequency:
            # The time is counted in common periods of the meshes, which are those of none of them.
            self.terms = COMMON_PERIOD
            self.exciter = "common period of the meshes"

    def remarks(
        self, config: MachineConfiguration, system: LaneSystem, parameters: Mapping[str, Floats]
    ) -> Iterator[str]:
        """Yield which meshes have no backlash, whether there is a load, and more of machines."""
        assert isinstance(config, TrainConfiguration)
        tight = [
            path
            for path, mesh in config.meshes
            if getattr(mesh, "half_backlash_um", None) == 0.0
            and f"{path}.half_backlash_um" not in config.swept
        ]
        if tight and "backlash" in config.scene.effects:
            yield f"{', '.join(tight)}: half_backlash_um = 0, there is no backlash"
        loads = [shaft.torque_Nm for shaft in config.shaft.values()]
        if loads and not any(loads) and not any("torque" in path for path in config.swept):
            yield "no shaft has a torque_Nm other than 0: the train runs without load"
        yield from super().remarks(config, system, parameters)

    def scales(self, config: TrainConfiguration, values: Mapping[str, Floats]) -> Scales:
        """Return the scales of frequency, and of speed: that of the common period of all meshes."""
        lanes = np.broadcast_shapes(*(np.shape(value) for value in values.values()))
        return Scales(np.full(lanes, 1e3), 60.0 / config.common_rate)
