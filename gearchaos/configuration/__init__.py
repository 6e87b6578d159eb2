"""What a sweep computes, read from TOML and checked before anything runs."""

from gearchaos.configuration.models import Configuration, Given, configuration_of, load_config
from gearchaos.configuration.run_tables import EFFECTS, STATES
from gearchaos.configuration.tables import axis_values, groups_at, swept_values
