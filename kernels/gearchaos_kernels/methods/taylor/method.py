"""Taylor series as a method: exact pieces of motions, for systems with many elements.

Flow maps of such systems are large, and lanes with different stiffness or speed share none. A
series costs about as much as the steps of RK4 over the same time that are needed for a rough
result, and it needs no preparation. Every lane of a vector moves by pieces of its own: a piece ends
at a crossing, at the end of the step, or where its series would converge no more.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import slots_of, state_of, store, write_state
from gearchaos_kernels.memory.rows import STRIDE, VECTOR, rows
from gearchaos_kernels.methods.protocol import Integers, Method, Share, cut
from gearchaos_kernels.methods.substeps import grids, multiple_of
from gearchaos_kernels.methods.taylor import vectors
from gearchaos_kernels.methods.taylor.along import gap_terms
from gearchaos_kernels.methods.taylor.crossings import count_suspects, cross, find_crossings
from gearchaos_kernels.methods.taylor.expansion import expand
from gearchaos_kernels.methods.taylor.layout import REACH, rows_needed, series_rows
from gearchaos_kernels.models.interfaces import grid_within
from gearchaos_kernels.plan import Floats, Plan
from gearchaos_kernels.scene import Scene, implement

MOST_PIECES = 2**16
"""Most pieces of a mesh period: a lane that needs more is stopped as too fast."""

PIECE = 15.0
"""Time of a piece of one lane, in the time of one of its RK4 steps: machines of 2 to 17 coordinates
have 10 to 22."""


@dataclass(frozen=True)
class Taylor:
    """Identifies Taylor series in a scene; they have no flags."""


def steps_of(plan: Plan) -> int:
    """Return the steps per period: more than those of the plan if recorders read their ends."""
    return multiple_of(plan.steps_per_period, plan.records_steps or plan.loads)


def reach_of(system: Any) -> Floats:
    """Return the longest piece of each lane in mesh periods, at most 1; NaN if it is too short."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        reach = np.minimum(REACH / (system.fastest_rates() * system.mesh_period), 1.0)
    return np.where(reach * MOST_PIECES >= 1.0, reach, np.nan)


def prepare(system: Any, plan: Plan, _scene: Scene, _periods: Integers) -> Iterator[Share]:
    """Yield all lanes as one share, those that are too fast apart from all others.

    The numbers of a lane are its reach in steps, the mesh phase of a step, and the steps per step
    of the plan.
    """
    if refusal := system.refuses_series():
        raise ValueError(refusal)
    lanes, steps = system.lanes, steps_of(plan)
    numbers = np.empty((lanes, 3))
    numbers[:, 0] = reach_of(system) * steps
    numbers[:, 1] = 2.0 * np.pi / steps
    numbers[:, 2] = steps // plan.steps_per_period
    lost = np.isnan(numbers[:, 0])
    order = np.argsort(lost, kind="stable")
    counts = np.array([lanes - lost.sum(), lost.sum()])
    some = counts > 0 if lanes else np.array([True, False])
    # A block whose first number is not a number is reported as too fast.
    first = 3 * order[np.minimum([0, counts[0]], max(lanes - 1, 0))] if lanes else np.zeros(2, int)
    blocks = cut(counts[some], np.full(some.sum(), steps), first[some])
    yield Share(order, blocks, numbers.reshape(-1), np.full(lanes, steps))


def work(system: Any, plan: Plan, _stable: NDArray[np.int64]) -> float:
    """Estimate the time of an integration in RK4 steps of one lane."""
    periods = plan.transient_periods + plan.recorded_periods
    pieces = np.maximum(np.nan_to_num(1.0 / reach_of(system), nan=MOST_PIECES), steps_of(plan))
    return float(PIECE * periods * pieces.sum())


@scalar
def maps_per_step(scene):
    """Return 0: nothing is prepared for a step."""
    return 0


@scalar
def room(scene):
    """Return 0: a block has the rows of its scene."""
    return 0


@scalar
def workspace(memory, scene):
    """Return nothing: the series are rows of the block."""
    return


