"""The configuration of a sweep, read from TOML and checked before the run."""

from gearchaos.configuration.base import Configuration, Given, configuration_of, load_config
from gearchaos.configuration.tables import axis_values, swept_values
