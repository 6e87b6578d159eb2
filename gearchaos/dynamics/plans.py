"""From a configuration to the plan of an integration."""

from typing import Any

from gearchaos_kernels import ForkedProcessError, Plan, require_threads

from gearchaos.configuration import Configuration
from gearchaos.configuration.run_tables import DEFAULT_STEPS
from gearchaos.errors import ExecutionError


def plan_of(config: Configuration, **others: Any) -> Plan:
    """Return the configured plan of an integration that keeps no section, but for some fields.

    Where no steps per period are configured, it has the fewest that are ever chosen. Raises
    ExecutionError in a process that cannot integrate, as it was forked from one that has.
    """
    try:
        require_threads()
    except ForkedProcessError as error:
        raise ExecutionError(str(error)) from None
    integration = config.integration
    configured = Plan(
        integration.steps_per_period or DEFAULT_STEPS,
        integration.transient_periods,
        integration.recorded_periods,
        section_points=0,
        resolved=integration.crossings == "resolved",
        method=integration.method,
    )
    return configured._replace(**others)
