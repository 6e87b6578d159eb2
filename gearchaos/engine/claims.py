"""What is claimed of the error of some lanes beyond what another grid shows."""

from collections.abc import Sequence

import numpy as np
from gearchaos_kernels import Outcome, Plan, System

from gearchaos.arrays import Floats
from gearchaos.dynamics.hidden_modes import hidden_error
from gearchaos.dynamics.labelling import Told
from gearchaos.dynamics.remainders import remainders
from gearchaos.records.difference import Solution


def columns_of(system: System, kept: Sequence[str]) -> list[int]:
    """Return the numbers of the kept states, or of all where none is kept."""
    return [system.states.index(name) for name in kept or system.states]


def points_of(plan: Plan, system: System) -> int:
    """Return how many points of the section, once an excitation period, a plan keeps."""
    return -(-plan.section_points // system.repeats_after)


def completed(
    solution: Solution,
    system: System,
    outcome: Outcome,
    plan: Plan,
    kept: tuple[int, Sequence[str]],
    told: Told | None,
) -> tuple[Solution, Floats]:
    """Add to a solution what the transient has left, what no grid shows, and rounding.

    ``outcome`` and ``told``: the integrated lanes and their labels; ``kept``: how many points of
    the section the file keeps, once an excitation period, and of which states. Returned is also the
    largest distance of the kept points from the orbit, (lanes,), not a number where none is known.
    """
    state = outcome.end_state if told is None else told.state
    section = outcome.every(system.repeats_after).section
    left = remainders(
        system, section, (kept[0], columns_of(system, kept[1])), solution.period, state, plan
    )
    completed = solution._replace(
        transient=left.distance,
        hidden=hidden_error(system, plan, solution.period, state, solution.exponent),
        section_rounding=np.fmax(solution.section_rounding, left.section_rounding),
        exponent_rounding=np.fmax(solution.exponent_rounding, left.exponent_rounding),
    )
    return completed, left.of_kept
