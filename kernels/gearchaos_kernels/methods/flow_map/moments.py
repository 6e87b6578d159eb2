"""The moment at which a gap leaves its branch within a step by flow maps.

Along the step, s from -1 to 1, the gap is a polynomial. The gap leaves its branch where side * gap
+ distance falls below zero. Nearly always this polynomial is monotonically decreasing. Such gaps
are solved for eight lanes at once (`find_side_by_side`), with the same operations for each lane, so
that no lane depends on its neighbours. All others are searched piece by piece (`find_in_pieces`).
"""

import math

from gearchaos_kernels.compilation import part, scalar
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.contact.leaving import LAST_CORRECTION, NEVER
from gearchaos_kernels.contact.searching import (
    bounds_of,
    first_below,
    guess_fall,
    largest_bend,
)
from gearchaos_kernels.memory.block_memory import read_branches, read_lane, store
from gearchaos_kernels.memory.rows import STRIDE, VECTOR, rows
from gearchaos_kernels.methods.flow_map.layout import (
    TERMS,
    GapSearch,
    aside_rows,
)
from gearchaos_kernels.models.interfaces import half_clearances, mean_gaps

UNKNOWN = -2.0
"""Marks a moment that still has to be searched."""


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
    rest. Returns the place, the last correction, the gap before it, and the slope after it.
    """
    value, slope, curvature = gap_along(aside, first, at)
    inverse = 1.0 / slope
    shift = (value + raised) * inverse
    at -= shift + shift * shift * curvature * inverse
    value, slope, bend = gap_along(aside, first, at)
    correction = (value + raised) / slope
    return at - correction, correction, value, slope - 2.0 * bend * correction


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
    moment = first_below(gap_at, (aside, first, side, distance), bend, after, 1.0)
    if distance > 0.0 and not kinds(scene)[element].one_sided:
        # A lane between the flanks may meet either flank.
        moment = min(moment, first_below(gap_at, (aside, first, -side, distance), bend, after, 1.0))
    value, slope, _ = gap_along(aside, first, moment)
    aside[first + at_rows.moment * STRIDE] = moment
    aside[first + at_rows.crossed * STRIDE] = value
    aside[first + (at_rows.crossed + 1) * STRIDE] = slope


@scalar
def gap_at(given, at):
    """Return side * gap + distance, and its slope."""
    aside, first, side, distance = given
    value, slope, _ = gap_along(aside, first, at)
    return side * value + distance, side * slope
