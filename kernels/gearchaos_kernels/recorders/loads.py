"""Forces of the elements and observed signals of the model, over the recorded periods.

For each signal, its extremes and the integrals of itself and of its square are recorded. A step
gives three values: at both ends, and in the middle, where the state is that of the cubic through
both ends. Integrals follow by Simpson's rule, extremes from the parabola through the three values.
If a contact begins or ends within a step, the force has a kink there. The parabola is then not
used. Instead the force at the kink, which is that of the damper alone, is a fourth value.

A method that follows the signals along its steps (``traced``) accumulates them by itself.

The rows are: the signals and the slopes of the forces at the end of the last step; then for each
signal its maximum, its minimum, and the sums over the steps of six times the mean of itself and of
its square.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.elements import pushes_of
from gearchaos_kernels.memory.block_memory import (
    load_like,
    read_lane,
    state_before,
    state_of,
    store,
)
from gearchaos_kernels.memory.rows import LANES, STRIDE, State, constants
from gearchaos_kernels.memory.tuples import along, each
from gearchaos_kernels.methods.protocol import grids_of
from gearchaos_kernels.models.interfaces import (
    elements_at,
    forcing_at,
    from_kept,
    gaps_at,
    grid_at,
    observed_at,
    point_at,
    unforced,
)
from gearchaos_kernels.recorders.protocol import Recorder
from gearchaos_kernels.scene import Scene, provider_of

SIGNAL_ROWS = 4
"""Number of rows of what is accumulated of one signal."""


def elements_of(scene: Scene) -> int:
    """Return the number of forces among the signals."""
    elements: int = provider_of(scene.model).elements(scene.model)
    return elements


def signals_of(scene: Scene) -> int:
    """Return the number of signals: the forces, then the observed signals of the model."""
    return elements_of(scene) + len(provider_of(scene.model).observed)


def rows(scene: Scene) -> int:
    """Return the number of rows of a scene."""
    return signals_of(scene) * (1 + SIGNAL_ROWS) + elements_of(scene)


def accumulated_of(scene: Scene) -> int:
    """Return the first row of what is accumulated of the first signal."""
    first: int = provider_of(scene.recorders).first_row("loads", scene)
    return first + signals_of(scene) + elements_of(scene)


class Offsets(NamedTuple):
    """Offsets from the first row of the recorder.

    Attributes
    ----------
    slopes : int
        Offset of the slopes of the forces; the signals come first.
    accumulated : int
        Offset of what is accumulated of every signal.
    """

    slopes: int
    accumulated: int


offsets = constants(
    lambda scene: Offsets(signals_of(scene), signals_of(scene) + elements_of(scene))
)
"""`Offsets` of a scene, as constants of compiled code."""


@intrinsic
def numbered(_typing_context: Any, values: Any) -> Any:
    """Return the tuple 0, 1, 2, ... of the same length as another tuple."""
    count = len(values)
    kind = types.UniTuple(types.intp, count)

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        numbers = [context.get_constant(types.intp, number) for number in range(count)]
        return context.make_tuple(builder, kind, numbers)

    return kind(values), generate


@scalar
def force_of(push):
    """Return the force of a push."""
    return push.force


@scalar
def slope_of(push):
    """Return the slope of a push."""
    return push.slope


@scalar
def signals_at(state, lane, point, forcing, scene):
    """Return all signals of a state, forces per step squared, and the slopes of the forces."""
    gaps = gaps_at(state, lane, forcing, scene)
    pushes = pushes_of(gaps, elements_at(lane, forcing, scene), None, scene)
    values = each(force_of, pushes) + observed_at(state, lane, point, scene)
    return values, each(slope_of, pushes)


@scalar
def begin(memory, first_row, block, clock, records, scene):
    """Start the record of every slot with its signals, when the recorded periods begin."""
    if clock.recorded == 0:
        for slot in range(LANES):
            lane = read_lane(memory, slot, scene)
            point = point_at(memory, slot, grid_at(records.steps.tables, 0, scene), scene)
            forcing = forcing_at(lane, point, scene)
            state = from_kept(state_of(memory, slot, scene), forcing, scene)
            values, slopes = signals_at(state, lane, point, forcing, scene)
            store(memory, first_row, slot, values + slopes)
            first = first_row + offsets(scene).accumulated
            each(begin_signal, memory, first, slot, numbered(values), values)


@scalar
def begin_signal(memory, first, slot, number, value):
    """Start the record of one signal."""
    store(memory, first + SIGNAL_ROWS * number, slot, (value, value, 0.0, 0.0))


@scalar
def step(memory, first_row, block, clock, records, scene):
    """Update the record of every slot after a step."""
    if scene.traced is None:
        sample_step(memory, first_row, clock, records, scene)


@scalar
def sample_step(memory, first_row, clock, records, scene):
    """Update the record of every slot from three values of a step."""
    if clock.recorded >= 0:
        start, middle, end = grids_of(clock, records.steps, scene)
        for slot in range(LANES):
            lane = read_lane(memory, slot, scene)
            forcing = forcing_at(lane, point_at(memory, slot, start, scene), scene)
            before = from_kept(state_before(memory, slot, scene), forcing, scene)
            last = point_at(memory, slot, end, scene)
            forcing = forcing_at(lane, last, scene)
            after = from_kept(state_of(memory, slot, scene), forcing, scene)
            values, slopes = signals_at(after, lane, last, forcing, scene)
            point = point_at(memory, slot, middle, scene)
            forcing = forcing_at(lane, point, scene)
            halves, _ = signals_at(halfway(before, after), lane, point, forcing, scene)
            firsts = load_like(memory, first_row, slot, values)
            slopes_before = load_like(memory, first_row + offsets(scene).slopes, slot, slopes)
            store(memory, first_row, slot, values + slopes)
            smooth = each(without_kink, slopes_before, slopes)
            smooth = smooth + each(always_smooth, observed_at(after, lane, last, scene))
            first, numbers = first_row + offsets(scene).accumulated, numbered(values)
            each(add_step, memory, first, slot, numbers, firsts, halves, values, smooth)


@scalar
def without_kink(before, after):
    """Return whether an element is in contact at both ends of a step, or at neither."""
    return (before == 0.0) == (after == 0.0)


@scalar
def always_smooth(_signal):
    """Return True: observed signals have no kinks."""
    return True


@scalar
def halfway(before, after):
    """Return the state in the middle of a step, on the cubic through both ends."""
    change = along(after.position, -1.0, before.position)
    straight = along(before.position, 0.5, change)
    rates = along(before.rate, 1.0, after.rate)
    return State(
        along(straight, 0.125, along(before.rate, -1.0, after.rate)),
        along(along(change, 0.5, change), -0.25, rates),
    )


@scalar
def add_step(memory, first_row, slot, number, first, half, last, smooth):
    """Add the three values of a step to the record of one signal."""
    bend = first - 2.0 * half + last
    slope = 4.0 * half - 3.0 * first - last
    # The turning point of the parabola, or an end. A small error of the place hardly changes the
    # value there: single precision is enough.
    at = min(1.0, max(0.0, np.float64(np.float32(slope) / np.float32(-4.0 * bend))))
    turn = first + at * (slope + 2.0 * bend * at) if smooth else half
    row = (first_row + SIGNAL_ROWS * number) * STRIDE + slot
    memory[row] = max(memory[row], max(last, turn))
    memory[row + STRIDE] = min(memory[row + STRIDE], min(last, turn))
    memory[row + 2 * STRIDE] += first + 4.0 * half + last
    memory[row + 3 * STRIDE] += first * first + 4.0 * half * half + last * last


@scalar
def crossing(memory, first_row, slot, crossing, lane, scene):
    """Record the force of an element at a crossing, where the damper alone acts."""
    if scene.traced is None:
        sample_kink(memory, first_row, slot, crossing, lane, scene)


@scalar
def sample_kink(memory, first_row, slot, crossing, lane, scene):
    """Record the force of a damper that acts alone as a value of its element."""
    elements = elements_at(lane, unforced(lane, scene), scene)
    force = elements[crossing.element].damping * crossing.closing
    row = (first_row + offsets(scene).accumulated + SIGNAL_ROWS * crossing.element) * STRIDE + slot
    memory[row] = max(memory[row], force)
    memory[row + STRIDE] = min(memory[row + STRIDE], force)


@scalar
def finish(memory, first_row, lane_at, clock, records, scene):
    """Write the record of all signals of a lane."""
    loads = records.outcome.loads
    for signal in range(loads.shape[1]):
        for number in range(SIGNAL_ROWS):
            row = first_row + offsets(scene).accumulated + signal * SIGNAL_ROWS + number
            loads[lane_at.number, signal, number] = memory[row * STRIDE + lane_at.slot]


LOADS = Recorder(
    name="loads",
    wanted=lambda plan, _resolved: plan.loads or plan.records_steps,
    rows=rows,
    arrays=("loads",),
    reads_before=True,
    begin=begin,
    step=step,
    crossing=crossing,
    finish=finish,
)
