"""The batch driver: splits lanes into blocks, runs them side by side, returns arrays."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numba import get_num_threads, prange
from numpy.typing import NDArray

from gearchaos_kernels.block import Batch, integrate_block
from gearchaos_kernels.block_memory import Present, flags
from gearchaos_kernels.coefficients import lane_coefficients, state_scales, steps_between_scalings
from gearchaos_kernels.compilation import count_up, driver
from gearchaos_kernels.flow_map import fewest_steps, maps_of, sharing
from gearchaos_kernels.rows import CONTACT_ROWS, ERROR, LANES, SIGNAL_ROWS, SIGNALS
from gearchaos_kernels.system import Floats, Outcome, Plan, Schedule, Status, System
from gearchaos_kernels.teeth import last_pair, tables_of

Integers = NDArray[np.intp]


@driver
def _integrate_blocks(threads, taken, batch, plan, outcome, present):
    # Every thread takes the next block when it has done one: some blocks cross boundaries far more
    # often than others, and another program may be using a core. The number of threads is told, as
    # code that asks for it has an address of this process in it, and cannot be kept.
    for _ in prange(threads):
        number = count_up(taken)
        while number < batch.blocks.shape[0]:
            integrate_block(number, batch, plan, outcome, present)
            number = count_up(taken)


def integrate(
    system: System, start: Floats, plan: Plan, *, tangent_start: Floats | None = None
) -> Outcome:
    """Integrate a batch of lanes from tau = 0, by RK4 or by flow maps.

    ``start`` (lanes, states): those of eq. 13 at tau = 0; ``plan``: steps, periods and what is
    kept; ``tangent_start`` (lanes, states): tangent vectors at tau = 0, by default an equal share
    of every state. The outcome is identical bit for bit for any number of threads, any split and
    any order of the lanes. Raises ValueError if flow maps are asked for with pitch errors tooth by
    tooth, or too many pairs are in mesh.
    """
    lanes, states = start.shape[0], len(system.states)
    steps = plan.steps_per_period
    if tangent_start is None:
        tangent_start = np.full((lanes, states), 1.0 / np.sqrt(states))
    present, kept = flags(system, plan), plan.history_periods
    outcome = Outcome(
        # Written by the threads to the last number: here it would take as long as many a period.
        section=np.empty((lanes, plan.section_points, states)),
        growth=np.empty((lanes, plan.recorded_periods if plan.tangent else 0)),
        end_state=np.empty((lanes, states)),
        end_tangent=np.empty((lanes, states)),
        status=np.full(lanes, Status.OK, dtype=np.uint8),
        diverged_period=np.full(lanes, -1, dtype=np.int32),
        crossings=np.zeros(lanes, dtype=np.int64),
        slowest_crossing=np.full(lanes, np.inf),
        overflows=np.zeros(lanes, dtype=np.int64),
        contact=np.zeros((lanes, 2 * CONTACT_ROWS if plan.contact else 0)),
        loads=np.full((lanes, SIGNALS if present.loads else 0, SIGNAL_ROWS), np.nan),
        extremes=np.full((lanes, len(plan.states), 2), np.nan),
        amplitudes=np.full((lanes, (len(plan.states) + 1) * len(plan.orders)), np.nan),
        history=np.empty((lanes, kept and kept * steps + 1, states)),
    )
    if present.flow_map is not None and present.teeth is not None:
        raise ValueError("flow maps know pitch errors that are a sine, not those of teeth")
    columns = [system.states.index(name) for name in plan.states]
    cycles = 2.0 * np.pi * np.array([float(order) for order in plan.orders])
    steps_taken = np.full(lanes, steps)
    schedule = Schedule(*(getattr(plan, name) for name in Schedule._fields))
    # A pair that begins before its mesh period does is the last one of the period before.
    schedule = schedule._replace(first_period=last_pair(system, plan.first_period))
    for order, blocks, maps, steps_of in _shares(system, plan, present):
        step = system.mesh_period / steps_of
        steps_taken[order] = steps_of[order]
        phases = cycles / steps_of[:, np.newaxis]
        turns = np.stack([np.cos(phases), np.sin(phases)], axis=2)
        batch = Batch(
            lane_coefficients(system, step),
            state_scales(system, step),
            np.ascontiguousarray(start, dtype=np.float64),
            np.ascontiguousarray(tangent_start, dtype=np.float64),
            steps_between_scalings(system, steps_of),
            order,
            blocks,
            maps,
            np.array([*columns, ERROR], dtype=np.intp),
            turns,
            *tables_of(system, present, steps),
        )
        taken = np.zeros(1, dtype=np.intp)
        _integrate_blocks(get_num_threads(), taken, batch, schedule, outcome, present)
        if maps.size:
            unmapped = np.repeat(np.isnan(maps[blocks[:, 3]]), blocks[:, 1])
            outcome.status[order[unmapped]] = Status.TOO_FAST
    sums = outcome.amplitudes.reshape(lanes, len(columns) + 1, len(plan.orders))
    if not present.loads:
        return outcome._replace(amplitudes=sums)
    step = system.mesh_period / steps_taken
    samples = (steps_taken * max(1, plan.recorded_periods))[:, np.newaxis, np.newaxis]
    # Forces come per step squared, and the sums of Simpson's rule.
    outcome.loads[:, :, 2:] /= 6.0 * samples
    outcome.loads[:, :2] /= step[:, np.newaxis, np.newaxis] ** 2
    outcome.loads[:, :2, 3] /= step[:, np.newaxis] ** 2
    scales = np.pad(state_scales(system, step)[:, columns], ((0, 0), (0, 1)), constant_values=1.0)
    scales = scales[..., np.newaxis]
    return outcome._replace(
        # A scaled state may have the other sign.
        extremes=np.sort(outcome.extremes * scales[:, :-1], axis=2),
        amplitudes=np.abs(scales) * sums * (2.0 / samples),
    )


def _shares(system: System, plan: Plan, present: Present) -> Iterator[tuple[Any, Any, Any, Any]]:
    """Yield order, blocks, maps and steps of lanes, as many as have maps that fit into memory."""
    lanes, steps = system.lanes, plan.steps_per_period
    if plan.method == "rk4":
        blocks = _blocks(np.array([lanes]), np.array([steps]), np.array([0]))
        yield np.arange(lanes), blocks, np.zeros(0), np.full(lanes, steps)
        return
    steps, group = fewest_steps(plan), sharing(system)
    every = np.argsort(group, kind="stable")
    _, first, counts = np.unique(group[every], return_index=True, return_counts=True)
    done = 0
    while done < first.size:
        maps, places = maps_of(system.of(every[first[done:]]), steps, present, plan.map_bytes)
        lanes_of = counts[done : done + places.shape[1]]
        order = every[first[done] : first[done] + lanes_of.sum()]
        steps_of = np.full(lanes, steps)
        steps_of[order] = np.repeat(places[0], lanes_of)
        yield order, _blocks(lanes_of, *places), maps, steps_of
        done += lanes_of.size


def _blocks(lanes: Integers, steps: Integers, maps_at: Integers) -> Integers:
    """Cut each group of so many lanes into blocks: first, lanes, steps, place of the maps."""
    first = np.cumsum(lanes) - lanes
    blocks = [
        (begin + at, min(LANES, count - at), number, place)
        for begin, count, number, place in zip(first, lanes, steps, maps_at, strict=True)
        for at in range(0, count, LANES)
    ]
    return np.array(blocks, dtype=np.intp).reshape(-1, 4)
