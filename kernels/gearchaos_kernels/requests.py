"""Check that the arrays and the plan of an integration fit the system before compiled code runs.

Compiled code does not check bounds: arrays of another shape would read and write foreign memory.
"""

from typing import Any

import numpy as np

from gearchaos_kernels.plan import Plan


def require_fitting(system: Any, plan: Plan, arrays: dict[str, Any], periods: Any) -> None:
    """Raise ValueError if an integration needs what the system or the plan does not have.

    ``arrays``: states and tangent vectors by name, None if they are not given; ``periods``: see
    `integrate`.
    """
    shape = system.lanes, len(system.states)
    for name, given in arrays.items():
        if given is not None and np.shape(given) != shape:
            raise ValueError(
                f"{name} has the shape {np.shape(given)}; {shape[0]} lanes of {shape[1]} states "
                f"need {shape}"
            )
    _require_sound(plan)
    if periods is None:
        return
    if np.shape(periods) != shape[:1]:
        raise ValueError(f"periods has the shape {np.shape(periods)}; give {shape[:1]}")
    if np.any((np.asarray(periods) < 0) | (np.asarray(periods) > plan.recorded_periods)):
        raise ValueError(f"periods must be from 0 to those of the plan, {plan.recorded_periods}")


def _require_sound(plan: Plan) -> None:
    """Raise ValueError if a plan has negative numbers, or records more than it integrates."""
    if plan.steps_per_period < 1:
        raise ValueError(f"steps_per_period = {plan.steps_per_period}: must be at least 1")
    for name in "transient_periods", "recorded_periods", "section_points", "history_periods":
        if getattr(plan, name) < 0:
            raise ValueError(f"{name} = {getattr(plan, name)}: must be at least 0")
    total = plan.transient_periods + plan.recorded_periods
    for name in "section_points", "history_periods":
        if getattr(plan, name) > total:
            rule = f"must be at most transient_periods + recorded_periods, {total}"
            raise ValueError(f"{name} = {getattr(plan, name)}: {rule}")
