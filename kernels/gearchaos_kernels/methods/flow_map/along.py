"""The gap of an element along a step, from the flow maps of the step."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import evaluator
from gearchaos_kernels.memory.block_memory import aligned_memory, fill_lane
from gearchaos_kernels.memory.rows import rows
from gearchaos_kernels.methods.flow_map.layout import TERMS, Layout, layout, layout_of
from gearchaos_kernels.methods.flow_map.making import make_tables
from gearchaos_kernels.methods.flow_map.store import maps_of, sharing
from gearchaos_kernels.models.interfaces import half_clearances, inputs_of, mean_gaps
from gearchaos_kernels.plan import Floats, Plan
from gearchaos_kernels.scene import Scene


def gap_terms(
    system: Any,
    plan: Plan,
    scene: Scene,
    states: Floats,
    flanks: NDArray[np.uint8],
    at: tuple[NDArray[np.intp], int],
) -> Floats:
    """Return the gap of an element over one step of each lane, (lanes, TERMS), without its mean.

    ``states`` (lanes, states) and ``flanks`` (lanes, elements) at the beginning of the step;
    ``at``: number of the step (lanes,), and the element. NaN where the maps have other steps than
    the plan.
    """
    place, steps = layout_of(scene), plan.steps_per_period
    samples, element = at
    step = system.mesh_period / steps
    given = np.zeros((system.lanes, place.inputs + 2 * place.elements))
    _inputs_of(system.coefficients(step), given, scene)
    inputs, means, clearances = np.split(
        given, [place.inputs, place.inputs + place.elements], axis=1
    )
    engaged = flanks != 0
    side = np.where(flanks == 2, -1.0, 1.0)
    offsets = engaged * (side * clearances + means)
    scaled = states / system.scales(step)
    factors = np.concatenate([scaled, inputs[:, :1], offsets, inputs[:, 1:]], axis=1)
    sets = ((~engaged) << np.arange(place.elements)).sum(axis=1)
    found = np.full((system.lanes, TERMS), np.nan)
    for lane, piece in enumerate(_pieces(system, plan, scene, sets, samples % steps)):
        first = place.gap + element * place.columns * TERMS
        if piece is not None:
            maps = piece[first : first + place.columns * TERMS].reshape(place.columns, TERMS)
            found[lane] = factors[lane] @ maps
    return found


def _pieces(
    system: Any,
    plan: Plan,
    scene: Scene,
    sets: NDArray[np.intp],
    numbers: NDArray[np.intp],
) -> list[Floats | None]:
    """Return the maps of a step and a set of branches of each lane, None for other steps."""
    place, steps = layout_of(scene), plan.steps_per_period
    if place.on_demand:
        tables, converged, _ = make_tables(system, sets[:, np.newaxis], steps, scene)
        begin = place.header
        return [
            table[number, begin:] if good else None
            for table, number, good in zip(tables, numbers, converged, strict=True)
        ]
    group = sharing(system)
    _, first = np.unique(group, return_index=True)
    found: list[Floats | None] = []
    of_group, done = {}, 0
    while done < first.size:
        some = system.of(first[done:])
        maps, places = maps_of(some, steps, scene, plan.map_bytes, plan.interpolated)
        for lane, place_of in zip(first[done:], places.T, strict=False):
            of_group[group[lane]] = maps, place_of
        done += places.shape[1]
    for lane, number in enumerate(numbers):
        maps, (made, begin) = of_group[group[lane]]
        found.append(_piece(maps, begin, number, sets[lane], place) if made == steps else None)
    return found


def _piece(maps: Floats, begin: int, number: int, chosen: int, place: Layout) -> Floats:
    """Return the maps of one step and one set of branches within a table."""
    first = begin + number * place.step_size + place.header + chosen * place.size
    return maps[first : first + place.size]


@evaluator
def _inputs_of(coefficients, given, scene):
    """Write inputs, constant parts of the gaps and half clearances of every lane."""
    memory = aligned_memory(rows(scene).total)
    place = layout(scene)
    for index in range(given.shape[0]):
        lane = fill_lane(memory, 0, coefficients[index], scene)
        inputs, means = inputs_of(lane, scene), mean_gaps(lane, scene)
        for number in range(place.inputs):
            given[index, number] = inputs[number]
        clearances = half_clearances(lane, scene)
        for element in range(place.elements):
            given[index, place.inputs + element] = means[element]
            given[index, place.inputs + place.elements + element] = clearances[element]
