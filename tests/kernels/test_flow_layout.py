"""Parts of flow maps in memory never overlap, for any number of terms of the polynomials."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from gearchaos_kernels.memory.rows import rows_of
from gearchaos_kernels.methods.flow_map import layout
from gearchaos_kernels.methods.flow_map.method import FlowMap

from .scenes import scene_with

SCENE = scene_with(True, method=FlowMap(), teeth=None, wide=None, undamped=None)


def layout_with(terms: int) -> dict[str, Any]:
    """Return the names of the module, executed with this number of terms of the polynomials."""
    path = Path(layout.__file__)
    text, names = path.read_text(encoding="utf-8"), {"__name__": layout.__name__}
    exec(compile(text.replace("\nTERMS = 16\n", f"\nTERMS = {terms}\n"), path, "exec"), names)
    assert names["TERMS"] == terms
    return names


def assert_apart(parts: list[tuple[int, int]], end: int) -> None:
    """Check that parts, each a place and a size, do not overlap and do not exceed the end."""
    for (place, size), (following, _) in pairwise([*sorted(parts), (end, 0)]):
        assert place + size <= following


@pytest.mark.parametrize("terms", [12, 16, 18, 24])
def test_nothing_overlaps_whatever_the_number_of_terms(terms):
    names = layout_with(terms)
    at, place = names["aside_of"](SCENE), names["layout_of"](SCENE)
    of_a_gap = [(0, terms), (at.tangent_terms, terms), (at.moment, 1), (at.crossed, 2)]
    assert_apart([*of_a_gap, (at.side, 1), (at.distance, 1), (at.bend, 1)], at.gap_rows)
    gaps = [(at.gaps + at.gap_rows * element, at.gap_rows) for element in range(place.elements)]
    crossing = [(row, 1) for row in (at.after, at.factor, at.edge, at.element)]
    sums = [(at.sums, terms), (at.tangent_sums, terms)]
    assert_apart([(0, rows_of(SCENE).total), *gaps, *crossing, *sums], at.total)
    bounds = [(place.bounds + n * place.bound_size, place.columns) for n in range(place.elements)]
    assert_apart([(0, 2 * place.waves), *bounds], place.header)
    numbers = [(0, place.columns), (place.tangent_inputs, place.states)]
    assert_apart([*numbers, (place.result, place.width)], place.workspace)
    polynomials = [(place.gap, place.elements * place.columns * terms)]
    switches = [(place.switch, place.elements * terms * place.width)]
    assert_apart([(0, place.columns * place.width), *polynomials, *switches], place.size)
