"""Functions that only compiled code calls, linked into a driver or into a function without one."""

import numba
from gearchaos_kernels.compilation import evaluator, part
from numba.core.caching import NullCache


@part
def inner(number):
    """Return twice a number."""
    return 2.0 * number


@part
def outer(number):
    """Return a number plus twice another one."""
    return 1.0 + inner(number)


@evaluator
def by_driver(number):
    """Call the outer part, which calls the inner one."""
    return outer(number)


# A loaded driver would leave the parts to the other function.
by_driver._cache = NullCache()


@numba.njit
def without_driver(number):
    """Do the same, compiled in Numba's usual way."""
    return outer(number)


def test_a_part_brings_what_it_calls_also_without_a_driver():
    assert by_driver(3.0) == 7.0
    assert without_driver(3.0) == 7.0
