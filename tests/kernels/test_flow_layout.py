"""Rows and numbers of flow maps follow from the terms of their polynomials, and none overlap."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from gearchaos_kernels import STATES, flow_layout, rows

COLUMNS = len(STATES) + 5
"""Of a map: all states, the load, an offset for each gap, and two parts of the error."""


def layout_with(terms: int) -> SimpleNamespace:
    """Return the names of the module were its polynomials to have so many terms."""
    path = Path(flow_layout.__file__)
    text, names = path.read_text(encoding="utf-8"), {"__name__": flow_layout.__name__}
    exec(compile(text.replace("\nTERMS = 16\n", f"\nTERMS = {terms}\n"), path, "exec"), names)
    assert names["TERMS"] == terms
    return SimpleNamespace(**names)


def assert_apart(parts: list[tuple[int, int]], end: int) -> None:
    """Make sure that parts, each a place and how many there are, neither overlap nor go too far."""
    for (place, size), (following, _) in pairwise([*sorted(parts), (end, 0)]):
        assert place + size <= following


@pytest.mark.parametrize("terms", [12, 16, 18, 24])
def test_nothing_overlaps_whatever_the_number_of_terms(terms):
    at = layout_with(terms)
    of_a_gap = [(0, terms), (at.TANGENT_TERMS, terms), (at.MOMENT, 1), (at.CROSSED, 2)]
    assert_apart([*of_a_gap, (at.SIDE, 1), (at.DISTANCE, 1), (at.BEND, 1)], at.GAP)
    gaps = [(at.GAPS, at.GAP), (at.GAPS + at.GAP, at.GAP)]
    crossing = [(row, 1) for row in (at.AFTER, at.FACTOR, at.EDGE, at.AXIALLY)]
    sums = [(at.SUMS, terms), (at.TANGENT_SUMS, terms)]
    assert_apart([(0, rows.ROWS), *gaps, *crossing, *sums], rows.ROWS + at.ASIDE)
    assert_apart([(0, 4), *((bound, COLUMNS) for bound in at.BOUNDS)], at.HEADER)
    numbers = [(place, COLUMNS) for place in (at.INPUTS, at.TANGENT_INPUTS, at.RESULT)]
    assert_apart(numbers, at.OWN)
