"""One step of one lane, split wherever it leaves a contact branch.

The lane loop integrates every step on the contact branches on which it begins, where the field is
smooth. The few steps and lanes that may have left a branch come here one by one: the step is
repeated up to the crossing, then on the next branch, as often as it crosses.
"""

from __future__ import annotations

import math

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact import (
    NEVER,
    Branches,
    branches_at,
    leaving_fraction,
    next_branch,
    read_branches,
    write_branches,
)
from gearchaos_kernels.forcing import forcing_at, phase_on_grid, phase_within
from gearchaos_kernels.lane import (
    BEFORE,
    POSITION,
    RATE,
    TANGENT_POSITION,
    TANGENT_RATE,
    read,
    read_lane,
    write,
)
from gearchaos_kernels.motion import (
    axial_gap,
    axial_gap_rate,
    tangential_gap,
    tangential_gap_rate,
)
from gearchaos_kernels.rk4 import step, tangent_step

MOST_SPLITS = 16
"""Crossings of one step; a step with more goes on with its last branches and is counted."""


@scalar
def split_step(
    memory,
    slot,
    table,
    number,
    speed_y,
    speed_z,
    pitch_error,
    phase,
    stiffness_variation,
    transverse,
    axial,
    tangent,
):
    """Repeat one step of one lane in parts that each stay on their contact branches.

    The state before the step is in the rows from `BEFORE` on, the one after it, which ignored the
    crossing, in the ordinary rows. These are replaced where there is a crossing.

    Parameters
    ----------
    speed_y, speed_z : float
        What turns the rates of the two gaps into those of y_1 and y_2.

    Returns
    -------
    crossings : int
    slowest : float
        Smallest speed of y_1 or y_2 at a crossing of this step; infinity without any.
    overflow : int
        1 if the step needed more than `MOST_SPLITS` splits.
    """
    lane = read_lane(memory, slot)
    b = lane.half_backlash
    y = read(memory, BEFORE + POSITION, slot, transverse, axial)
    w = read(memory, BEFORE + RATE, slot, transverse, axial)
    y_end = read(memory, POSITION, slot, transverse, axial)
    w_end = read(memory, RATE, slot, transverse, axial)
    dy = y
    dw = w
    if tangent is not None:
        dy = read(memory, BEFORE + TANGENT_POSITION, slot, transverse, axial)
        dw = read(memory, BEFORE + TANGENT_RATE, slot, transverse, axial)
    begin = forcing_at(
        lane, phase_on_grid(table, 2 * number), pitch_error, phase, stiffness_variation, axial
    )
    end = forcing_at(
        lane, phase_on_grid(table, 2 * number + 2), pitch_error, phase, stiffness_variation, axial
    )
    gap = tangential_gap(y, lane, begin, transverse)
    gap_z = axial_gap(y, gap, lane, begin)
    branches = read_branches(memory, slot, axial)
    done = 0.0
    crossings = 0
    slowest = math.inf
    while True:
        left = 1.0 - done
        rate = left * tangential_gap_rate(w, lane, begin, transverse)
        gap_end = tangential_gap(y_end, lane, end, transverse)
        rate_end = left * tangential_gap_rate(w_end, lane, end, transverse)
        part = leaving_fraction(gap, rate, gap_end, rate_end, branches.tangential, b)
        part_z = NEVER
        if axial is not None:
            part_z = leaving_fraction(
                gap_z,
                axial_gap_rate(w, rate, left, lane, begin),
                axial_gap(y_end, gap_end, lane, end),
                axial_gap_rate(w_end, rate_end, left, lane, end),
                branches.axial,
                b,
            )
        first = min(part, part_z)
        # Also where the lane has left the range of numbers, and the fraction is not one.
        if not first <= 1.0 or crossings == MOST_SPLITS:
            break

        first *= left
        middle = forcing_at(
            lane,
            phase_within(table, number, done + 0.5 * first),
            pitch_error,
            phase,
            stiffness_variation,
            axial,
        )
        done += first
        crossing = forcing_at(
            lane, phase_within(table, number, done), pitch_error, phase, stiffness_variation, axial
        )
        y, w, slopes = step(
            y,
            w,
            first,
            lane,
            begin,
            middle,
            crossing,
            branches,
            None,
            transverse,
            axial,
        )
        if tangent is not None:
            dy, dw = tangent_step(dy, dw, first, lane, slopes, transverse, axial)
        begin = crossing
        crossings += 1
        gap = tangential_gap(y, lane, begin, transverse)
        gap_z = axial_gap(y, gap, lane, begin)
        rate = tangential_gap_rate(w, lane, begin, transverse)
        if part <= part_z:
            slowest = min(slowest, speed_y * abs(rate))
            branches = Branches(next_branch(branches.tangential, gap, b), branches.axial)
        else:
            slowest = min(slowest, speed_z * abs(axial_gap_rate(w, rate, 1.0, lane, begin)))
            branches = Branches(branches.tangential, next_branch(branches.axial, gap_z, b))

        left = 1.0 - done
        middle = forcing_at(
            lane,
            phase_within(table, number, done + 0.5 * left),
            pitch_error,
            phase,
            stiffness_variation,
            axial,
        )
        y_end, w_end, slopes = step(
            y, w, left, lane, begin, middle, end, branches, None, transverse, axial
        )
        write(memory, POSITION, slot, y_end, transverse, axial)
        write(memory, RATE, slot, w_end, transverse, axial)
        if tangent is not None:
            dy_end, dw_end = tangent_step(dy, dw, left, lane, slopes, transverse, axial)
            write(memory, TANGENT_POSITION, slot, dy_end, transverse, axial)
            write(memory, TANGENT_RATE, slot, dw_end, transverse, axial)
    if crossings > 0:
        write_branches(memory, slot, branches_at(y_end, lane, end, transverse, axial))
    return crossings, slowest, 1 if first <= 1.0 else 0
