"""Contact branches of a clearance, and the moment at which a step leaves one.

On one branch the clearance function (eqs 22, 23) is linear, f(x) = engaged x - offset: engaged is 1
on a flank and 0 between the flanks, offset is +b, -b or 0. A step that stays on its branch meets a
smooth field, so that the method keeps its order; one that leaves it has to be split where it does.
"""

import math

from gearchaos_kernels import rows
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.loads import tell_kink
from gearchaos_kernels.rows import STRIDE, Branch, Directions

NEVER = 2.0  # Fraction of a step returned where the step does not leave its branch: beyond its end.

_THIRD = 1.0 / 3.0
_ITERATIONS = 60
LAST_CORRECTION = 1e-6
"""Newton's method squares the error: after so small a correction hardly anything is left of it."""


@scalar
def branch_at(gap, half_backlash):
    """Return the piece on which a gap lies."""
    if half_backlash == 0.0:
        return Branch(1.0, 0.0, -math.inf, math.inf)
    if gap >= half_backlash:
        return Branch(1.0, half_backlash, half_backlash, math.inf)
    if gap <= -half_backlash:
        return Branch(1.0, -half_backlash, -math.inf, -half_backlash)
    return Branch(0.0, 0.0, -half_backlash, half_backlash)


@scalar
def branches_at(gaps, half_backlash, present):
    """Return the pieces on which both gaps of a lane lie."""
    tangential = branch_at(gaps.tangential.value, half_backlash)
    if present.axial is None:
        return Directions(tangential, tangential)
    return Directions(tangential, branch_at(gaps.axial.value, half_backlash))


@scalar
def flank_at(gap, half_backlash):
    """Return 0 between the flanks, 1 on the driving flank and 2 on the back flank."""
    if gap > half_backlash:
        return 1
    return 2 if gap < -half_backlash else 0


@scalar
def next_branch(branch, gap, half_backlash):
    """Return the piece that follows where a gap leaves one."""
    # Without a jump: which way it goes, no processor foretells.
    meets = 1.0 - branch.engaged
    offset = meets * math.copysign(half_backlash, gap)
    end = offset if meets != 0.0 else half_backlash
    floor = -math.inf if offset < 0.0 else -end if meets == 0.0 else end
    ceiling = math.inf if offset > 0.0 else end
    return Branch(meets, offset, floor, ceiling)


@scalar
def leave(memory, slot, axially, gap, flank_rate, branches, lane, moment, recorded, present):
    """Return the branches after a gap leaves one at a moment in steps; tell of the crossing.

    ``flank_rate``: at which the flanks approach, see `equations`.
    """
    branch = branches.axial if axially else branches.tangential
    following = next_branch(branch, gap.value, lane.half_backlash)
    if axially:
        branches = Directions(branches.tangential, following)
    else:
        branches = Directions(following, branches.axial)
    if recorded:
        scale = lane.axial_speed if axially else lane.tangential_speed
        at = rows.CROSSINGS * STRIDE + slot
        memory[at] += 1.0
        memory[at + STRIDE] = min(memory[at + STRIDE], scale * abs(gap.rate))
        if present.loads is not None:
            tell_kink(memory, slot, axially, lane, flank_rate)
        if present.contact is not None:
            first = rows.CONTACT + (rows.CONTACT_ROWS if axially else 0)
            meets = following.engaged
            # One of the two offsets is that of the flank, the other one 0.
            at = (first + row_of_flank(branch.offset + following.offset)) * STRIDE + slot
            # Time on a flank is the sum of all moments of leaving it less those of meeting it.
            memory[at] += moment * (1.0 - 2.0 * meets)
            memory[at + STRIDE] += meets
            speed = scale * abs(flank_rate)
            at = (first + rows.SPEEDS) * STRIDE + slot
            memory[at] += meets * speed
            memory[at + STRIDE] = max(memory[at + STRIDE], meets * speed)
    return branches


@scalar
def end_contact(memory, slot, way, branch, steps):
    """Count the flank on which a mesh period of so many steps ends until its end."""
    row = rows.CONTACT + way * rows.CONTACT_ROWS + row_of_flank(branch.offset)
    memory[row * STRIDE + slot] += steps * branch.engaged


@scalar
def row_of_flank(offset):
    """Return the row of the driving flank, and where there is no clearance, or the back flank."""
    return 0 if offset >= 0.0 else rows.SPEEDS // 2


@scalar
def ways_that_may_leave(begin, end, branches, margins, present):
    """Return which gaps may leave their branches in a step: 1 tangential, 2 axial, 3 both."""
    ways = (
        1.0 if may_leave(begin.tangential, end.tangential, branches.tangential, margins[0]) else 0.0
    )
    if present.axial is not None:
        ways += 2.0 if may_leave(begin.axial, end.axial, branches.axial, margins[1]) else 0.0
    return ways


