"""Contact branches, and the first time at which a gap leaves one, against simple references."""

import itertools
import math

import numpy as np
import pytest
from gearchaos_kernels.contact import branches, leaving
from gearchaos_kernels.contact.leaving import NEVER
from gearchaos_kernels.memory.rows import ContactBranch
from gearchaos_kernels.models.protocol import ElementKind, Gap
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from .reference import from_python

branch_of_kind = from_python(branches.branch_at)
first_fall = from_python(leaving.first_fall)
fraction_of_kind = from_python(leaving.leaving_fraction)
may_leave = from_python(leaving.may_leave)
next_of_kind = from_python(branches.next_branch)

TWO_SIDED, ONE_SIDED = ElementKind(), ElementKind(one_sided=True)


def branch_at(gap, half_clearance, kind=TWO_SIDED):
    return branch_of_kind(gap, half_clearance, kind)


def next_branch(branch, gap, half_clearance, kind=TWO_SIDED):
    return next_of_kind(branch, gap, half_clearance, kind)


def leaving_fraction(begin, end, length, branch, half_clearance, kind=TWO_SIDED):
    return fraction_of_kind(begin, end, length, branch, half_clearance, kind)


settings.register_profile("contact", derandomize=True, deadline=None, max_examples=150)
PROPERTY = settings.get_profile("contact")

ROUNDING = 1e-12
"""Rounding error of a cubic, relative to the numbers that define it.

Newton's method stops when a correction is below the square root of this number.
"""

HALF_BACKLASH = 0.75


def moving(value: float, rate: float) -> Gap:
    """Return a gap whose speed of approach is its own rate."""
    return Gap(value, rate, rate)


SAMPLES = np.linspace(0.0, 1.0, 2001)


def cubic(d0, r0, d1, r1) -> np.polynomial.Polynomial:
    """Return the cubic through values and slopes at 0 and 1."""
    c2 = 3.0 * (d1 - d0) - 2.0 * r0 - r1
    c3 = 2.0 * (d0 - d1) + r0 + r1
    return np.polynomial.Polynomial([d0, r0, c2, c3])


def ends(curve: np.polynomial.Polynomial) -> tuple[float, float, float, float]:
    slope = curve.deriv()
    return curve(0.0), slope(0.0), curve(1.0), slope(1.0)


def size_of(curve: np.polynomial.Polynomial) -> float:
    return float(np.sum(np.abs(curve.coef)))


def turning_points(curve: np.polynomial.Polynomial) -> np.ndarray:
    """Return the turning points of a cubic within the step."""
    roots = np.roots(curve.deriv().coef[::-1])
    real = roots.real[np.abs(roots.imag) < 1e-9]
    return np.sort(real[(real > 0.0) & (real < 1.0)])


def lowest(curve: np.polynomial.Polynomial, start: float, end: float) -> float:
    """Return the smallest value of a cubic over a part of the step."""
    inner = turning_points(curve)
    inner = inner[(inner > start) & (inner < end)]
    dense = start + (end - start) * SAMPLES
    return float(np.min(curve(np.concatenate([dense, inner]))))


def twin_of_first_fall(curve: np.polynomial.Polynomial) -> float:
    """Return where a cubic first falls below zero: at 0 or at a real root followed by a fall."""
    roots = np.roots(curve.coef[::-1])
    real = np.sort(roots.real[np.abs(roots.imag) < 1e-9])
    inner = real[(real > 0.0) & (real < 1.0)]
    marks = np.concatenate([[0.0], inner, [1.0]])
    for begin, end in itertools.pairwise(marks):
        if curve(0.5 * (begin + end)) < 0.0:
            return float(begin)
    return NEVER


def assert_is_the_first_fall(curve: np.polynomial.Polynomial) -> None:
    """Check that the result has all properties of a first fall below zero."""
    found = first_fall(*ends(curve))
    nearly = 10.0 * ROUNDING * size_of(curve)
    if found == NEVER:
        assert lowest(curve, 0.0, 1.0) >= -nearly
        return
    assert 0.0 <= found <= 1.0
    assert abs(curve(found)) <= nearly
    assert lowest(curve, 0.0, found) >= -nearly
    assert lowest(curve, found, 1.0) <= nearly


