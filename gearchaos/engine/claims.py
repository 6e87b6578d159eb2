"""Errors of lanes that a comparison of two grids does not show."""

from collections.abc import Sequence

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan

from gearchaos.dynamics.hidden_modes import hidden_error
from gearchaos.dynamics.labelling import Labelled
from gearchaos.dynamics.remainders import remainders
from gearchaos.records.difference import Solution


def columns_of(system: LaneSystem, kept: Sequence[str]) -> list[int]:
    """Return the columns of the kept states, or of all states if none is kept."""
    return [system.states.index(name) for name in kept or system.states]


def completed(
    solution: Solution,
    system: LaneSystem,
    outcome: Outcome,
    plan: Plan,
    kept: Sequence[str],
    labelled: Labelled | None,
) -> Solution:
    """Add the remaining transient, hidden errors and rounding to a solution.

    ``outcome`` and ``labelled``: the integrated lanes and their labels; ``kept``: states whose
    sections are compared. The distance from the orbit is measured over its last period.
    """
    state = outcome.end_state if labelled is None else labelled.state
    section = outcome.every(system.repeats_after).section
    of_states = 1, columns_of(system, kept)
    left = remainders(system, section, of_states, solution.period, state, plan)
    return solution._replace(
        transient=left.distance,
        hidden=hidden_error(system, plan, solution.period, state, solution.exponent),
        section_rounding=np.fmax(solution.section_rounding, left.section_rounding),
        exponent_rounding=np.fmax(solution.exponent_rounding, left.exponent_rounding),
    )
