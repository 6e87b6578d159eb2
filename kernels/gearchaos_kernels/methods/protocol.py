"""The interface of integration methods: their preparations, and how lanes take a step."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.memory.rows import LANES
from gearchaos_kernels.plan import Floats, Plan
from gearchaos_kernels.scene import Interface, Scene

Integers = NDArray[np.intp]


class Share(NamedTuple):
    """Lanes that one call of the compiled driver integrates.

    Attributes
    ----------
    order : array of int, shape (lanes of the share,)
        Numbers of the lanes, block after block.
    blocks : array of int, shape (blocks, 4 or more)
        For each block: the place of its first lane in ``order``, its number of lanes, its steps per
        mesh period, and the place where its maps begin in ``maps``. Then what `StepInputs.sets`
        holds.
    maps : array, shape (numbers,)
        What the method has prepared for these lanes; empty if nothing.
    steps : array of int, shape (lanes,)
        Steps per mesh period of every lane, including those of other shares.
    lacked : array of int, shape (lanes of the share,) or (0,)
        In the order of ``order``. A lane that needs maps of a set of branches that has none writes
        the number of the set here, and its block stops; all others keep -1. The method yields
        stopped blocks again in a later share.
    progress : array, shape (blocks, numbers) or (0, 0)
        The mesh period in which a block begins, and its memory then. Blocks write it at the
        beginning of every period. Those with 0 begin at tau = 0.
    """

    order: Integers
    blocks: Integers
    maps: Floats
    steps: Integers
    lacked: Integers = np.zeros(0, dtype=np.intp)
    progress: Floats = np.zeros((0, 0))


@dataclass(frozen=True)
class Method:
    """One method of integration. Entries from `maps_per_step` on are compiled functions.

    Attributes
    ----------
    name : str
        Name of the method in plans and configurations.
    flags : type
        Frozen dataclass without fields that identifies the method in a scene.
    always_resolved : bool
        Whether the method resolves every crossing, also where the plan has plain steps.
    traces : bool
        Whether the method follows forces and observed signals along every step by itself, and
        accumulates them in the rows `recorders.loads.accumulated_of`.
    refuses : callable
        ``refuses(system)``: why the method cannot integrate a system, or an empty text.
    stops : callable
        ``stops(scene)``: whether blocks stop where lanes lack maps, see `Share.lacked`.
    rows : callable
        ``rows(scene)``: rows of a block that the method uses for itself.
    prepare : callable
        ``prepare(system, plan, scene, periods)`` yields every `Share` in which lanes are
        integrated; ``periods`` (lanes,): their recorded periods. It raises ValueError if the method
        cannot integrate the system.
    memory : callable
        ``memory(system, plan, scene, stable)``: estimated bytes of what is prepared; ``stable``
        (lanes,): steps per period with which the default method is stable.
    sharing : callable
        ``sharing(system)``: numbers of groups, shape (lanes,). Lanes of a group share what is
        prepared, and take least time next to each other.
    work : callable
        ``work(system, plan, stable)``: estimated time of the integration, in the time that
        the default method takes for one step of one lane; ``stable`` as above.
    amplification : callable
        ``amplification(z)``: factor by which one step multiplies the modulus of a mode; z: step
        length times eigenvalue.
    stable_reach : callable or None
        ``stable_reach(angles)``: length of the longest stable z on rays from 0 at these angles,
        between pi/2 and pi; None if every step is stable.
    is_kept : callable
        ``is_kept(system, plan, scene)``: whether all that is prepared stays in memory between
        calls.
    gap_terms : callable or None
        ``gap_terms(system, plan, scene, states, flanks, at)``: the gap of an element within a step
        as a polynomial; None for the cubic through value and rate at both ends. See
        `gaps.gap_polynomials`.
    maps_per_step(scene)
        Returns how many numbers are prepared for one step.
    room(scene)
        Returns the fewest rows that the memory of a block must have.
    workspace(memory, scene)
        Returns what one block needs besides its memory. It may use the slots between ``LANES`` and
        ``STRIDE`` of every row.
    begin_lane(memory, slot, index, lane, given, scene)
        Prepares a lane before its first step; ``index``: its number among all lanes.
    change_input(memory, slot, lane, scene)
        Prepares a lane whose steady input a controller has changed.
    step(memory, lanes, at, given, scene)
        Takes one step in every slot; returns how many lanes may have left a contact branch.
        ``lanes``: number of lanes of the block; ``at``: the `StepAt`; ``given``: the `StepInputs`.
    resolve(memory, lanes, at, given, scene)
        Repeats the step of the lanes that may have left a branch, from crossing to crossing.
    grids(clock, given, scene)
        Returns what all lanes share at the beginning, in the middle and at the end of a step.
    """

    name: str
    flags: Any
    always_resolved: bool
    traces: bool
    refuses: Callable[[Any], str]
    stops: Callable[[Scene], bool]
    rows: Callable[[Scene], int]
    prepare: Callable[[Any, Plan, Scene, Integers], Iterator[Share]]
    memory: Callable[[Any, Plan, Scene, NDArray[np.int64]], int]
    sharing: Callable[[Any], Integers]
    work: Callable[[Any, Plan, NDArray[np.int64]], float]
    amplification: Callable[[NDArray[np.complex128]], Floats]
    stable_reach: Callable[[Floats], Floats] | None
    is_kept: Callable[[Any, Plan, Scene], bool]
    gap_terms: Callable[..., Floats] | None
    maps_per_step: Any
    room: Any
    workspace: Any
    begin_lane: Any
    change_input: Any
    step: Any
    resolve: Any
    grids: Any

    def function(self, name: str, _scene: Any) -> Any:
        """Return a compiled function by its name."""
        return getattr(self, name)


class StepAt(NamedTuple):
    """A step of a block.

    Attributes
    ----------
    number : int
        Number of the step within its mesh period.
    maps_at : int
        Where the maps of the step begin.
    recorded : bool
        Whether the step belongs to the recorded periods.
    """

    number: int
    maps_at: int
    recorded: bool


class StepInputs(NamedTuple):
    """The inputs of the steps of a block.

    Attributes
    ----------
    tables
        See `LaneSystem.tables`.
    maps : array
        See `Share`.
    work
        What `Method.workspace` returns.
    sets : array of int
        Number of each set of branches that has maps, followed by where they begin, relative to the
        first ones of the block.
    lacked : array of int
        The part of `Share.lacked` for the lanes of the block.
    """

    tables: Any
    maps: Any
    work: Any
    sets: Any
    lacked: Any


room = Interface("method", "room")
workspace = Interface("method", "workspace")
begin_lane = Interface("method", "begin_lane")
change_input = Interface("method", "change_input")
maps_per_step = Interface("method", "maps_per_step")
take_step = Interface("method", "step")
resolve = Interface("method", "resolve")
grids_of = Interface("method", "grids")


def cut(counts: Integers, steps: Integers, maps_at: Integers, size: int = LANES) -> Integers:
    """Cut groups of lanes into blocks, shape (blocks, 4); see `Share`.

    ``counts``: lanes of each group; ``steps``: its steps per period; ``maps_at``: where its maps
    begin; ``size``: lanes of a block.
    """
    first = np.cumsum(counts) - counts
    blocks = [
        (begin + at, min(size, count - at), number, place)
        for begin, count, number, place in zip(first, counts, steps, maps_at, strict=True)
        for at in range(0, count, size)
    ]
    return np.array(blocks, dtype=np.intp).reshape(-1, 4)


def with_periods(share: Share, periods: Integers, together: int = 1) -> Share:
    """Return a share whose blocks also have their recorded periods, in their fifth column.

    ``periods``: recorded periods of every lane of the batch, (lanes,). Lanes of a block then have
    equally many. ``together``: number of lanes that are not divided among blocks. Blocks that can
    continue already fulfil both, and keep their lanes.
    """
    if share.progress.size or (together == 1 and (periods == periods[:1]).all()):
        blocks = np.empty((len(share.blocks), share.blocks.shape[1] + 1), dtype=np.intp)
        blocks[:, :4], blocks[:, 5:] = share.blocks[:, :4], share.blocks[:, 4:]
        blocks[:, 4] = periods[share.order[share.blocks[:, 0]]]
        return share._replace(blocks=blocks)
    steps, maps_at = np.repeat(share.blocks[:, 2:], share.blocks[:, 1], axis=0).T
    own = periods[share.order]
    sorting = np.lexsort((own, maps_at))
    steps, maps_at, own = steps[sorting], maps_at[sorting], own[sorting]
    begins = np.flatnonzero(np.diff(own, prepend=-1) | np.diff(maps_at, prepend=-1))
    counts = np.diff(begins, append=own.size)
    size = whole_groups(together)
    blocks = cut(counts, steps[begins], maps_at[begins], size)
    length = np.repeat(own[begins], -(-counts // size))
    return share._replace(order=share.order[sorting], blocks=np.column_stack([blocks, length]))


def whole_groups(together: int) -> int:
    """Return the lanes of a full block; ``together``: number of lanes that are not divided."""
    return LANES // together * together
