"""Flow maps as a method: exact steps of piecewise-linear systems, with maps that lanes share."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearchaos_kernels.compilation import maker, scalar
from gearchaos_kernels.memory.block_memory import slots_of
from gearchaos_kernels.memory.rows import LANES
from gearchaos_kernels.methods.flow_map.along import gap_terms
from gearchaos_kernels.methods.flow_map.crossings import resolve
from gearchaos_kernels.methods.flow_map.layout import (
    Work,
    aside_rows,
    layout,
    layout_of,
    rows_needed,
)
from gearchaos_kernels.methods.flow_map.on_demand import shares_on_demand
from gearchaos_kernels.methods.flow_map.steps import begin_lane, change_input, move_block
from gearchaos_kernels.methods.flow_map.store import (
    fewest_steps,
    maps_are_kept,
    maps_memory,
    maps_of,
    sharing,
    work,
)
from gearchaos_kernels.methods.flow_map.tracing import trace_block
from gearchaos_kernels.methods.protocol import Integers, Method, Share, cut
from gearchaos_kernels.methods.substeps import grids
from gearchaos_kernels.plan import Plan
from gearchaos_kernels.scene import Scene, implement


@dataclass(frozen=True)
class FlowMap:
    """Identifies flow maps in a scene; they have no flags."""


def prepare(system: Any, plan: Plan, scene: Scene, periods: Integers) -> Iterator[Share]:
    """Yield shares of lanes, lanes with the same maps together, as many as have maps that fit."""
    refusal = system.refuses_maps()
    if refusal:
        raise ValueError(refusal)
    if layout_of(scene).on_demand:
        yield from shares_on_demand(system, plan, scene, periods)
        return
    lanes, steps, group = system.lanes, fewest_steps(plan), sharing(system)
    if group.any() or not lanes:
        in_groups = np.argsort(group, kind="stable")
        _, first, counts = np.unique(group[in_groups], return_index=True, return_counts=True)
    else:
        in_groups, first, counts = np.arange(lanes), np.zeros(1, np.intp), np.array([lanes])
    done = 0
    while done < first.size:
        some = system.of(in_groups[first[done:]])
        maps, places = maps_of(some, steps, scene, plan.map_bytes, plan.interpolated)
        lanes_of = counts[done : done + places.shape[1]]
        order = in_groups[first[done] : first[done] + lanes_of.sum()]
        steps_of = np.full(lanes, steps)
        steps_of[order] = np.repeat(places[0], lanes_of)
        yield Share(order, cut(lanes_of, *places), maps, steps_of)
        done += lanes_of.size


@scalar
def maps_per_step(scene):
    """Return the size of the maps of one step, in numbers."""
    return layout(scene).step_size


@scalar
def room(scene):
    """Return the number of rows of lanes that cross."""
    return aside_rows(scene).total


@maker
def workspace(memory, scene):
    """Return memory for lanes that cross, and for the only lane of a block."""
    # Next to the lanes of the block: memory of its own would not fit into the first-level cache.
    aside = memory[LANES:]
    for number in range(aside.shape[0]):
        aside[number] = 0.0
    return Work(aside, np.zeros(LANES, dtype=np.uint32), np.zeros(layout(scene).workspace))


@scalar
def step(memory, lanes, at, given, scene):
    """Take one step in every slot; return how many lanes may have left a contact branch."""
    # A single lane is faster along its state.
    slots = 1 if lanes == 1 else slots_of(lanes)
    suspects = move_block(memory, given.maps, at.maps_at, slots, given.work.numbers, scene)
    if scene.traced is not None:
        if at.recorded:
            trace_block(memory, slots, given.maps, at.maps_at, scene)
    return suspects


FLOW_MAP = Method(
    name="flow_map",
    flags=FlowMap,
    always_resolved=True,
    traces=True,
    refuses=lambda system: str(system.refuses_maps()),
    stops=lambda scene: bool(layout_of(scene).on_demand),
    rows=rows_needed,
    prepare=prepare,
    memory=maps_memory,
    sharing=sharing,
    work=work,
    # A map is the exponential itself.
    amplification=lambda z: np.exp(z.real),
    stable_reach=None,
    is_kept=maps_are_kept,
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

implement(FlowMap, FLOW_MAP)
