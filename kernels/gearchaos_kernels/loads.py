"""What the teeth carry while a lane is recorded: mesh forces and transmission error.

Of each its extremes and the integrals of itself and of its square. A step gives three values: at
both ends, and in the middle, where the state is on the cubic through both. Integrals follow by
Simpson's rule, extremes from the parabola through the three. Where teeth meet or part in between, a
force has a kink; what it is there, damping alone, counts as a fourth value and the parabola not.
"""

import numpy as np

from gearchaos_kernels import rows
from gearchaos_kernels.block_memory import load, read_lane, read_state, store
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.equations import from_rest, gaps_at, mesh_forces
from gearchaos_kernels.forcing import forcing_at, pitch_error_at
from gearchaos_kernels.rk4 import along, plus
from gearchaos_kernels.rows import ANYWHERE, LANES, STRIDE, Carried, State
from gearchaos_kernels.teeth import point_on_grid, with_teeth


@scalar
def carried_at(state, lane, point, forcing, present):
    """Return what a state `from_rest` carries at a mesh phase, forces per step squared."""
    gaps = gaps_at(state, lane, forcing, present)
    forces, slopes = mesh_forces(gaps, lane, forcing, ANYWHERE, present)
    error = lane.cosine * state.position.torsion
    if present.pitch_error is not None and present.undamped is None:
        # delta_5 is measured from e.
        error += pitch_error_at(lane, point, present)
    return Carried(forces.tangential, forces.axial, error, slopes.tangential, slopes.axial)


@scalar
def begin_loads(memory, table, shares, present):
    """Begin the record of every slot with what it carries at the beginning of a mesh period."""
    for slot in range(LANES):
        lane = read_lane(memory, slot)
        state = read_state(memory, rows.STATE, slot, present)
        point = point_on_grid(memory, slot, table, shares, 0, present)
        forcing = forcing_at(lane, point, present)
        state = from_rest(state, forcing, present)
        carried = carried_at(state, lane, point, forcing, present)
        store(memory, rows.CARRIED, slot, carried)
        signals = carried.tangential, carried.axial, carried.error
        for number, value in enumerate(signals):
            row = rows.LOADS + number * rows.SIGNAL_ROWS
            store(memory, row, slot, (value, value, 0.0, 0.0))


@scalar
def tell_loads(memory, begin, middle, end, present):
    """Add a step to the record of every slot, from the mesh phases of its ends and its middle."""
    for slot in range(LANES):
        lane = read_lane(memory, slot)
        before = read_state(memory, rows.STATE_BEFORE, slot, present)
        after = read_state(memory, rows.STATE, slot, present)
        if present.undamped is not None:
            point = with_teeth(memory, slot, begin, present)
            before = from_rest(before, forcing_at(lane, point, present), present)
        point = with_teeth(memory, slot, end, present)
        forcing = forcing_at(lane, point, present)
        after = from_rest(after, forcing, present)
        last = carried_at(after, lane, point, forcing, present)
        point = with_teeth(memory, slot, middle, present)
        forcing = forcing_at(lane, point, present)
        half = carried_at(halfway(before, after), lane, point, forcing, present)
        first = load(memory, rows.CARRIED, slot, Carried)
        store(memory, rows.CARRIED, slot, last)
        smooth = (first.tangential_slope == 0.0) == (last.tangential_slope == 0.0)
        tell_signal(memory, slot, 0, first.tangential, half.tangential, last.tangential, smooth)
        if present.axial is not None:
            smooth = (first.axial_slope == 0.0) == (last.axial_slope == 0.0)
            tell_signal(memory, slot, 1, first.axial, half.axial, last.axial, smooth)
        tell_signal(memory, slot, 2, first.error, half.error, last.error, True)


@scalar
def halfway(before, after):
    """Return the state in the middle of a step, on the cubic through both ends."""
    change = along(after.position, -1.0, before.position)
    straight = along(before.position, 0.5, change)
    return State(
        along(straight, 0.125, along(before.rate, -1.0, after.rate)),
        along(along(change, 0.5, change), -0.25, plus(before.rate, after.rate)),
    )


@scalar
def tell_signal(memory, slot, signal, first, half, last, smooth):
    """Add the three values of a step to the record of one signal."""
    bend = first - 2.0 * half + last
    slope = 4.0 * half - 3.0 * first - last
    # Where the parabola turns, or an end; next to there it is as high: single precision is enough.
    at = min(1.0, max(0.0, np.float64(np.float32(slope) / np.float32(-4.0 * bend))))
    turn = first + at * (slope + 2.0 * bend * at) if smooth else half
    row = (rows.LOADS + signal * rows.SIGNAL_ROWS) * STRIDE + slot
    memory[row] = max(memory[row], max(last, turn))
    memory[row + STRIDE] = min(memory[row + STRIDE], min(last, turn))
    memory[row + 2 * STRIDE] += first + 4.0 * half + last
    memory[row + 3 * STRIDE] += first * first + 4.0 * half * half + last * last


@scalar
def tell_kink(memory, slot, axially, lane, rate):
    """Enter the force of a direction at a crossing, where there is no deflection, only damping."""
    force = lane.mesh_damping * rate
    row = rows.LOADS * STRIDE + slot
    if axially:
        force *= lane.axial_share
        row += rows.SIGNAL_ROWS * STRIDE
    memory[row] = max(memory[row], force)
    memory[row + STRIDE] = min(memory[row + STRIDE], force)
