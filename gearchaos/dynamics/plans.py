"""The plan of an integration, from a configuration."""

from typing import Any

from gearchaos_kernels import ForkedProcessError, Plan, require_threads

from gearchaos.configuration import Configuration
from gearchaos.configuration.run_tables import DEFAULT_STEPS
from gearchaos.errors import ExecutionError


def plan_of(config: Configuration, **others: Any) -> Plan:
    """Return the plan of an integration as configured, without a section.

    Parameters
    ----------
    config : Configuration
        The configuration.
    **others
        Fields of the plan that differ from the configuration.

    Returns
    -------
    Plan
        The plan; without configured steps per period it has `DEFAULT_STEPS`.

    Raises
    ------
    ExecutionError
        If the process was forked from one that has integrated, and therefore cannot integrate.
    """
    try:
        require_threads()
    except ForkedProcessError as error:
        raise ExecutionError(str(error)) from None
    integration = config.integration
    configured = Plan(
        integration.fixed_steps or DEFAULT_STEPS,
        integration.transient_periods,
        integration.recorded_periods,
        section_points=0,
        resolved=integration.crossings == "resolved",
        method=integration.method,
    )
    return configured._replace(**others)