@scalar
def may_leave(begin, end, branch, margin=0.0):
    """Tell whether a step may leave its branch, be it for a moment only.

    Rates are per step. The cubic through both ends lies between the smallest and the largest of its
    Bezier points; a step that begins on a branch, and whose other points lie there, stays there.
    Where the gap is no cubic, those in the middle have a margin.
    """
    point1 = begin.value + _THIRD * begin.rate
    point2 = end.value - _THIRD * end.rate
    lowest = min(min(point1, point2) - margin, end.value)
    highest = max(max(point1, point2) + margin, end.value)
    return (lowest < branch.floor) | (highest > branch.ceiling)


@scalar
def leaving_fraction(begin, end, length, branch, half_backlash):
    """Return the fraction of a piece, so many steps long, at which a gap leaves its branch."""
    # The gap is the cubic through its values and rates at both ends. The field is continuous, so
    # that an error of the moment moves the state by its square only.
    if half_backlash == 0.0:
        return NEVER
    # One formula for a motion and its mirror image: the compiler then rounds both alike.
    if branch.engaged != 0.0:
        side = math.copysign(1.0, branch.offset)
        return first_fall_of(begin, end, length, side, -half_backlash)
    side = math.copysign(1.0, end.value)
    return min(
        first_fall_of(begin, end, length, -side, half_backlash),
        first_fall_of(begin, end, length, side, half_backlash),
    )


@scalar
def first_fall_of(begin, end, length, side, distance):
    """Return where a gap, seen from one side and raised by a distance, first falls below zero."""
    return first_fall(
        side * begin.value + distance,
        side * length * begin.rate,
        side * end.value + distance,
        side * length * end.rate,
    )


@scalar
def first_fall(d0, r0, d1, r1):
    """Return where a cubic, given by values and slopes at 0 and 1, first falls below zero."""
    # A step that begins where the last one ended at the boundary begins on the right side of it.
    d0 = max(d0, 0.0)
    if d1 >= 0.0 and d0 + _THIRD * r0 >= 0.0 and d1 - _THIRD * r1 >= 0.0:
        return NEVER
    c2 = 3.0 * (d1 - d0) - 2.0 * r0 - r1
    c3 = 2.0 * (d0 - d1) + r0 + r1
    high = 1.0
    value_high = d1
    low = 0.0
    if d1 >= 0.0 or may_turn(r0, r1, d1 - d0):
        discriminant = c2 * c2 - 3.0 * c3 * r0
        if discriminant > 0.0:
            root = math.sqrt(discriminant)
            # Of the two forms of each turning point, the one in which nothing cancels.
            lowest = (root - c2) / (3.0 * c3) if c2 < 0.0 else -r0 / (c2 + root)
            if 0.0 < lowest < 1.0:
                value = d0 + lowest * (r0 + lowest * (c2 + lowest * c3))
                if value < 0.0:
                    high = lowest
                    value_high = value
            if d0 == 0.0 and r0 >= 0.0:
                highest = (c2 + root) / (-3.0 * c3) if c2 > 0.0 else -r0 / (c2 - root)
                if 0.0 < highest < high:
                    low = highest
        if value_high >= 0.0:
            return NEVER
    if d0 == 0.0 and low == 0.0:
        return 0.0
    coefficients = d0, r0, c2, c3
    value_low, _ = cubic(coefficients, low)
    guess = low - (high - low) * value_low / (value_high - value_low)
    return falling_root(cubic, coefficients, low, high, guess)


@scalar
def cubic(coefficients, at):
    """Return a cubic and its slope."""
    d0, r0, c2, c3 = coefficients
    return d0 + at * (r0 + at * (c2 + at * c3)), r0 + at * (2.0 * c2 + at * 3.0 * c3)


@scalar
def falling_root(polynomial, given, low, high, at):
    """Return where a polynomial that falls between two places passes zero, from a guess."""
    for _ in range(_ITERATIONS):
        value, slope = polynomial(given, at)
        if value > 0.0:
            low = at
        else:
            high = at
        following = at - value / slope
        if not low <= following <= high:
            following = 0.5 * (low + high)
        elif abs(following - at) < LAST_CORRECTION:
            return following
        at = following
    return at


@scalar
def may_turn(r0, r1, change):
    """Tell whether a cubic with slopes r0 and r1 at its ends may turn around in between.

    It does not if both have the sign of its change and are at most three times as large (Fritsch
    and Carlson 1980).
    """
    return not min(r0 * (3.0 * change - r0), r1 * (3.0 * change - r1)) > 0.0
