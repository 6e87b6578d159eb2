"""What a method of integration is: how lanes take a step, and what is prepared for that."""

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
    """Lanes that are integrated in one call of the compiled driver.

    Attributes
    ----------
    order : array of int, shape (lanes of the share,)
        Their numbers.
    blocks : array of int, shape (blocks, 4)
        Of each block the place of its first lane in ``order``, its number of lanes, its steps per
        period and where its maps begin.
    maps : array
        What the method has prepared for them; empty if nothing.
    steps : array of int, shape (lanes,)
        Steps per period of every lane, also of those of other shares.
    """

    order: Integers
    blocks: Integers
    maps: Floats
    steps: Integers


@dataclass(frozen=True)
class Method:
    """One method.

    Attributes
    ----------
    name : str
        As in configurations.
    flags : type
        Frozen dataclass without fields; stands for the method in a scene.
    always_resolved : bool
        Whether it resolves every crossing, whatever the plan says.
    rows : callable
        ``rows(scene)``: rows of a block that the method keeps for itself.
    prepare : callable
        ``prepare(system, plan, scene)`` yields the `Share` in which lanes are integrated. Raises
        ValueError if the method cannot integrate the system.
    memory : callable
        ``memory(system, plan, scene, stable)``: about how many bytes that takes; ``stable``
        (lanes,): steps per period with which RK4 is stable.
    amplification : callable
        ``amplification(z)``: by how much one step multiplies the size of a mode, z being step
        length times eigenvalue.
    stable_reach : callable or None
        ``stable_reach(angles)``: length of the longest stable z on rays from 0 at these angles,
        between pi/2 and pi; None if every step is stable.
    is_kept : callable
        ``is_kept(system, plan, scene)``: whether all of it stays in memory from call to call.
    maps_per_step(scene)
        Returns the numbers that are prepared for one step.
    workspace(scene)
        Returns what one block needs besides its memory.
    begin_lane(memory, slot, lane, scene)
        Prepares a lane before its first step.
    step(memory, lanes, at, given, scene)
        Takes one step in every slot; returns how many lanes may have left a branch. ``at``: the
        `StepAt`, ``given``: `Given`.
    resolve(memory, lanes, at, given, scene)
        Repeats the step of the lanes that may have left a branch, from crossing to crossing.
    grids(clock, given, scene)
        Returns what all lanes share at the beginning of the step, in its middle and at its end.
    """

    name: str
    flags: Any
    always_resolved: bool
    rows: Callable[[Scene], int]
    prepare: Callable[[Any, Plan, Scene], Iterator[Share]]
    memory: Callable[[Any, Plan, Scene, NDArray[np.int64]], int]
    amplification: Callable[[NDArray[np.complex128]], Floats]
    stable_reach: Callable[[Floats], Floats] | None
    is_kept: Callable[[Any, Plan, Scene], bool]
    maps_per_step: Any
    workspace: Any
    begin_lane: Any
    step: Any
    resolve: Any
    grids: Any

    def function(self, name: str, _scene: Any) -> Any:
        """Return a compiled function by its name."""
        return getattr(self, name)


class StepAt(NamedTuple):
    """A step: its number in the mesh period, where its maps begin, and if it is recorded."""

    number: int
    maps_at: int
    recorded: bool


class Given(NamedTuple):
    """What the steps of a block read: tables of the model, maps of the method, and workspace."""

    tables: Any
    maps: Any
    work: Any


workspace = Interface("method", "workspace")
begin_lane = Interface("method", "begin_lane")
maps_per_step = Interface("method", "maps_per_step")
take_step = Interface("method", "step")
resolve = Interface("method", "resolve")
grids_of = Interface("method", "grids")


def cut(lanes: Integers, steps: Integers, maps_at: Integers) -> Integers:
    """Cut groups of lanes into blocks, shape (blocks, 4); see `Share`.

    ``lanes``: the size of each group; ``steps``: its steps per period; ``maps_at``: where its maps
    begin.
    """
    first = np.cumsum(lanes) - lanes
    blocks = [
        (begin + at, min(LANES, count - at), number, place)
        for begin, count, number, place in zip(first, lanes, steps, maps_at, strict=True)
        for at in range(0, count, LANES)
    ]
    return np.array(blocks, dtype=np.intp).reshape(-1, 4)
