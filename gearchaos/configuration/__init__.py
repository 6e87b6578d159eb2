"""What a sweep computes, read from TOML and checked before anything runs."""

from gearchaos.configuration.base import Configuration, Given, configuration_of, load_config
from gearchaos.configuration.tables import axis_values, swept_values