# The squares of smaller numbers underflow; no gap and no rate of a motion is that small.
number = st.one_of(
    st.floats(-10.0, 10.0).map(lambda x: 0.0 if abs(x) < 1e-150 else x),
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 1e-17, -1e-17, 1e-9, -1e-9, 1e-100]),
)
value = number.map(abs)


@PROPERTY
@given(value, number, number, number)
@example(0.0, 1e-17, -1.0, -4.0)  # Begins at the boundary and leaves it slowly.
@example(0.0, 1e-300, -1.0, -4.0)
@example(0.0, -1e-17, 1.0, 3.0)
@example(1.0, 0.0, 1.0, 10.0)  # Begins at rest.
@example(1e-17, 1.0, -1e-17, -1.0)
@example(0.0, 0.0, 0.0, 0.0)
def test_a_cubic_falls_below_zero_where_it_is_found_to_and_not_before(d0, r0, d1, r1):
    assert_is_the_first_fall(cubic(d0, r0, d1, r1))


position = st.floats(-0.5, 1.5)


@PROPERTY
@given(position, position, position, st.sampled_from([1e-100, 1e-9, 1.0, 1e12, 1e100]))
def test_a_cubic_of_three_known_roots_falls_at_the_first_of_them_behind_which_it_is_negative(
    a, b, c, scale
):
    roots = np.sort([a, b, c])
    assume(np.min(np.diff(roots)) > 1e-3 and np.min(np.abs(np.append(roots, roots - 1.0))) > 1e-3)
    curve = scale * np.polynomial.Polynomial.fromroots(roots)
    curve = curve if curve(0.0) > 0.0 else -curve
    inner = roots[(roots > 0.0) & (roots < 1.0)]
    wanted = inner[0] if inner.size else NEVER
    assert first_fall(*ends(curve)) == pytest.approx(wanted, rel=0, abs=1e-8)
    assert twin_of_first_fall(curve) == pytest.approx(wanted, rel=0, abs=1e-8)


@pytest.mark.parametrize("depth", [1e-1, 1e-4, 1e-8, 1e-11])
@pytest.mark.parametrize("at", [0.05, 0.3, 0.5, 0.8, 0.95])
def test_a_dip_within_one_step_is_found_however_shallow(at, depth):
    # (t - at)^2 - depth is positive at both ends and negative in the middle of the dip.
    depth = min(depth, 0.9 * at**2, 0.9 * (1.0 - at) ** 2)
    found = first_fall(at**2 - depth, -2.0 * at, (1.0 - at) ** 2 - depth, 2.0 * (1.0 - at))
    assert found == pytest.approx(at - math.sqrt(depth), rel=0, abs=1e-6)
    assert found <= at


@pytest.mark.parametrize("at", [0.05, 0.3, 0.5, 0.8, 0.95])
def test_a_turn_just_above_zero_is_no_fall(at):
    above = 1e-11
    found = first_fall(at**2 + above, -2.0 * at, (1.0 - at) ** 2 + above, 2.0 * (1.0 - at))
    assert found == NEVER


@pytest.mark.parametrize("rate", [0.5, 1e-3, 1e-8, 1e-14, 1e-17, 1e-20, 1e-300])
def test_a_step_that_begins_at_the_boundary_does_not_take_its_own_beginning_for_a_crossing(rate):
    # rate t + t^2 - 2 t^3 rises from zero, even for a tiny rate, and crosses zero again near 1/2.
    found = first_fall(0.0, rate, rate - 1.0, rate - 4.0)
    assert found == pytest.approx((1.0 + math.sqrt(1.0 + 8.0 * rate)) / 4.0, rel=0, abs=1e-9)


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_a_step_that_begins_at_rest_at_the_boundary_follows_its_acceleration(zero):
    # 2 t^2 - 3 t^3 rises first and crosses zero at 2/3; with the opposite sign it falls at once.
    assert first_fall(0.0, zero, -1.0, -5.0) == pytest.approx(2.0 / 3.0, rel=0, abs=1e-9)
    assert first_fall(0.0, zero, 1.0, 5.0) == 0.0


def test_a_step_that_begins_at_the_boundary_and_moves_off_leaves_at_once():
    assert first_fall(0.0, -1.0, -1.0, -1.0) == 0.0
    assert first_fall(-1e-18, -1.0, -1.0, -1.0) == 0.0
    assert first_fall(1e-18, -1.0, -1.0, -1.0) == pytest.approx(0.0, abs=1e-15)


