"""The moment at which a gap leaves its branch within a step by flow maps.

Along the step, s from -1 to 1, the gap is a polynomial. The gap leaves its branch where side * gap
+ distance falls below zero. Nearly always this polynomial is monotonically decreasing. Such gaps
are solved for eight lanes at once (`find_side_by_side`), with the same operations for each lane, so
that no lane depends on its neighbours. All others are searched piece by piece (`find_in_pieces`).
"""

import math

from gearchaos_kernels.compilation import part, scalar
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.contact.leaving import LAST_CORRECTION, NEVER, falling_root
from gearchaos_kernels.memory.block_memory import read_branches, read_lane, store
from gearchaos_kernels.memory.rows import STRIDE, VECTOR, rows
from gearchaos_kernels.methods.flow_map.layout import (
    TERMS,
    GapSearch,
    aside_rows,
    fourth_derivative,
)
from gearchaos_kernels.models.interfaces import half_clearances, mean_gaps

largest_bend = scalar(fourth_derivative)

_THIRD = 1.0 / 3.0
UNKNOWN = -2.0
"""Marks a moment that still has to be searched."""

_MOST_PIECES = 300
_SHORTEST = 1e-9
"""In a shorter piece of a step, a gap that turns around changes by less than rounding."""


@scalar
def find_moments(aside, element, lanes, scene):
    """Store the moment of the next crossing of an element's gap for each lane, or `NEVER`."""
    if find_side_by_side(aside, element, scene) > 0:
        at = aside_rows(scene)
        for n in range(lanes):
            if aside[(at.gaps + element * at.gap_rows + at.moment) * STRIDE + n] == UNKNOWN:
                find_in_pieces(aside, element, n, scene)


@scalar
def find_side_by_side(aside, element, scene):
    """Find the crossings of gaps that decrease monotonically from the beginning of the step.

    Returns the number of lanes whose crossing is still unknown.
    """
    at_rows = aside_rows(scene)
    unknown = 0
    for n in range(VECTOR):
        first = (at_rows.gaps + element * at_rows.gap_rows) * STRIDE + n
        lane = read_lane(aside, n, scene)
        branch = read_branches(aside, n, scene)[element]
        aside[first] -= mean_gaps(lane, scene)[element]
        even, odd, even_slope, odd_slope, bend = sums_of_terms(aside, first)
        # A flank is left towards the middle; a lane between the flanks most likely meets the one
        # on the side where the step ends.
        side = math.copysign(1.0, branch.offset if branch.engaged != 0.0 else -even - odd)
        one_sided = kinds(scene)[element].one_sided
        if one_sided:
            side = 1.0 if branch.engaged != 0.0 else -1.0
        distance = half_clearances(lane, scene)[element] * (1.0 - 2.0 * branch.engaged)
        # A step that begins at the boundary, where the last one ended, begins on its right side.
        value_left = max(side * (even - odd) + distance, 0.0)
        slope_left = side * (odd_slope - even_slope)
        value_right = side * (even + odd) + distance
        slope_right = side * (odd_slope + even_slope)
        ends = value_left, slope_left, value_right, slope_right
        lowest, highest, steepest = bounds_of(ends, 2.0, bend)
        stays = lowest >= 0.0 and value_right >= 0.0
        # A lane between the flanks may meet either: this one must be out of reach of the other.
        one_way = one_sided or distance < 0.0 or max(highest, value_right) <= 2.0 * distance
        falls = steepest < 0.0 and value_right < 0.0
        at = min(max(guess_fall(ends, 2.0) - 1.0, -1.0), 1.0)
        at, correction, value, slope = refined_fall(aside, first, side * distance, at)
        found = falls and abs(correction) < LAST_CORRECTION and -1.0 <= at <= 1.0
        moment = NEVER if stays else at
        known = one_way and (stays or found) and aside[at_rows.after * STRIDE + n] == -1.0
        # The suspects are a sum of 2**element; this is the bit of the element.
        suspects = int(aside[rows(scene).suspect * STRIDE + n])
        is_suspect = (suspects >> element) & 1 == 1
        unknown += 1 if is_suspect and not known else 0
        if not known:
            moment = UNKNOWN
        aside[first + at_rows.moment * STRIDE] = moment if is_suspect else NEVER
        found_of_gap = GapSearch(value, slope, side, distance, bend)
        store(aside, element * at_rows.gap_rows + at_rows.gaps + at_rows.crossed, n, found_of_gap)
    return unknown


@scalar
def sums_of_terms(aside, first):
    """Return sums over the terms of a gap: even, odd, their slopes at 1, and a bound on the bend.

    The bound is that of the fourth derivative from -1 to 1.
    """
    even, odd, even_slope, odd_slope, bend = 0.0, 0.0, 0.0, 0.0, 0.0
    for term in range(0, TERMS, 2):
        a, b = aside[first + term * STRIDE], aside[first + (term + 1) * STRIDE]
        even += a
        odd += b
        even_slope += term * a
        odd_slope += (term + 1) * b
        bend += largest_bend(term) * abs(a) + largest_bend(term + 1) * abs(b)
    return even, odd, even_slope, odd_slope, bend


