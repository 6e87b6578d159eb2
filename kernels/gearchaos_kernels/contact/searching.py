"""Where a polynomial first falls below zero: the moment at which a gap leaves its branch.

The polynomial is searched piece by piece. Whether it can fall in a piece follows from its cubic
there and from a bound on its fourth derivative.
"""

from gearchaos_kernels.compilation import part, scalar
from gearchaos_kernels.contact.leaving import NEVER, falling_root

_THIRD = 1.0 / 3.0

_MOST_PIECES = 300
_SHORTEST = 1e-9
"""In a shorter piece of a step, a gap that turns around changes by less than rounding."""


def fourth_derivative(power):
    """Return the largest fourth derivative of powers of s from -1 to 1."""
    return power * (power - 1.0) * (power - 2.0) * (power - 3.0)


largest_bend = scalar(fourth_derivative)
"""`fourth_derivative` as compiled code."""


@part
def first_below(polynomial, given, bend, left, end):
    """Return where a polynomial first falls below zero between two moments, or `NEVER`.

    ``polynomial(given, at)``: its value and slope; ``bend``: bound on its fourth derivative.

    Piece by piece. A piece whose lower bound is not negative has no such place. In a piece that is
    monotonically decreasing, Newton's method finds it. Other pieces are halved.
    """
    value_left, slope_left = polynomial(given, left)
    value_left = max(value_left, 0.0)
    right = end
    value_right, slope_right = polynomial(given, right)
    for _ in range(_MOST_PIECES):
        width = right - left
        ends = value_left, slope_left, value_right, slope_right
        lowest, _, steepest = bounds_of(ends, width, bend)
        clear = lowest >= 0.0 and value_right >= 0.0
        if not clear:
            if steepest < 0.0 and value_right < 0.0:
                guess = min(max(left + guess_fall(ends, width), left), right)
                return falling_root(polynomial, given, left, right, guess)
            clear = steepest < 0.0
            if not clear and width < _SHORTEST:
                if value_right < 0.0:
                    return right
                clear = True
        if clear:
            if right >= end:
                return NEVER
            left = right
            value_left = max(value_right, 0.0)
            slope_left = slope_right
            right = min(end, left + 2.0 * width)
        else:
            right = left + 0.5 * width
        value_right, slope_right = polynomial(given, right)
    return NEVER


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
