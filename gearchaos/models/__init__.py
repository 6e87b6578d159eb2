"""The models of machines: what each configures, derives and computes."""

from gearchaos.configuration import (
    Configuration,
    Given,
    axis_values,
    configuration_of,
    load_config,
    swept_values,
)

# These make their models known to `Configuration`.
from gearchaos.models.gear_pair.configuration import GearPairConfiguration
from gearchaos.models.linear.configuration import LinearConfiguration
from gearchaos.models.train.configuration import TrainConfiguration