@scalar
def refined_fall(aside, first, raised, at):
    """Return a place where a gap plus a number is zero, from the guess of a cubic.

    One step of Chebyshev's method removes nearly all of the error, and one of Newton's method the
    rest. Returns the place, the last correction, and the gap before it with its slope.
    """
    value, slope, curvature = gap_along(aside, first, at)
    inverse = 1.0 / slope
    shift = (value + raised) * inverse
    at -= shift + shift * shift * curvature * inverse
    value, slope, _ = gap_along(aside, first, at)
    correction = (value + raised) / slope
    return at - correction, correction, value, slope


@scalar
def bounds_of(ends, width, bend):
    """Return a lower and an upper bound of a gap within a piece, and an upper one of its slope.

    ``ends``: value and slope on the left and on the right; ``bend``: bound on the fourth
    derivative. The gap differs from the cubic by at most bend (width^4 / 24) t^2 (1 - t)^2.
    """
    value_left, slope_left, value_right, slope_right = ends
    point1 = value_left + _THIRD * width * slope_left
    point2 = value_right - _THIRD * width * slope_right
    stray = bend * width**4 / 24.0
    steepest = max(max(width * slope_left, 3.0 * (point2 - point1)), width * slope_right)
    # The slopes of gap and cubic differ by less than 0.2 stray.
    lowest, highest = min(point1, point2), max(point1, point2)
    return lowest - stray / 12.0, highest + stray / 12.0, steepest + 0.2 * stray


@scalar
def guess_fall(ends, width):
    """Estimate where in a piece a gap falls below 0, by inverse cubic interpolation."""
    value_left, slope_left, value_right, slope_right = ends
    fallen = value_left - value_right
    done = value_left / fallen
    early = (1.0 - done) * (-fallen / slope_left - width)
    late = done * (-fallen / slope_right - width)
    return width * done + done * (1.0 - done) * (early - late)


@scalar
def gap_along(aside, first, at):
    """Return value, slope and half the curvature of a gap; ``first``: the place of its terms."""
    # Even and odd terms are summed independently, so that they do not wait for each other.
    square = at * at
    even, odd = aside[first + (TERMS - 2) * STRIDE], aside[first + (TERMS - 1) * STRIDE]
    even_slope, odd_slope, even_bend, odd_bend = 0.0, 0.0, 0.0, 0.0
    for term in range(TERMS - 4, -1, -2):
        even_bend = even_bend * square + even_slope
        odd_bend = odd_bend * square + odd_slope
        even_slope = even_slope * square + even
        odd_slope = odd_slope * square + odd
        even = even * square + aside[first + term * STRIDE]
        odd = odd * square + aside[first + (term + 1) * STRIDE]
    bends = even_slope + 4.0 * square * even_bend, 3.0 * odd_slope + 4.0 * square * odd_bend
    slope = odd + 2.0 * at * (even_slope + at * odd_slope)
    return even + at * odd, slope, bends[0] + at * bends[1]


@part
def find_in_pieces(aside, element, n, scene):
    """Store the first crossing of any gap after the last crossing of its lane, or `NEVER`."""
    at_rows = aside_rows(scene)
    first = (at_rows.gaps + element * at_rows.gap_rows) * STRIDE + n
    side, distance = aside[first + at_rows.side * STRIDE], aside[first + at_rows.distance * STRIDE]
    after, bend = aside[at_rows.after * STRIDE + n], aside[first + at_rows.bend * STRIDE]
    moment = first_below((aside, first, side, distance), bend, after)
    if distance > 0.0 and not kinds(scene)[element].one_sided:
        # A lane between the flanks may meet either flank.
        moment = min(moment, first_below((aside, first, -side, distance), bend, after))
    value, slope, _ = gap_along(aside, first, moment)
    aside[first + at_rows.moment * STRIDE] = moment
    aside[first + at_rows.crossed * STRIDE] = value
    aside[first + (at_rows.crossed + 1) * STRIDE] = slope


@part
def first_below(given, bend, left):
    """Return where side * gap + distance first falls below zero after a moment, or `NEVER`.

    Piece by piece. A piece whose lower bound is not negative has no such place. In a piece that is
    monotonically decreasing, Newton's method finds it. Other pieces are halved.
    """
    value_left, slope_left = gap_at(given, left)
    value_left = max(value_left, 0.0)
    right = 1.0
    value_right, slope_right = gap_at(given, right)
    for _ in range(_MOST_PIECES):
        width = right - left
        ends = value_left, slope_left, value_right, slope_right
        lowest, _, steepest = bounds_of(ends, width, bend)
        clear = lowest >= 0.0 and value_right >= 0.0
        if not clear:
            if steepest < 0.0 and value_right < 0.0:
                guess = min(max(left + guess_fall(ends, width), left), right)
                return falling_root(gap_at, given, left, right, guess)
            clear = steepest < 0.0
            if not clear and width < _SHORTEST:
                if value_right < 0.0:
                    return right
                clear = True
        if clear:
            if right >= 1.0:
                return NEVER
            left = right
            value_left = max(value_right, 0.0)
            slope_left = slope_right
            right = min(1.0, left + 2.0 * width)
        else:
            right = left + 0.5 * width
        value_right, slope_right = gap_at(given, right)
    return NEVER


@scalar
def gap_at(given, at):
    """Return side * gap + distance, and its slope."""
    aside, first, side, distance = given
    value, slope, _ = gap_along(aside, first, at)
    return side * value + distance, side * slope