@scalar
def begin_lane(memory, slot, index, lane, given, scene):
    """Store what the pieces of a lane depend on."""
    at = series_rows(scene)
    numbers = given.maps[3 * index : 3 * index + 3]
    store(memory, at.reach, slot, (numbers[0], numbers[1], numbers[2]))
    memory[at.crossings * STRIDE + slot] = 0.0


@scalar
def change_input(memory, slot, lane, scene):
    """Prepare nothing: a piece reads the input among the coefficients of its lane."""


@scalar
def step(memory, lanes, at, given, scene):
    """Take one step in every slot, piece by piece; return 0, because no crossing is left."""
    for first in range(0, slots_of(lanes), VECTOR):
        begin_step(memory, first, at.number, given, scene)
        left = VECTOR
        while left > 0:
            expand(memory, first, scene)
            begin_piece(memory, first, scene)
            if scene.resolved is not None:
                vectors.find_ends(memory, first, scene)
                if count_suspects(memory, first, lanes, scene) > 0:
                    find_crossings(memory, first, lanes, scene)
            vectors.advance(memory, first, scene)
            vectors.turn(memory, first, scene)
            left = end_piece(memory, first, at, scene)
    return 0


@scalar
def begin_step(memory, first, number, given, scene):
    """Begin the first piece of a step in the eight slots from ``first`` on."""
    at = series_rows(scene)
    substeps = int(memory[at.substeps * STRIDE + first])
    fraction = (number % substeps) / substeps
    point = grid_within(given.tables, number // substeps, fraction, scene)
    for slot in range(first, first + VECTOR):
        store(memory, at.waves, slot, point)
        memory[at.done * STRIDE + slot] = 0.0
        if scene.before is not None:
            state = state_of(memory, slot, scene)
            write_state(memory, rows(scene).state_before, slot, state, scene)


@scalar
def begin_piece(memory, first, scene):
    """Choose the length of the next piece of eight lanes, without crossings."""
    at = series_rows(scene)
    for slot in range(first, first + VECTOR):
        rest = 1.0 - memory[at.done * STRIDE + slot]
        reach = memory[at.reach * STRIDE + slot]
        memory[at.length * STRIDE + slot] = rest if rest < reach else reach
        memory[at.crossing * STRIDE + slot] = -1.0


@scalar
def end_piece(memory, first, at_step, scene):
    """End a piece of eight lanes; return how many of them are not yet at the end of the step."""
    at, left = series_rows(scene), 0
    for slot in range(first, first + VECTOR):
        rest = 1.0 - memory[at.done * STRIDE + slot]
        length = memory[at.length * STRIDE + slot]
        memory[at.done * STRIDE + slot] += length
        if scene.resolved is not None:
            if memory[at.crossing * STRIDE + slot] != -1.0:
                cross(memory, slot, at_step, scene)
            elif length > 0.0:
                memory[at.crossings * STRIDE + slot] = 0.0
        # The sum of all pieces is rounded.
        ended = not length < rest
        if ended:
            memory[at.done * STRIDE + slot] = 1.0
        left += 0 if ended else 1
    return left


@scalar
def resolve(memory, lanes, at, given, scene):
    """Do nothing: steps resolve their crossings."""


TAYLOR = Method(
    name="taylor",
    flags=Taylor,
    always_resolved=True,
    traces=False,
    refuses=lambda system: str(system.refuses_series()),
    stops=lambda _scene: False,
    rows=rows_needed,
    prepare=prepare,
    memory=lambda system, _plan, _scene, _stable: 3 * 8 * int(system.lanes),
    sharing=lambda system: np.zeros(system.lanes, dtype=np.intp),
    work=work,
    # A series is the exponential itself, up to rounding.
    amplification=lambda z: np.exp(z.real),
    stable_reach=None,
    is_kept=lambda _system, _plan, _scene: True,
    gap_terms=gap_terms,
    maps_per_step=maps_per_step,
    room=room,
    workspace=workspace,
    begin_lane=begin_lane,
    change_input=change_input,
    step=step,
    resolve=resolve,
    grids=grids,
)

implement(Taylor, TAYLOR)
