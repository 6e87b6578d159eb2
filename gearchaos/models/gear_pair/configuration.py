"""The configuration of a sweep of gear pairs."""

from collections.abc import Iterator, Mapping
from typing import Any

from gearchaos.configuration.base import Configuration
from gearchaos.configuration.messages import Fault
from gearchaos.configuration.rules import GENERIC_RULES
from gearchaos.models.gear_pair.lane_rules import lane_faults
from gearchaos.models.gear_pair.pitch_errors import with_deviation_files
from gearchaos.models.gear_pair.rules import RULES
from gearchaos.models.gear_pair.tables import GearPairTables
from gearchaos.models.stiffness_table import with_stiffness_files


class GearPairConfiguration(GearPairTables, Configuration):
    """A gear pair, the effects that exist, the sweeps, and what is kept of them.

    A GearPairConfiguration that exists is sound: every rule has been checked, also those between
    tables. It cannot be changed; `replace` gives a changed copy.
    """

    kind = "gear_pair"
    rules = (*RULES, *GENERIC_RULES)
    discrete_parameters = frozenset({"pitch_error.grade"})

    @classmethod
    def with_files(
        cls, tables: Mapping[str, Any], folder: str | None
    ) -> tuple[Mapping[str, Any], list[Fault]]:
        """Return tables with the contents of the files that they name, and faults.

        These are pitch deviations and tables of the mesh stiffness.
        """
        tables, faults = with_stiffness_files(tables, folder)
        tables, more = with_deviation_files(tables, folder)
        return tables, [*faults, *more]

    def lane_faults(self) -> Iterator[Fault]:
        """Yield the faults of the groups of the lanes, where each table is sound."""
        return lane_faults(self)
