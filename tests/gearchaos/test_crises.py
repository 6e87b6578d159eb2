"""A crisis is found only where a chaotic set is known to grow suddenly."""

import numpy as np
import pytest

from gearchaos.outputs.variable import coordinate
from gearchaos.records.label import CHAOTIC, MOTION_MEANINGS, PERIODIC
from gearchaos.results.reading.jumps import crises, grows_at
from gearchaos.results.reading.result import Result

from .listed_variables import sweep_variables

MERGING = 1.5 * np.sqrt(3.0)
"""Parameter at which the two chaotic sets of the cubic map meet: its maximum equals its zero."""

GROWTH = np.linspace(MERGING - 0.0615, MERGING + 0.0585, 41)


def cubic(points: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Return sections of x -> a x - x^3 in the right one of two sets, and whether chaotic."""
    x = np.full(GROWTH.size, 0.5)
    sections, growth = [], np.zeros(GROWTH.size)
    for number in range(2000 + points):
        growth += np.log(np.abs(GROWTH - 3.0 * x**2)) * (number >= 2000)
        x = GROWTH * x - x**3
        if number >= 2000:
            sections.append(x)
    return np.stack(sections, axis=1), growth > 0.1 * points


def test_the_two_sets_of_the_cubic_map_merge_where_they_are_known_to():
    section, chaotic = cubic()
    extent = np.ptp(section, axis=1)
    (lane,) = grows_at(extent, chaotic)
    assert GROWTH[lane - 1] < MERGING < GROWTH[lane]
    assert extent[lane] > 1.9 * extent[lane - 1]
    # Backwards the set shrinks; such a crisis is found from the other side.
    assert grows_at(extent[::-1], chaotic[::-1]).size == 0


@pytest.mark.parametrize(
    "extent",
    [
        np.ones(41),
        np.linspace(1.0, 3.0, 41),  # Steady growth.
        1.1 ** np.arange(41),
        1.0 + 0.03 * np.random.default_rng(2).normal(size=41),
        np.where(np.arange(41) == 20, 1.5, 1.0),  # A single burst.
        np.where(np.arange(41) >= 20, 1.1, 1.0),  # Too small.
        np.where(np.arange(41) >= 39, 1.5, 1.0),  # Too few lanes.
        # Not level before: one of the eight lanes is nearly as large.
        np.select([np.arange(41) == 14, np.arange(41) >= 20], [2.0, 2.5], 1.0),
    ],
)
def test_what_grows_steadily_or_not_for_good_is_no_crisis(extent):
    assert grows_at(extent, np.ones(41, dtype=bool)).size == 0


def test_periodic_motions_have_no_crisis():
    extent = np.where(np.arange(41) >= 20, 2.0, 1.0)
    assert grows_at(extent, np.ones(41, dtype=bool)).tolist() == [20]
    assert grows_at(extent, np.arange(41) >= 20).size == 0
    assert grows_at(extent, np.arange(41) < 20).size == 0


def result(backwards: bool) -> Result:
    section, chaotic = cubic(100)
    if backwards:
        section, chaotic = section[::-1], chaotic[::-1]
    axes = [coordinate("growth", "1", "growth", "", GROWTH)]
    variables = sweep_variables(
        axes,
        states=["delta_5", "delta_5_rate"],
        section=["delta_5", "delta_5_rate"],
        section_points=100,
        lyapunov=False,
        motion_meanings=MOTION_MEANINGS,
        status_meanings=["ok"],
    )
    arrays = {v.name: v.values for v in variables if v.values is not None}
    lanes = (GROWTH.size,)
    arrays |= {
        "section_delta_5": section,
        # This section grows at the same place, but less.
        "section_delta_5_rate": np.maximum(section, -0.5),
        "motion": np.where(chaotic, CHAOTIC, PERIODIC).astype(np.uint8),
        "period": np.where(chaotic, 0, 1).astype(np.int32),
        "return_distance": np.ones(lanes),
        "bands": np.ones(lanes, dtype=np.int32),
        "status": np.zeros(lanes, dtype=np.uint8),
        "diverged_period": np.full(lanes, -1, dtype=np.int32),
        "start_state": np.zeros((*lanes, 2)),
        "end_state": np.zeros((*lanes, 2)),
    }
    return Result(("growth",), variables, arrays, {}, {})


@pytest.mark.parametrize("backwards", [False, True])
def test_a_crisis_reports_what_the_section_spans_on_both_sides(backwards):
    (crisis,) = crises(result(backwards))
    spacing = GROWTH[1] - GROWTH[0]
    merging = GROWTH[0] + GROWTH[-1] - MERGING if backwards else MERGING
    # One lane beyond the merging, all hundred points may still lie in one of the two sets.
    assert crisis.below - spacing < merging < crisis.above + spacing
    assert crisis.above - crisis.below == pytest.approx(spacing)
    one, other = (crisis.lowest_below, crisis.lowest_above)[:: -1 if backwards else 1]
    assert one > 0.0 > -1.0 > other
    assert crisis.section == "section_delta_5"