@PROPERTY
@given(value, number, number, number, st.integers(-60, 60))
def test_the_first_fall_does_not_depend_on_the_unit_of_length(d0, r0, d1, r1, power):
    assume(all(x == 0.0 or abs(x) > 1e-60 for x in (d0, r0, d1, r1)))
    factor = 2.0**power
    scaled = first_fall(factor * d0, factor * r0, factor * d1, factor * r1)
    assert scaled == first_fall(d0, r0, d1, r1)


gap = st.one_of(
    st.floats(-3.0, 3.0),
    st.sampled_from([0.0, HALF_BACKLASH, -HALF_BACKLASH, math.nextafter(HALF_BACKLASH, 0.0)]),
)
rate = st.one_of(st.floats(-6.0, 6.0), st.just(0.0))


def distance_inside(curve: np.polynomial.Polynomial, branch: ContactBranch) -> np.ndarray:
    """Return how far a gap lies inside its branch, at many times and at turning points."""
    gaps = curve(np.concatenate([SAMPLES, turning_points(curve)]))
    if branch.engaged:
        return math.copysign(1.0, branch.offset) * gaps - HALF_BACKLASH
    return HALF_BACKLASH - np.abs(gaps)


@PROPERTY
@given(gap, rate, gap, rate)
def test_a_gap_leaves_its_branch_where_dense_sampling_sees_it_leave(gap0, rate0, gap1, rate1):
    branch = branch_at(gap0, HALF_BACKLASH)
    curve = cubic(gap0, rate0, gap1, rate1)
    found = leaving_fraction(moving(gap0, rate0), moving(gap1, rate1), 1.0, branch, HALF_BACKLASH)
    inside = distance_inside(curve, branch)
    nearly = 10.0 * ROUNDING * (size_of(curve) + HALF_BACKLASH)
    if found == NEVER:
        assert inside.min() >= -nearly
        return
    assert inside.min() <= nearly
    assert abs(abs(curve(found)) - HALF_BACKLASH) <= nearly
    assert distance_inside(curve, branch)[:2001][found > SAMPLES].min(initial=0.0) >= -nearly


@PROPERTY
@given(gap, rate, gap, rate)
@example(0.6875, 3.0, 0.734375, 1.0)
def test_a_step_that_leaves_its_branch_is_suspected(gap0, rate0, gap1, rate1):
    branch = branch_at(gap0, HALF_BACKLASH)
    curve = cubic(gap0, rate0, gap1, rate1)
    leaves = (
        leaving_fraction(moving(gap0, rate0), moving(gap1, rate1), 1.0, branch, HALF_BACKLASH)
        <= 1.0
    )
    if not leaves or may_leave(moving(gap0, rate0), moving(gap1, rate1), branch):
        return
    # The test may miss only excursions within the rounding error.
    nearly = 10.0 * ROUNDING * (size_of(curve) + HALF_BACKLASH)
    assert distance_inside(curve, branch).min() >= -nearly


@PROPERTY
@given(st.floats(0.0, 0.5), st.floats(-6.0, 0.0), st.floats(0.0, 0.5), st.floats(0.0, 6.0))
def test_a_dip_with_one_turn_is_always_suspected(above0, rate0, above1, rate1):
    gap0, gap1 = HALF_BACKLASH + above0, HALF_BACKLASH + above1
    curve = cubic(gap0, rate0, gap1, rate1)
    branch = branch_at(gap0, HALF_BACKLASH)
    dips = distance_inside(curve, branch).min() < -1e-12
    assert not dips or may_leave(moving(gap0, rate0), moving(gap1, rate1), branch)


@pytest.mark.parametrize("rate1", [5.0, 10.0, 30.0])
def test_a_dip_that_begins_at_rest_at_the_boundary_is_suspected(rate1):
    b = HALF_BACKLASH
    assert leaving_fraction(moving(b, 0.0), moving(b, rate1), 1.0, branch_at(b, b), b) == 0.0
    assert may_leave(moving(b, 0.0), moving(b, rate1), branch_at(b, b))
    assert may_leave(moving(-b, 0.0), moving(-b, -rate1), branch_at(-b, b))


