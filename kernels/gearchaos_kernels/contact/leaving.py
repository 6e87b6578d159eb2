"""Where a gap leaves its contact branch within a step, from the cubic through both ends."""

import math

from gearchaos_kernels.compilation import scalar

NEVER = 2.0
"""Fraction of a step for no crossing: it is beyond the end of the step."""

_THIRD = 1.0 / 3.0
_ITERATIONS = 60
LAST_CORRECTION = 1e-6
"""Newton's method ends after a smaller correction: it squares the error, down to rounding."""


@scalar
def may_leave(begin, end, branch, margin=0.0):
    """Return whether a gap may leave its branch within a step, even for a moment.

    Rates are per step. The cubic through both ends lies between the smallest and the largest of its
    Bezier points. If it begins on a branch and its other Bezier points lie there, it stays there.
    ``margin`` widens the middle points by how far the gap may deviate from the cubic.
    """
    point1 = begin.value + _THIRD * begin.rate
    point2 = end.value - _THIRD * end.rate
    lowest = min(min(point1, point2) - margin, end.value)
    highest = max(max(point1, point2) + margin, end.value)
    return (lowest < branch.floor) | (highest > branch.ceiling)


@scalar
def leaving_fraction(begin, end, length, branch, half_clearance, kind):
    """Return the fraction of a piece, ``length`` steps long, at which a gap leaves its branch."""
    # The gap is taken as the cubic through its values and rates at both ends. The field is
    # continuous, so an error of the moment changes the state by its square only.
    if kind.one_sided:
        side = 1.0 if branch.engaged != 0.0 else -1.0
        return first_fall_of(begin, end, length, side, -side * half_clearance)
    if half_clearance == 0.0:
        return NEVER
    # One formula for a motion and its mirror image, so that both are rounded alike.
    if branch.engaged != 0.0:
        side = math.copysign(1.0, branch.offset)
        return first_fall_of(begin, end, length, side, -half_clearance)
    side = math.copysign(1.0, end.value)
    return min(
        first_fall_of(begin, end, length, -side, half_clearance),
        first_fall_of(begin, end, length, side, half_clearance),
    )


@scalar
def first_fall_of(begin, end, length, side, distance):
    """Return where side * gap + distance first falls below zero."""
    return first_fall(
        side * begin.value + distance,
        side * length * begin.rate,
        side * end.value + distance,
        side * length * end.rate,
    )


@scalar
def first_fall(d0, r0, d1, r1):
    """Return where a cubic, given by values d and slopes r at 0 and 1, first falls below zero."""
    # A step may begin at the boundary, where the last one ended; it begins on its right side.
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
            # Each turning point has two formulas; the one without cancellation is used.
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
    """Return the value and the slope of a cubic."""
    d0, r0, c2, c3 = coefficients
    return d0 + at * (r0 + at * (c2 + at * c3)), r0 + at * (2.0 * c2 + at * 3.0 * c3)


@scalar
def falling_root(polynomial, given, low, high, at):
    """Return where a decreasing polynomial is zero between two places, starting from a guess.

    Newton's method, safeguarded by bisection.
    """
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
    """Return whether a cubic with slopes r0 and r1 at its ends may turn around in between.

    It is monotonic if both slopes have the sign of its change and are at most three times as large
    (Fritsch and Carlson 1980).
    """
    return not min(r0 * (3.0 * change - r0), r1 * (3.0 * change - r1)) > 0.0
