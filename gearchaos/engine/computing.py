"""The integration of the lanes of a run, block by block."""

from typing import Any

import gearchaos_kernels as kernels
import numpy as np

from gearchaos.arrays import Floats, Integers
from gearchaos.configuration.methods import METHODS
from gearchaos.dynamics.labelling import LONGER_RECORD_BYTES, LONGER_RECORDS
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.kept import arrays_of
from gearchaos.engine.run_plan import RunPlan
from gearchaos.interrupts import check

Bounds = tuple[int, int]
"""Number of the first lane of a block, and of the lane after its last, in computing order."""


BLOCK_PERIODS = 256
"""Mesh periods below which a block has more lanes, so that preparing it takes a small share."""


class EndStates:
    """The end states of the lanes of a carried sweep, in the order of computation.

    Lanes that are not computed yet have NaN. For other sweeps nothing is stored.
    """

    def __init__(self, run: RunPlan) -> None:
        lanes = len(run.lanes) if run.carried else 0
        self._ends = np.full((lanes, len(run.lanes.states)), np.nan)
        self._side_by_side = run.lanes.side_by_side

    def before(self, first: int) -> Floats:
        """Return the end states from which the lanes from ``first`` on start, (lanes, states)."""
        return self._ends[max(0, first - self._side_by_side) : first]

    def keep(self, first: int, ends: Floats) -> None:
        """Store the end states (lanes, states) of the lanes from ``first`` on."""
        if self._ends.size:
            self._ends[first : first + len(ends)] = ends


def rehearse(run: RunPlan, periods: int = 0) -> None:
    """Integrate the first lane over some mesh periods, keeping every step.

    This compiles the kernel of the scene, or loads it from the cache.
    """
    plan = run.plan._replace(transient_periods=0, section_points=0)
    plan = plan._replace(recorded_periods=periods, history_periods=periods)
    first = np.arange(1)
    kernels.integrate(run.lanes.system_of(first), run.lanes.start_of(first), plan)


def block_memory(run: RunPlan, threads: int) -> int:
    """Return the approximate size in bytes of the arrays of one block during computation."""
    states, lanes = len(run.lanes.states), min(len(run.lanes), block_lanes(run, threads))
    numbers, looked = (run.recording.section_points + 4) * states, 0
    if run.plan.tangent:
        numbers += run.plan.recorded_periods
        if run.config.outputs.motion:
            # Doubtful lanes are integrated again, in portions of at least one lane.
            longest = 8 * numbers * LONGER_RECORDS[-1]
            looked = max(8 * numbers * lanes, longest, min(longest * lanes, LONGER_RECORD_BYTES))
    if run.config.control is not None:
        numbers += run.plan.transient_periods + run.plan.recorded_periods
    if run.config.outputs.exponents:
        numbers += run.plan.recorded_periods * states
    return 8 * lanes * numbers + looked + _maps_memory(run, lanes)


def _maps_memory(run: RunPlan, lanes: int) -> int:
    """Return the approximate size in bytes of the maps of a block of lanes, 0 without maps."""
    if not METHODS[run.plan.method].shares_maps:
        return 0
    every = len(run.lanes)
    blocks = np.arange(lanes), np.arange(every - lanes, every)
    systems = [run.lanes.system_of(block) for block in blocks]
    return max(
        kernels.maps_memory(system, run.plan, fewest_stable_steps(system)) for system in systems
    )


def block_lanes(run: RunPlan, threads: int) -> int:
    """Return the lanes of a block: enough for every thread, few enough to show progress."""
    periods = run.plan.transient_periods + run.plan.recorded_periods
    lanes = kernels.LANES * max(8, 2 * threads) * max(1, BLOCK_PERIODS // max(1, periods))
    # A block with the remainder of the lanes side by side would not fill a vector.
    return lanes - lanes % min(lanes, run.lanes.side_by_side)


def blocks(run: RunPlan, size: int) -> list[Bounds]:
    """Cut a run into blocks of ``size`` lanes, in the order of computation."""
    lanes = len(run.lanes)
    return [(n, min(n + size, lanes)) for n in range(0, lanes, size)]


def compute_block(run: RunPlan, block: Bounds, before: Floats) -> dict[str, Any]:
    """Compute a block of lanes.

    Parameters
    ----------
    run : RunPlan
        The run, with chosen steps.
    block : tuple of int
        Bounds of the block, see `Bounds`.
    before : array, shape (lanes, states)
        End states from which a carried sweep starts, see `EndStates.before`.

    Returns
    -------
    dict of str to array, shape (lanes, ...)
        All variables by name.
    """
    places = np.arange(*block)
    start, outcome = integrate_places(run, places, run.recording, before)
    return arrays_of(run, run.lanes.computed_at(places), start, outcome)


def integrate_places(
    run: RunPlan, places: Integers, plan: kernels.Plan, before: Floats | None = None
) -> tuple[Floats, kernels.Outcome]:
    """Integrate some lanes of a run with a plan.

    Parameters
    ----------
    run : RunPlan
        The run.
    places : array of int, shape (lanes,)
        Numbers of the lanes in the order of computation; consecutive in a carried sweep.
    plan : gearchaos_kernels.Plan
        Plan of the integration.
    before : array, shape (lanes, states), optional
        As in `compute_block`; without it a carried sweep starts from the configured start.

    Returns
    -------
    start : array, shape (lanes, states)
        Start states.
    outcome : gearchaos_kernels.Outcome
        Outcome of all lanes.
    """
    check()
    many, starts, outcomes = run.lanes.side_by_side, [], []
    earlier = np.zeros((0, len(run.lanes.states))) if before is None else before
    if run.carried:
        missing = np.full((many - len(earlier), len(run.lanes.states)), np.nan)
        earlier = np.concatenate([missing, earlier])
    # A carried sweep integrates few lanes at once. Preparing all of them here takes less time.
    lanes = run.lanes.computed_at(places)
    system = run.lanes.system_of(lanes)
    configured = run.lanes.start_of(lanes, system)
    for some in np.split(np.arange(places.size), range(many, places.size, many)):
        starts.append(configured[some])
        if run.carried:
            ends = earlier[: some.size]
            # A lane that diverged has no end state: its successor has the configured start.
            on = np.isfinite(ends).all(axis=1)
            starts[-1][on] = ends[on]
        own = system.of(some) if run.carried else system
        outcomes.append(kernels.integrate(own, starts[-1], plan))
        if run.carried:
            earlier = np.concatenate([earlier, outcomes[-1].end_state])[some.size :]
    if len(outcomes) == 1:
        return starts[0], outcomes[0]
    every: Any = map(np.concatenate, zip(*outcomes, strict=True))
    return np.concatenate(starts), kernels.Outcome(*every)