@pytest.mark.parametrize("gap", [HALF_BACKLASH, -HALF_BACKLASH, 2.0, 0.0, 0.3])
def test_a_gap_at_rest_is_not_suspected(gap):
    assert not may_leave(moving(gap, 0.0), moving(gap, 0.0), branch_at(gap, HALF_BACKLASH))


@pytest.mark.parametrize("far", [3.0, -3.0])
def test_a_gap_far_from_the_boundary_is_not_suspected_whatever_it_does(far):
    # Most steps are of this kind, and must not take the scalar path.
    for rate0 in (-2.0, 0.0, 2.0):
        for rate1 in (-2.0, 0.0, 2.0):
            assert not may_leave(
                moving(far, rate0), moving(far, rate1), branch_at(far, HALF_BACKLASH)
            )


@PROPERTY
@given(gap)
def test_the_branches_are_the_pieces_of_the_clearance_function(gap):
    branch = branch_at(gap, HALF_BACKLASH)
    elastic = gap - min(max(gap, -HALF_BACKLASH), HALF_BACKLASH)
    assert branch.engaged * gap - branch.offset == pytest.approx(elastic, rel=0, abs=1e-15)


def test_from_a_flank_a_gap_comes_between_the_flanks_and_from_there_to_the_flank_it_meets():
    b = HALF_BACKLASH
    free = branch_at(0.0, b)
    assert next_branch(branch_at(b, b), b, b) == free
    assert next_branch(branch_at(-b, b), -b, b) == free
    assert next_branch(free, b, b) == branch_at(b, b)
    assert next_branch(free, -b, b) == branch_at(-b, b)


@pytest.mark.parametrize("b", [0.0, HALF_BACKLASH])
def test_a_one_sided_element_has_two_branches_that_follow_each_other(b):
    free, engaged = (branch_at(gap, b, ONE_SIDED) for gap in (-9.0 * (1.0 + b), b))
    assert free == ContactBranch(0.0, 0.0, -math.inf, b)
    assert engaged == ContactBranch(1.0, b, b, math.inf)
    assert next_branch(free, b, b, ONE_SIDED) == engaged
    assert next_branch(engaged, math.nextafter(b, -1.0), b, ONE_SIDED) == free


@pytest.mark.parametrize("b", [0.0, HALF_BACKLASH])
def test_a_one_sided_element_is_left_on_its_side_only(b):
    def fraction(first, last):
        branch = branch_at(first, b, ONE_SIDED)
        ends = moving(first, last - first), moving(last, last - first)
        return leaving_fraction(*ends, 1.0, branch, b, ONE_SIDED)

    assert fraction(b + 1.0, b - 3.0) == pytest.approx(0.25)
    assert fraction(b - 1.0, b + 3.0) == pytest.approx(0.25)
    assert fraction(b - 1.0, -b - 30.0) == NEVER
    assert fraction(b + 1.0, b + 30.0) == NEVER


def test_neighbouring_branches_meet_at_the_boundary():
    for b in (HALF_BACKLASH, 1e-9, 1e9):
        for side in (b, -b):
            engaged = branch_at(side, b)
            assert engaged[:2] == (1.0, side)
            assert engaged.engaged * side - engaged.offset == 0.0
            assert engaged.floor <= side <= engaged.ceiling
            assert branch_at(math.nextafter(side, 0.0), b) == ContactBranch(0.0, 0.0, -b, b)


def test_without_clearance_there_is_no_branch_to_leave():
    for gap0, gap1 in ((1.0, -1.0), (-1.0, 1.0), (0.0, 0.0)):
        branch = branch_at(gap0, 0.0)
        assert leaving_fraction(moving(gap0, -2.0), moving(gap1, -2.0), 1.0, branch, 0.0) == NEVER
        assert not may_leave(moving(gap0, -2.0), moving(gap1, -2.0), branch)


@pytest.mark.parametrize("lost", [math.nan, math.inf, -math.inf])
def test_a_gap_out_of_the_range_of_numbers_gives_no_moment_within_the_step(lost):
    branch = branch_at(1.0, HALF_BACKLASH)
    found = leaving_fraction(moving(1.0, 0.0), moving(lost, lost), 1.0, branch, HALF_BACKLASH)
    assert not 0.0 < found < 1.0
