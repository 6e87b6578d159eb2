"""Whether chaos lasts: some chaotic lanes of a result go on from where their record ended."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Status, integrate

from gearchaos.configuration import Configuration
from gearchaos.dynamics.systems import plan_of, system_of
from gearchaos.engine.running import choose_threads
from gearchaos.interrupts import check
from gearchaos.records.label import CHAOTIC_GROWTH
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.results.result import Result
from gearchaos.results.stage_table import labelled_lanes

MOST_LANES = 25
"""Chaotic lanes that are tried, spread evenly over the sweep: they bound the cost."""


class Survival(NamedTuple):
    """Of so many chaotic lanes tried, how many are still chaotic after so many more records."""

    records: int
    lanes: int
    outlasting: int

    @property
    def text(self) -> str:
        """One line for a person."""
        if not self.lanes:
            return "chaotic: no lane, so that there is nothing to outlast"
        share = 100.0 * self.outlasting / self.lanes
        return (
            f"chaotic: {share:.0f} % of lanes outlast {self.records} records ({self.lanes} tried)"
        )


def survival(
    config: Configuration, result: Result, records: int, threads: int | None = None
) -> Survival:
    """Try how many chaotic lanes outlast so many records of their own length.

    A lane outlasts them if a disturbance still grows over the later half of the last one, at the
    pace of `CHAOTIC_GROWTH` over a record. ``config`` is from `computable`; the result, which it
    computed, has one axis.
    """
    chaotic = np.flatnonzero(labelled_lanes(result).labels == "chaotic")
    if not chaotic.size:
        return Survival(records, 0, 0)
    chosen = np.linspace(0, chaotic.size - 1, min(MOST_LANES, chaotic.size))
    lanes = chaotic[chosen.round().astype(np.intp)]
    values = {config.sweep.parameter: result[result.axis][lanes]}
    choose_threads(threads)
    system = system_of(config, values, config.needed_effects)
    plan = plan_of(config, transient_periods=0, tangent=True)
    state, tangent = result["end_state"][lanes], None
    for _ in range(records):
        check()
        outcome = integrate(system, state, plan, tangent_start=tangent)
        state, tangent = outcome.end_state, outcome.end_tangent
    assert outcome.growth is not None
    later = outcome.growth[:, plan.recorded_periods // 2 :]
    exponent, _ = largest_exponent(later, np.ones(lanes.size))
    growing = exponent * plan.recorded_periods > CHAOTIC_GROWTH
    return Survival(records, lanes.size, int(np.sum(growing & (outcome.status == Status.OK))))
