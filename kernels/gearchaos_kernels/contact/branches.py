"""Contact branches of a clearance, and the transition from one to the next.

On one branch the clearance function (eqs 22, 23) is linear, f(x) = engaged x - offset: engaged is 1
on a flank and 0 between the flanks, offset is +b, -b or 0. Within a branch the field is smooth, and
a method keeps its order. A step that leaves its branch is split where it leaves it.
"""

import math
from typing import NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.contact.leaving import may_leave
from gearchaos_kernels.memory.block_memory import store
from gearchaos_kernels.memory.rows import BRANCH, STRIDE, ContactBranch, rows
from gearchaos_kernels.memory.tuples import as_mask, each
from gearchaos_kernels.models.interfaces import gap_speeds, half_clearances
from gearchaos_kernels.recorders.protocol import record_crossing

MOST_CROSSINGS = 16
"""Crossings that are resolved in one step; a step with more continues without and is counted."""


class Moment(NamedTuple):
    """When a gap leaves its branch.

    Attributes
    ----------
    steps : float
        Steps since the beginning of the mesh period.
    recorded : bool
        Whether the mesh period is recorded.
    """

    steps: float
    recorded: bool


class Crossing(NamedTuple):
    """A gap that leaves its branch.

    Attributes
    ----------
    element : int
        Number of the element.
    moment : float
        Steps since the beginning of the mesh period.
    closing : float
        Rate at which the flanks approach, per step.
    offset : float
        Offset of the flank that comes into contact or separates.
    meets : float
        1 at the beginning of a contact, 0 at its end.
    speed : float
        Absolute value of the closing rate, per unit of tau.
    """

    element: int
    moment: float
    closing: float
    offset: float
    meets: float
    speed: float


@scalar
def always_engaged(_half_clearance):
    """Return the branch of an element without clearance."""
    return ContactBranch(1.0, 0.0, -math.inf, math.inf)


@scalar
def branch_at(gap, half_clearance, kind):
    """Return the branch of a gap, given as a number."""
    if kind.one_sided:
        return one_sided_branch(1.0 if gap >= half_clearance else 0.0, half_clearance)
    if half_clearance == 0.0:
        return ContactBranch(1.0, 0.0, -math.inf, math.inf)
    if gap >= half_clearance:
        return ContactBranch(1.0, half_clearance, half_clearance, math.inf)
    if gap <= -half_clearance:
        return ContactBranch(1.0, -half_clearance, -math.inf, -half_clearance)
    return ContactBranch(0.0, 0.0, -half_clearance, half_clearance)


@scalar
def one_sided_branch(engaged, half_clearance):
    """Return the branch of an element without a back flank: 1 in contact, 0 apart."""
    return ContactBranch(
        engaged,
        engaged * half_clearance,
        half_clearance if engaged != 0.0 else -math.inf,
        math.inf if engaged != 0.0 else half_clearance,
    )


@scalar
def branches_at(gaps, lane, scene):
    """Return the branches of the gaps of a lane."""
    return each(branch_of, gaps, half_clearances(lane, scene), kinds(scene))


@scalar
def branch_of(gap, half_clearance, kind):
    """Return the branch of a `Gap`."""
    return branch_at(gap.value, half_clearance, kind)


@scalar
def flank_at(gap, half_clearance, kind):
    """Return 0 without contact, 1 on the driving flank, 2 on the back flank."""
    if gap > half_clearance:
        return 1
    return 2 if gap < -half_clearance and not kind.one_sided else 0


@scalar
def next_branch(branch, gap, half_clearance, kind):
    """Return the branch after the one that a gap leaves."""
    # Branch-free: the direction is unpredictable.
    meets = 1.0 - branch.engaged
    if kind.one_sided:
        return one_sided_branch(meets, half_clearance)
    offset = meets * math.copysign(half_clearance, gap)
    end = offset if meets != 0.0 else half_clearance
    floor = -math.inf if offset < 0.0 else -end if meets == 0.0 else end
    ceiling = math.inf if offset > 0.0 else end
    return ContactBranch(meets, offset, floor, ceiling)


@scalar
def leave(memory, slot, element, gap, branches, lane, moment, scene):
    """Put a lane on the next branch where the gap of an element leaves one; record the crossing."""
    # The branches are an argument: reading them here slows down the loop over slots.
    branch = branches[element]
    following = next_branch_of(branch, gap.value, element, lane, scene)
    store(memory, rows(scene).branches + BRANCH * element, slot, following)
    if moment.recorded:
        scale = gap_speeds(lane, scene)[element]
        at = rows(scene).crossings * STRIDE + slot
        memory[at] += 1.0
        memory[at + STRIDE] = min(memory[at + STRIDE], scale * abs(gap.rate))
        # One of the two offsets is that of the flank, the other is 0.
        offset = branch.offset + following.offset
        speed = scale * abs(gap.closing)
        crossing = Crossing(element, moment.steps, gap.closing, offset, following.engaged, speed)
        record_crossing(memory, slot, crossing, lane, scene)


@scalar
def next_branch_of(branch, gap, element, lane, scene):
    """Return the branch of an element after the one that its gap leaves."""
    return next_branch(branch, gap, half_clearances(lane, scene)[element], kinds(scene)[element])


@scalar
def suspects_of(begin, end, branches, margins, scene):
    """Return the sum of 2**element over the elements whose gaps may leave their branches."""
    return as_mask(each(may_leave, begin, end, branches, margins))
